// SPDX-License-Identifier: Apache-2.0
// History of several sessions: undo of each by itself, gestures, what is forgotten; and random
// edits, gestures and undos of three sessions against a model that keeps all contents by value.
#include <malloc.h>

#include <algorithm>
#include <iostream>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "document/document.h"
#include "kernel/permit.h"
#include "support/seed.h"

namespace robomosp {
namespace {

using document::Author;
using document::Commit;
using document::CommitKind;
using document::Document;
using document::Transaction;

const Author kAnna{1, "anna"}, kBen{2, "ben"};

model::Solid session_ball(MaterialId material) {
  model::Solid s;
  s.material = material;
  s.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {0.1}});
  return s;
}

MaterialId add_material(Document& d, const Author& who, const std::string& name) {
  auto tx = d.begin("add " + name, who);
  const auto id = tx->add(name, model::Material{});
  EXPECT_TRUE(id.ok() && tx->commit().ok());
  return *id;
}

Result<void> change_density(Transaction& tx, AnyId id, double density) {
  return tx.edit(id, [density](model::Record& r) -> Result<void> {
    std::get<model::Material>(r.body).density = density;
    return {};
  });
}

Result<Commit> edit_session_density(Document& d, const Author& who, AnyId id, double density) {
  auto tx = d.begin("density " + std::to_string(static_cast<int>(density)), who);
  if (!tx.ok()) return std::move(tx).error();
  RMP_TRY(change_density(*tx, id, density));
  return tx->commit();
}

double density_in(const Document& d, MaterialId id) { return d.now()->get(id)->density; }

TEST(Sessions, UndoTakesBackTheOwnStepAndLeavesTheOthers) {
  Document d;
  const auto a = add_material(d, kAnna, "a"), b = add_material(d, kBen, "b");
  ASSERT_TRUE(edit_session_density(d, kAnna, a, 2).ok());
  ASSERT_TRUE(edit_session_density(d, kBen, b, 3).ok());
  ASSERT_TRUE(d.undo(kAnna.session).ok());
  EXPECT_EQ(density_in(d, a), 1000);
  EXPECT_EQ(density_in(d, b), 3);
  ASSERT_TRUE(d.undo(kBen.session).ok());
  EXPECT_EQ(density_in(d, b), 1000);
  ASSERT_TRUE(d.redo(kAnna.session).ok());
  EXPECT_EQ(density_in(d, a), 2);
  EXPECT_EQ(density_in(d, b), 1000);
  EXPECT_EQ(d.redo_labels(kBen.session), std::vector<std::string>{"density 3"});
}

TEST(Sessions, ANewStepEndsOnlyTheRedoOfItsSession) {
  Document d;
  const auto a = add_material(d, kAnna, "a"), b = add_material(d, kBen, "b");
  ASSERT_TRUE(edit_session_density(d, kAnna, a, 2).ok() && d.undo(kAnna.session).ok());
  ASSERT_TRUE(edit_session_density(d, kBen, b, 3).ok());
  EXPECT_EQ(d.redo_labels(kAnna.session).size(), 1U);
  ASSERT_TRUE(edit_session_density(d, kAnna, a, 4).ok());
  EXPECT_TRUE(d.redo_labels(kAnna.session).empty());
}

TEST(Sessions, ARefusalNamesWhoChangedWhat) {
  Document d;
  const auto a = add_material(d, kAnna, "alloy");
  ASSERT_TRUE(edit_session_density(d, kAnna, a, 2).ok());
  ASSERT_TRUE(edit_session_density(d, kBen, a, 3).ok());
  const auto refused = d.undo(kAnna.session);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::conflict);
  for (const char* word : {"alloy", "ben", "density 3"})
    EXPECT_NE(refused.error().sentence().find(word), std::string::npos)
        << refused.error().sentence();
  EXPECT_EQ(density_in(d, a), 3);
  ASSERT_TRUE(d.undo(kBen.session).ok());
  EXPECT_TRUE(d.undo(kAnna.session).ok()) << "it is again as Anna left it";
  EXPECT_EQ(density_in(d, a), 1000);
}

TEST(Sessions, WhatOthersReferToSinceIsNotUndone) {
  Document d;
  const auto a = add_material(d, kAnna, "alloy");
  auto tx = d.begin("add ball", kBen);
  ASSERT_TRUE(tx->add("ball", session_ball(a)).ok() && tx->commit().ok());
  const auto refused = d.undo(kAnna.session);
  ASSERT_FALSE(refused.ok());
  for (const char* word : {"ball", "ben", "alloy"})
    EXPECT_NE(refused.error().sentence().find(word), std::string::npos)
        << refused.error().sentence();
}

TEST(Sessions, ANameThatAnotherTookSinceIsNotTakenBack) {
  Document d;
  const auto a = add_material(d, kAnna, "one");
  auto tx = d.begin("rename", kAnna);
  ASSERT_TRUE(tx->edit(a,
                       [](model::Record& r) -> Result<void> {
                         r.name = "two";
                         return {};
                       })
                  .ok() &&
              tx->commit().ok());
  add_material(d, kBen, "one");
  const auto refused = d.undo(kAnna.session);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("ben"), std::string::npos)
      << refused.error().sentence();
}

TEST(Sessions, AStepIsUndoneByItsNumber) {
  Document d;
  const auto a = add_material(d, kAnna, "a"), b = add_material(d, kAnna, "b");
  ASSERT_TRUE(edit_session_density(d, kAnna, a, 2).ok());
  const auto step = d.history().back().number;
  ASSERT_TRUE(edit_session_density(d, kAnna, b, 3).ok());
  EXPECT_FALSE(d.undo(kBen.session, step).ok()) << "not Ben's";
  ASSERT_TRUE(d.undo(kAnna.session, step).ok());
  EXPECT_EQ(density_in(d, a), 1000);
  EXPECT_EQ(density_in(d, b), 3);
  EXPECT_FALSE(d.undo(kAnna.session, step).ok()) << "it is undone";
}

// --- gestures ------------------------------------------------------------------------------

Result<Commit> update(Document& d, std::uint64_t gesture, AnyId id, double density) {
  RMP_TRY_ASSIGN(auto tx, d.begin_update(gesture));
  RMP_TRY(change_density(tx, id, density));
  return tx.commit();
}

TEST(Gestures, UpdatesAreSeenAndBecomeOneStep) {
  Document d;
  const auto a = add_material(d, kAnna, "a");
  const auto g = *d.begin_gesture("drag", kAnna);
  for (int i = 1; i <= 50; ++i) {
    const auto shown = update(d, g, a, i);
    ASSERT_TRUE(shown.ok());
    EXPECT_EQ(shown->kind, CommitKind::preview);
    EXPECT_EQ(density_in(d, a), i);
    EXPECT_EQ(d.undo_labels().size(), 1U);
  }
  ASSERT_TRUE(d.commit_gesture(g).ok());
  EXPECT_EQ(d.undo_labels(), (std::vector<std::string>{"drag", "add a"}));
  ASSERT_TRUE(d.undo(kAnna.session).ok());
  EXPECT_EQ(density_in(d, a), 1000);
}

TEST(Gestures, CancellingLeavesUndoAndRedoAsTheyWere) {
  Document d;
  const auto a = add_material(d, kAnna, "a");
  ASSERT_TRUE(edit_session_density(d, kAnna, a, 2).ok() && d.undo(kAnna.session).ok());
  const std::string before = d.content_digest();
  const auto g = *d.begin_gesture("drag", kAnna);
  ASSERT_TRUE(update(d, g, a, 7).ok());
  EXPECT_EQ(d.redo_labels(kAnna.session).size(), 1U) << "a preview ends no redo";
  ASSERT_TRUE(d.cancel_gesture(g).ok());
  EXPECT_EQ(d.content_digest(), before);
  ASSERT_TRUE(d.redo(kAnna.session).ok());
  EXPECT_EQ(density_in(d, a), 2);
}

TEST(Gestures, OneThatChangesNothingInTheEndLeavesNoStep) {
  Document d;
  const auto a = add_material(d, kAnna, "a");
  const auto g = *d.begin_gesture("drag", kAnna);
  ASSERT_TRUE(update(d, g, a, 7).ok() && update(d, g, a, 1000).ok());
  ASSERT_TRUE(d.commit_gesture(g).ok());
  EXPECT_EQ(d.undo_labels().size(), 1U);
}

TEST(Gestures, NobodyElseTouchesWhatOneHolds) {
  Document d;
  const auto a = add_material(d, kAnna, "a"), b = add_material(d, kBen, "b");
  const auto g = *d.begin_gesture("drag", kAnna);
  ASSERT_TRUE(update(d, g, a, 7).ok());
  const auto refused = edit_session_density(d, kBen, a, 9);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().sentence().find("anna"), std::string::npos);
  EXPECT_TRUE(edit_session_density(d, kBen, b, 9).ok()) << "the rest is free";
  EXPECT_TRUE(d.cancel_gesture(g).ok());
  EXPECT_TRUE(edit_session_density(d, kBen, a, 9).ok());
}

TEST(Gestures, NobodyElseKeepsOneFromBeingCancelled) {
  Document d;
  const auto g = *d.begin_gesture("new", kAnna);
  auto tx = d.begin_update(g);
  const auto made = *tx->add("made", model::Material{});
  ASSERT_TRUE(tx->commit().ok());
  auto other = d.begin("refer", kBen);
  ASSERT_TRUE(other->add("ball", session_ball(made)).ok());
  EXPECT_FALSE(other->commit().ok()) << "it would refer to what may vanish";
  ASSERT_TRUE(d.cancel_gesture(g).ok());
  EXPECT_EQ(d.now()->size(), 0U);
}

TEST(Gestures, ASessionHasOneAtATime) {
  Document d;
  const auto g = *d.begin_gesture("drag", kAnna);
  EXPECT_FALSE(d.begin_gesture("another", kAnna).ok());
  EXPECT_TRUE(d.begin_gesture("another", kBen).ok());
  EXPECT_FALSE(d.undo(kAnna.session).ok()) << "first commit or cancel it";
  EXPECT_TRUE(d.cancel_gesture(g).ok());
  EXPECT_FALSE(d.cancel_gesture(g).ok());
}

// --- memory --------------------------------------------------------------------------------

TEST(HistoryMemory, StaysWithinTheBudgetHoweverManyEdits) {
  constexpr std::size_t kBudget = std::size_t{8} << 20;
  Document d(kBudget);
  auto tx = d.begin("fill");
  std::vector<AnyId> ids;
  for (int i = 0; i < 500; ++i) {
    model::Solid s;
    s.nodes.push_back({CsgKind::union_, "all", -1, {}, {}});
    for (int n = 0; n < 10; ++n)
      s.nodes.push_back({CsgKind::sphere, "node number " + std::to_string(n), 0, {}, {0.1}});
    ids.push_back(*tx->add("solid " + std::to_string(i), std::move(s)));
  }
  ASSERT_TRUE(tx->commit().ok());
  const std::size_t before = ::mallinfo2().uordblks;
  for (int i = 0; i < 20000; ++i) {
    auto size = d.begin("size");
    ASSERT_TRUE(size->edit(ids[static_cast<std::size_t>(i) % ids.size()],
                           [&](model::Record& r) -> Result<void> {
                             std::get<model::Solid>(r.body).nodes[1].sizes[0] = 1 + i;
                             return {};
                           })
                    .ok());
    ASSERT_TRUE(size->commit().ok());
  }
  EXPECT_GT(d.forgotten_steps(), 0U);
  EXPECT_LE(d.history_bytes(), kBudget);
  const std::size_t taken = ::mallinfo2().uordblks - before;
  std::cout << "20,000 edits keep " << taken / 1024 << " KiB of a budget of " << kBudget / 1024
            << " KiB\n";
  EXPECT_LT(taken, 2 * kBudget) << "what is counted must be about what is taken";
  EXPECT_GT(d.undo_labels().size(), 500U);
  while (!d.undo_labels().empty()) ASSERT_TRUE(d.undo().ok());
  const auto end = d.undo();
  ASSERT_FALSE(end.ok());
  EXPECT_NE(end.error().sentence().find("forgotten"), std::string::npos) << end.error().sentence();
}

TEST(HistoryMemory, ASmallerBudgetForgetsTheOldestAtOnce) {
  Document d;
  const auto a = add_material(d, kAnna, "a");
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(edit_session_density(d, kAnna, a, i).ok());
  const auto bytes = d.history_bytes();
  ASSERT_TRUE(d.set_history_budget(bytes / 2).ok());
  EXPECT_LE(d.history_bytes(), bytes / 2);
  EXPECT_EQ(d.undo_labels().front(), "density 99");
  ASSERT_TRUE(d.set_history_budget(0).ok());
  EXPECT_EQ(d.undo_labels().size(), 1U) << "the newest step stays";
}

TEST(DocumentPermit, WithoutTheEffectNothingIsEdited) {
  Document d;
  const auto a = add_material(d, kAnna, "a");
  const std::string before = d.content_digest();
  const Permit reads{"guest", "some.command", Effect::reads, Effect::edits};
  const PermitScope scope(&reads);
  EXPECT_EQ(edit_session_density(d, kAnna, a, 2).error().code, ErrorCode::permission);
  EXPECT_EQ(d.undo().error().code, ErrorCode::permission);
  EXPECT_EQ(d.begin_gesture("drag", kAnna).error().code, ErrorCode::permission);
  EXPECT_EQ(d.content_digest(), before);
}

// --- against a model -----------------------------------------------------------------------

struct Item {
  std::string name;
  double value = 0;        ///< a material's density
  std::uint64_t uses = 0;  ///< a solid's material; 0 = it is a material itself, or has none
  bool is_solid = false;
  bool operator==(const Item&) const = default;
};
using Contents = std::map<std::uint64_t, Item>;
using Before = std::map<std::uint64_t, std::optional<Item>>;

std::optional<Item> look(const Contents& c, std::uint64_t id) {
  const auto at = c.find(id);
  return at == c.end() ? std::nullopt : std::optional(at->second);
}
void put(Contents& c, std::uint64_t id, const std::optional<Item>& item) {
  if (item) c[id] = *item;
  else c.erase(id);
}
bool holds_together(const Contents& c) {
  std::set<std::pair<bool, std::string>> names;
  for (const auto& [id, item] : c) {
    if (!names.emplace(item.is_solid, item.name).second) return false;
    if (item.uses && (!c.contains(item.uses) || c.at(item.uses).is_solid)) return false;
  }
  return true;
}

struct ModelStep {
  std::uint64_t session = 0;
  Before before, after;
  int undone = 0;
};
struct ModelGesture {
  std::uint64_t number = 0;
  Before before;
};

struct Model {
  Contents now;
  std::vector<ModelStep> steps;
  std::map<std::uint64_t, ModelGesture> open;  ///< by session
  int undos = 0;

  /// What the document must do with a state that somebody wants to publish.
  [[nodiscard]] bool allows(const Contents& next, std::uint64_t gesture) const {
    if (!holds_together(next)) return false;
    for (const auto& [session, g] : open) {
      if (g.number == gesture) continue;
      Contents cancelled = next;
      for (const auto& [id, item] : g.before) {
        if (look(next, id) != look(now, id)) return false;
        put(cancelled, id, item);
      }
      if (!g.before.empty() && !holds_together(cancelled)) return false;
    }
    return true;
  }
  void remember(std::uint64_t session, const Before& before) {
    ModelStep step{session, {}, {}, 0};
    for (const auto& [id, item] : before)
      if (item != look(now, id)) {
        step.before[id] = item;
        step.after[id] = look(now, id);
      }
    if (step.before.empty()) return;
    std::erase_if(steps, [&](const ModelStep& s) { return s.undone && s.session == session; });
    steps.push_back(std::move(step));
  }
  ModelStep* next(std::uint64_t session, bool is_undo) {
    ModelStep* best = nullptr;
    for (ModelStep& s : steps)
      if (s.session == session && (s.undone == 0) == is_undo &&
          (!best || is_undo || s.undone > best->undone))
        best = &s;
    return best;
  }
};

Contents contents(const Document& d) {
  Contents out;
  const auto now = d.now();
  for (const AnyId id : now->list()) {
    Item item;
    item.name = now->find(id)->name;
    if (const auto* m = now->get(MaterialId{id.number})) item.value = m->density;
    if (const auto* s = now->get(SolidId{id.number})) {
      item.is_solid = true;
      item.uses = s->material.number;
    }
    out[id.number] = item;
  }
  return out;
}

TEST(SessionsModel, TenThousandEditsGesturesAndUndosOfThreeSessions) {
  const auto seed = test::seed();
  std::mt19937_64 random(seed);
  const auto pick = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  Document d;
  Model m;
  std::map<std::string, int> done;
  for (int round = 0; round < 10000; ++round) {
    const std::uint64_t session = 1 + pick(3);
    const Author who{session, "s" + std::to_string(session)};
    const std::string trace = "round " + std::to_string(round) + " of " + who.name;
    const auto gesture = m.open.find(session);
    const std::size_t what = pick(20);
    if (what < 3 || what == 3) {  // undo, redo
      const bool is_undo = what != 3;
      ModelStep* step = m.next(session, is_undo);
      bool allowed = step != nullptr && gesture == m.open.end();
      Contents next = m.now;
      if (allowed)
        for (const auto& [id, item] : is_undo ? step->before : step->after) {
          allowed = allowed && look(m.now, id) == (is_undo ? step->after : step->before).at(id);
          put(next, id, item);
        }
      allowed = allowed && m.allows(next, 0);
      const auto result = is_undo ? d.undo(session) : d.redo(session);
      ASSERT_EQ(result.ok(), allowed) << trace << (is_undo ? " undo " : " redo ")
                                      << (result.ok() ? "" : result.error().sentence());
      if (allowed) {
        step->undone = is_undo ? ++m.undos : 0;
        m.now = next;
        ++done[is_undo ? "undo" : "redo"];
      } else if (step) {
        ++done["refused undo"];
      }
    } else if (what == 4 && gesture == m.open.end()) {
      const auto g = d.begin_gesture("gesture", who);
      ASSERT_TRUE(g.ok()) << trace;
      m.open[session] = {*g, {}};
    } else if (what == 5 && gesture != m.open.end()) {
      const bool keeps = pick(2) == 0;
      const auto result = keeps ? d.commit_gesture(gesture->second.number)
                                : d.cancel_gesture(gesture->second.number);
      ASSERT_TRUE(result.ok()) << trace << ": " << result.error().sentence();
      if (keeps) {
        m.remember(session, gesture->second.before);
      } else {
        for (const auto& [id, item] : gesture->second.before) put(m.now, id, item);
      }
      ++done[keeps ? "kept" : "cancelled"];
      m.open.erase(gesture);
    } else {
      const bool in_gesture = gesture != m.open.end() && pick(3) != 0;
      auto tx = in_gesture ? d.begin_update(gesture->second.number) : d.begin("edit", who);
      ASSERT_TRUE(tx.ok()) << trace;
      Contents next = m.now;
      bool model_ok = true, ok = true;
      for (std::size_t edits = 1 + pick(3); edits > 0 && model_ok && ok; --edits) {
        const std::string name = "n" + std::to_string(pick(30));
        std::vector<std::uint64_t> ids;
        for (const auto& [id, item] : next) ids.push_back(id);
        const std::uint64_t target = ids.empty() ? 0 : ids[pick(ids.size())];
        const auto clashes = [&](bool is_solid, std::uint64_t except) {
          for (const auto& [id, item] : next)
            if (id != except && item.is_solid == is_solid && item.name == name) return true;
          return false;
        };
        const std::size_t kind = pick(ids.empty() ? 1 : 7);
        if (kind == 0) {
          const double value = static_cast<double>(1 + pick(5));
          model::Material material;
          material.density = value;
          model_ok = !clashes(false, 0);
          const auto id = tx->add(name, material);
          ok = id.ok();
          if (ok) next[id->number] = {name, value, 0, false};
        } else if (kind == 1) {
          const std::uint64_t uses = pick(3) == 0 || next.at(target).is_solid ? 0 : target;
          model_ok = !clashes(true, 0);
          const auto id = tx->add(name, session_ball(MaterialId{uses}));
          ok = id.ok();
          if (ok) next[id->number] = {name, 0, uses, true};
        } else if (kind == 2) {
          const AnyId id{next.at(target).is_solid ? Kind::solid : Kind::material, target};
          model_ok = std::none_of(next.begin(), next.end(),
                                  [&](const auto& e) { return e.second.uses == target; });
          ok = tx->remove(id).ok();
          next.erase(target);
        } else if (kind == 3) {
          const AnyId id{next.at(target).is_solid ? Kind::solid : Kind::material, target};
          model_ok = !clashes(id.kind == Kind::solid, target);
          ok = tx->edit(id, [&](model::Record& r) -> Result<void> {
                   r.name = name;
                   return {};
                 }).ok();
          next.at(target).name = name;
        } else if (!next.at(target).is_solid) {
          const double value = static_cast<double>(1 + pick(5));
          ok = change_density(*tx, MaterialId{target}, value).ok();
          next.at(target).value = value;
        } else {
          const std::uint64_t other = ids[pick(ids.size())];
          const std::uint64_t uses = next.at(other).is_solid ? 0 : other;
          ok = tx->edit(SolidId{target}, [&](model::Record& r) -> Result<void> {
                   std::get<model::Solid>(r.body).material = MaterialId{uses};
                   return {};
                 }).ok();
          next.at(target).uses = uses;
        }
        ASSERT_EQ(ok, model_ok) << trace;
      }
      if (!ok) continue;
      Before before;
      for (const auto& [id, item] : m.now)
        if (look(next, id) != item) before[id] = item;
      for (const auto& [id, item] : next)
        if (!m.now.contains(id)) before[id] = std::nullopt;
      const std::uint64_t number = in_gesture ? gesture->second.number : 0;
      const bool allowed = before.empty() || m.allows(next, number);
      const auto result = tx->commit();
      ASSERT_EQ(result.ok(), allowed) << trace << (result.ok() ? "" : result.error().sentence());
      if (!allowed) {
        ++done["refused edit"];
        continue;
      }
      m.now = next;
      ++done[in_gesture ? "preview" : "edit"];
      if (in_gesture) {
        for (const auto& [id, item] : before) gesture->second.before.emplace(id, item);
      } else {
        m.remember(session, before);
      }
    }
    ASSERT_EQ(contents(d), m.now) << trace;
    ASSERT_EQ(d.undo_labels().size(),
              static_cast<std::size_t>(std::count_if(m.steps.begin(), m.steps.end(),
                                                     [](const auto& s) { return s.undone == 0; })))
        << trace;
  }
  for (const char* each :
       {"undo", "redo", "refused undo", "kept", "cancelled", "refused edit", "preview", "edit"})
    EXPECT_GT(done[each], 20) << each << " was hardly tried; seed " << seed;
}

}  // namespace
}  // namespace robomosp
