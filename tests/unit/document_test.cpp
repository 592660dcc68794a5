// SPDX-License-Identifier: Apache-2.0
// Document: snapshots, transactions, references, cycles, history; and a random walk of edits whose
// undo and redo must give the same contents again.
#include "document/document.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "document/changed.h"
#include "document/world_index.h"
#include "support/records.h"
#include "support/seed.h"

namespace robomosp {
namespace {

using document::Commit;
using document::Document;
using document::Snapshot;
using document::Transaction;
using test::make;

model::Solid ball(MaterialId material = {}) {
  model::Solid s;
  s.material = material;
  s.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {0.1}});
  return s;
}
model::Object object_of(std::vector<AnyId> parts) {
  model::Object o;
  for (const AnyId id : parts)
    o.parts.push_back({"p" + std::to_string(o.parts.size()), id, {}, {}});
  return o;
}
Result<void> set_density(Transaction& tx, AnyId id, double density) {
  return tx.edit(id, [density](model::Record& r) -> Result<void> {
    std::get<model::Material>(r.body).density = density;
    return {};
  });
}
Result<Commit> edit_density(Document& d, AnyId id, double density,
                            const std::string& gesture = {}) {
  auto tx = d.begin("density", gesture);
  if (!tx.ok()) return std::move(tx).error();
  RMP_TRY(set_density(*tx, id, density));
  return tx->commit();
}
Result<Commit> set_parts(Document& d, ObjectId id, std::vector<AnyId> parts) {
  auto tx = d.begin("parts");
  RMP_TRY(tx->edit(id, [&](model::Record& r) -> Result<void> {
    r.body = object_of(parts);
    return {};
  }));
  return tx->commit();
}
double density(const Snapshot& s, AnyId id) { return s.get(MaterialId{id.number})->density; }

// Records are kept in pages of 512: the list, comparisons and undo go across them.
TEST(Document, RecordsOfSeveralPagesAreListedComparedAndTakenBack) {
  constexpr int kMany = 1'300;
  Document d;
  const AnyId first = make(d, "first", model::Material{});
  const auto before = d.now();
  auto tx = d.begin("many");
  ASSERT_TRUE(tx.ok());
  std::vector<AnyId> made;
  for (int i = 0; i < kMany; ++i) {
    const auto id = tx->add("m" + std::to_string(i), model::Material{});
    ASSERT_TRUE(id.ok());
    made.push_back(AnyId(*id));
  }
  ASSERT_TRUE(tx->commit().ok());
  const auto after = d.now();
  EXPECT_EQ(document::changed_records(*before, *after), made);
  EXPECT_EQ(document::changed_records(*after, *before), made);
  std::vector<AnyId> all{first};
  all.insert(all.end(), made.begin(), made.end());
  EXPECT_EQ(after->list(), all);
  // On both sides of each border of a chunk and of a page.
  std::vector<AnyId> edited;
  for (std::size_t i = 0; i < made.size(); ++i)
    if (const std::uint64_t in_chunk = made[i].number % 16; in_chunk == 0 || in_chunk == 15)
      edited.push_back(made[i]);
  auto edit = d.begin("edit");
  ASSERT_TRUE(edit.ok());
  for (const AnyId id : edited) ASSERT_TRUE(set_density(*edit, id, 2).ok());
  ASSERT_TRUE(edit->commit().ok());
  EXPECT_EQ(document::changed_records(*after, *d.now()), edited);
  ASSERT_TRUE(d.undo().ok());
  EXPECT_TRUE(document::changed_records(*after, *d.now()).empty());
  ASSERT_TRUE(d.undo().ok());
  EXPECT_TRUE(document::changed_records(*before, *d.now()).empty());
  EXPECT_EQ(d.now()->list(), std::vector<AnyId>{first});
}

TEST(Document, SnapshotsStayAsTheyWere) {
  Document d;
  const auto id = make(d, "steel", model::Material{});
  const auto before = d.now();
  ASSERT_TRUE(edit_density(d, id, 7850).ok());
  EXPECT_EQ(density(*before, id), 1000);
  EXPECT_EQ(density(*d.now(), id), 7850);
  EXPECT_LT(before->revision(), d.now()->revision());
}

TEST(Document, RecordsAreFoundByIdKindAndName) {
  Document d;
  const auto m = make(d, "steel", model::Material{});
  const auto s = make(d, "steel", ball(m));
  const auto now = d.now();
  EXPECT_EQ(now->size(), 2U);
  EXPECT_EQ(*now->find(Kind::material, "steel"), AnyId(m));
  EXPECT_EQ(*now->find(Kind::solid, "steel"), AnyId(s));
  EXPECT_FALSE(now->find(Kind::robot, "steel"));
  EXPECT_FALSE(now->find(Kind::material, "stee"));
  EXPECT_EQ(now->find(AnyId{Kind::robot, m.number}), nullptr) << "an id is of one kind";
  EXPECT_EQ(now->list(), (std::vector<AnyId>{m, s}));
  EXPECT_EQ(now->referrers(m), std::vector<AnyId>{s});
  EXPECT_EQ(now->describe(m), "material \"steel\"");
  EXPECT_EQ(now->describe(AnyId{Kind::robot, 17}), "robot #17 (deleted)");
}

TEST(Document, ATransactionThatIsDroppedLeavesNothing) {
  Document d;
  const auto id = make(d, "steel", model::Material{});
  const auto revision = d.now()->revision();
  {
    auto tx = d.begin("try");
    ASSERT_TRUE(set_density(*tx, id, 1).ok());
    ASSERT_TRUE(tx->add("other", model::Material{}).ok());
    EXPECT_EQ(tx->now().size(), 2U);
  }
  EXPECT_EQ(d.now()->revision(), revision);
  EXPECT_EQ(d.now()->size(), 1U);
  EXPECT_EQ(density(*d.now(), id), 1000);
  EXPECT_TRUE(d.begin("again").ok());
}

TEST(Document, NumbersOfIdsAreNeverUsedAgain) {
  Document d;
  std::set<std::uint64_t> seen;
  for (int i = 0; i < 5; ++i) {
    const auto id = make(d, "m", model::Material{});
    EXPECT_TRUE(seen.insert(id.number).second);
    ASSERT_TRUE(d.undo().ok());
  }
  {
    auto tx = d.begin("dropped");
    EXPECT_TRUE(seen.insert(tx->add("m", model::Material{})->number).second);
  }
  EXPECT_TRUE(seen.insert(make(d, "m", model::Material{}).number).second);
}

TEST(Document, NamesAreCheckedAndUniquePerKind) {
  Document d;
  const auto id = make(d, "pa10", model::Robot{});
  auto tx = d.begin("x");
  EXPECT_EQ(tx->add("pa10", model::Robot{}).error().sentence(),
            "there is already a robot named \"pa10\". Choose another name.");
  EXPECT_TRUE(tx->add("pa10", model::World{}).ok());
  EXPECT_EQ(tx->add("1st", model::Robot{}).error().sentence(),
            "\"1st\" cannot be the name of a robot. A name starts with a letter of any script and "
            "has letters, "
            "digits, _ - . and spaces, none "
            "at the end.");
  for (const char* bad : {"", " a", "a ", "a/b", "a\n", "_a", "\xC3", "a\xC3\xA9\xE9",
                          "\xCC\x81"
                          "a",
                          "a\xE2\x80\xAE"
                          "b",
                          "a\xE2\x80\x8B", "\xED\xA0\x80",
                          "a\xC2\xA0"
                          "b"})
    EXPECT_FALSE(tx->add(bad, model::Robot{}).ok()) << bad;
  for (const char* good : {"a", "A b", "a-1.2_c", "\xC3\xA9", "Tr\xC3\xA4ger 2",
                           "\xE9\x83\xA8\xE5\x93\x81", "\xD0\x9C\xD0\xB8\xD1\x80", "e\xCC\x81"})
    EXPECT_TRUE(tx->add(good, model::Robot{}).ok()) << good;
  EXPECT_EQ(tx->free_name(Kind::robot, "pa10"), "pa10_2");
  EXPECT_EQ(tx->free_name(Kind::robot, "new"), "new");
  const auto renamed = tx->edit(id, [](model::Record& r) -> Result<void> {
    r.name = "a";
    return {};
  });
  EXPECT_EQ(renamed.error().code, ErrorCode::conflict);
  ASSERT_TRUE(tx->edit(id, [](model::Record& r) -> Result<void> {
                  r.name = "pa11";
                  return {};
                }).ok());
  EXPECT_FALSE(tx->now().find(Kind::robot, "pa10"));
  EXPECT_EQ(*tx->now().find(Kind::robot, "pa11"), AnyId(id));
}

TEST(Document, RemovalIsRefusedWhileOthersReferAndNamesThem) {
  Document d;
  const auto bore = make(d, "bore", ball());
  const auto arm = make(d, "arm", object_of({bore}));
  const auto hand = make(d, "hand", object_of({bore, bore}));
  auto tx = d.begin("remove");
  EXPECT_EQ(tx->remove(bore).error().sentence(),
            "cannot remove solid \"bore\": object \"arm\" and object \"hand\" refer to it. Remove "
            "or change those first.");
  ASSERT_TRUE(tx->remove(arm).ok());
  EXPECT_EQ(tx->remove(bore).error().sentence(),
            "cannot remove solid \"bore\": object \"hand\" refers to it. Remove or change that one "
            "first.");
  ASSERT_TRUE(tx->remove(hand).ok());
  ASSERT_TRUE(tx->remove(bore).ok());
  EXPECT_EQ(tx->remove(bore).error().sentence(),
            "solid #1 no longer exists. Look it up again by its name.");
  ASSERT_TRUE(tx->commit().ok());
  EXPECT_EQ(d.now()->size(), 0U);
}

TEST(Document, ALongListOfReferrersIsCutShort) {
  Document d;
  const auto bore = make(d, "bore", ball());
  for (int i = 0; i < 8; ++i) make(d, "o" + std::to_string(i), object_of({bore}));
  auto tx = d.begin("remove");
  EXPECT_EQ(tx->remove(bore).error().message,
            "cannot remove solid \"bore\": object \"o0\", object \"o1\", object \"o2\", object "
            "\"o3\", object \"o4\" and 3 more "
            "refer to it");
}

TEST(Document, AnObjectInsideItselfIsRefusedWithThePath) {
  Document d;
  const auto solid = make(d, "ball", ball());
  const auto hand = make(d, "hand", object_of({solid}));
  const auto palm = make(d, "palm", object_of({hand}));
  const auto gripper = make(d, "gripper", object_of({palm}));
  EXPECT_EQ(set_parts(d, hand, {solid, gripper}).error().sentence(),
            "object \"hand\" cannot refer to object \"gripper\", which refers to it in turn "
            "(gripper > palm > hand). Remove one of these references first.");
  EXPECT_EQ(set_parts(d, hand, {hand}).error().sentence(),
            "object \"hand\" cannot refer to itself.");
  EXPECT_EQ(d.now()->get(hand)->parts.size(), 1U);
  EXPECT_TRUE(set_parts(d, gripper, {palm, hand, solid}).ok()) << "using a part twice is no cycle";
}

TEST(Document, ChainsOfObjectsMayBeVeryDeep) {
  constexpr int kDepth = 20'000;
  Document d;
  auto tx = d.begin("chain");
  std::vector<ObjectId> all{*tx->add("o0", object_of({*tx->add("ball", ball())}))};
  for (int i = 1; i < kDepth; ++i)
    all.push_back(*tx->add("o" + std::to_string(i), object_of({all.back()})));
  const auto commit = tx->commit();
  ASSERT_TRUE(commit.ok());
  EXPECT_EQ(set_parts(d, all[0], {all.back()}).error().code, ErrorCode::conflict);
}

TEST(Document, ReferencesMustExistAndFit) {
  Document d;
  const auto m = make(d, "steel", model::Material{});
  auto add = [&](auto content) {
    auto tx = d.begin("x");
    EXPECT_TRUE(tx->add("x", content).ok());
    const auto commit = tx->commit();
    EXPECT_FALSE(commit.ok());
    EXPECT_EQ(d.now()->size(), 1U);
    return commit.ok() ? "" : commit.error().sentence();
  };
  EXPECT_EQ(add(ball(MaterialId{99})),
            "solid \"x\": \"material\" refers to material #99, which does not exist.");
  EXPECT_EQ(
      add(object_of({m})),
      "object \"x\": \"p0\" refers to material \"steel\". Only a solid or an object can be there.");
  EXPECT_EQ(add(object_of({AnyId{Kind::solid, m.number}})),
            "object \"x\": \"p0\" refers to solid #1, which does not exist.");
}

TEST(Document, ACommitTellsWhatIsAffectedEachAfterWhatItRefersTo) {
  Document d;
  const auto steel = make(d, "steel", model::Material{});
  // Objects are made outer first, so that ascending ids are not the right order.
  const auto outer = make(d, "outer", model::Object{});
  const auto inner = make(d, "inner", model::Object{});
  const auto solid = make(d, "solid", ball(steel));
  const auto other = make(d, "other", ball());
  ASSERT_TRUE(set_parts(d, inner, {solid}).ok());
  ASSERT_TRUE(set_parts(d, outer, {inner, other}).ok());
  model::Robot r;
  r.base_parts.push_back({outer, {}});
  const auto robot = make(d, "robot", r);
  model::World w;
  w.robots.push_back({"r", robot, {}, {}});
  const auto world = make(d, "world", w);
  const auto commit = edit_density(d, steel, 5);
  ASSERT_TRUE(commit.ok());
  EXPECT_EQ(commit->changed, std::vector<AnyId>{steel});
  EXPECT_EQ(commit->affected, (std::vector<AnyId>{steel, solid, inner, outer, robot, world}));
  EXPECT_EQ(d.undo()->affected, commit->affected);
}

TEST(Document, ACommitWithoutChangesIsNoStep) {
  Document d;
  const auto id = make(d, "steel", model::Material{});
  const auto revision = d.now()->revision();
  int told = 0;
  d.on_commit([&](const Commit&) { ++told; });
  EXPECT_TRUE(edit_density(d, id, 1000)->changed.empty());
  auto tx = d.begin("there and back");
  ASSERT_TRUE(set_density(*tx, id, 5).ok());
  ASSERT_TRUE(set_density(*tx, id, 1000).ok());
  ASSERT_TRUE(tx->remove(*tx->add("gone", model::Material{})).ok());
  EXPECT_TRUE(tx->commit()->changed.empty());
  EXPECT_EQ(tx->commit().error().sentence(), "this transaction has ended. Start a new one.");
  EXPECT_EQ(d.now()->revision(), revision);
  EXPECT_EQ(d.undo_labels().size(), 1U);
  EXPECT_EQ(told, 0);
}

TEST(Document, UndoAndRedoStepThroughLabels) {
  Document d;
  const auto id = make(d, "steel", model::Material{});
  ASSERT_TRUE(edit_density(d, id, 2).ok());
  EXPECT_EQ(d.undo_labels(), (std::vector<std::string>{"density", "add steel"}));
  ASSERT_TRUE(d.undo().ok());
  EXPECT_EQ(density(*d.now(), id), 1000);
  EXPECT_EQ(d.redo_labels(), std::vector<std::string>{"density"});
  ASSERT_TRUE(d.undo().ok());
  EXPECT_EQ(d.now()->find(id), nullptr);
  EXPECT_EQ(d.undo().error().sentence(), "there is nothing to undo.");
  ASSERT_TRUE(d.redo().ok());
  ASSERT_TRUE(d.redo().ok());
  EXPECT_EQ(density(*d.now(), id), 2);
  EXPECT_EQ(d.redo().error().sentence(), "there is nothing to redo.");
  ASSERT_TRUE(d.undo().ok());
  ASSERT_TRUE(edit_density(d, id, 3).ok());
  EXPECT_TRUE(d.redo_labels().empty()) << "a new edit ends what could be redone";
}

TEST(Document, EditsOfOneGestureAreOneStep) {
  Document d;
  const auto id = make(d, "steel", model::Material{});
  for (int i = 1; i <= 10; ++i) ASSERT_TRUE(edit_density(d, id, i, "drag 1").ok());
  ASSERT_TRUE(edit_density(d, id, 20, "drag 2").ok());
  EXPECT_EQ(d.undo_labels().size(), 3U);
  ASSERT_TRUE(d.undo().ok());
  EXPECT_EQ(density(*d.now(), id), 10);
  ASSERT_TRUE(edit_density(d, id, 30, "drag 1").ok());
  EXPECT_EQ(d.undo_labels().size(), 3U) << "after an undo a gesture starts anew";
  ASSERT_TRUE(d.undo().ok());
  ASSERT_TRUE(d.undo().ok());
  EXPECT_EQ(density(*d.now(), id), 1000);
}

TEST(Document, HistoryKeepsToItsBudget) {
  Document d(30'000);
  const auto id = make(d, "steel", model::Material{});
  for (int i = 1; i <= 100; ++i) ASSERT_TRUE(edit_density(d, id, i).ok());
  const auto kept = d.undo_labels().size();
  EXPECT_GT(kept, 5U);
  EXPECT_LT(kept, 50U);
  for (std::size_t i = 0; i < kept; ++i) ASSERT_TRUE(d.undo().ok());
  EXPECT_EQ(density(*d.now(), id), 100 - static_cast<double>(kept));
  Document tiny(1);
  const auto m = make(tiny, "steel", model::Material{});
  ASSERT_TRUE(edit_density(tiny, m, 5).ok());
  EXPECT_EQ(tiny.undo_labels().size(), 1U) << "the last step can always be undone";
}

TEST(Document, ListenersHearOfCommitsUndoAndRedo) {
  Document d;
  std::vector<std::string> heard;
  d.on_commit(
      [&](const Commit& c) { heard.push_back(c.label + " " + std::to_string(c.changed.size())); });
  make(d, "steel", model::Material{});
  ASSERT_TRUE(d.undo().ok());
  ASSERT_TRUE(d.redo().ok());
  d.clear();
  EXPECT_EQ(heard,
            (std::vector<std::string>{"add steel 1", "add steel 1", "add steel 1", "clear 1"}));
}

TEST(Document, ATransactionFromBeforeAClearCannotCommit) {
  Document d;
  auto tx = d.begin("x");
  ASSERT_TRUE(tx->add("m", model::Material{}).ok());
  d.clear();
  EXPECT_EQ(tx->commit().error().sentence(),
            "the document was cleared while this transaction was open.");
}

TEST(Document, ATransactionIsMadeAgainOnWhatOthersChangedMeanwhile) {
  Document d;
  const auto steel = make(d, "steel", model::Material{});
  const auto brass = make(d, "brass", model::Material{});
  auto slow = d.begin("slow"), fast = d.begin("fast");
  ASSERT_TRUE(set_density(*slow, steel, 7850).ok());
  const auto added = slow->add("copper", model::Material{});
  ASSERT_TRUE(added.ok());
  ASSERT_TRUE(set_density(*fast, brass, 8500).ok());
  ASSERT_TRUE(fast->add("tin", model::Material{}).ok());
  ASSERT_TRUE(fast->commit().ok());
  const auto commit = slow->commit();
  ASSERT_TRUE(commit.ok()) << commit.error().sentence();
  EXPECT_EQ(commit->changed, (std::vector<AnyId>{steel, *added}));
  EXPECT_EQ(density(*d.now(), steel), 7850);
  EXPECT_EQ(density(*d.now(), brass), 8500);
  EXPECT_EQ(d.now()->size(), 4U);
  ASSERT_TRUE(d.undo().ok());
  EXPECT_EQ(density(*d.now(), steel), 1000);
  EXPECT_EQ(density(*d.now(), brass), 8500) << "the step of the other stays";
}

TEST(Document, ATransactionIsRefusedWhereWhatItLookedAtHasChanged) {
  Document d;
  const auto steel = make(d, "steel", model::Material{});
  const auto ball_id = make(d, "bolt", ball(steel));
  const auto refused = [&](auto&& look, auto&& meanwhile) {
    auto slow = d.begin("slow");
    look(*slow);
    EXPECT_TRUE(slow->add("own", model::Material{}).ok());
    auto fast = d.begin("fast");
    meanwhile(*fast);
    EXPECT_TRUE(fast->commit().ok());
    const auto digest = d.content_digest();
    const auto commit = slow->commit();
    EXPECT_FALSE(commit.ok());
    EXPECT_TRUE(slow->is_overtaken());
    EXPECT_EQ(d.content_digest(), digest) << "nothing of it may be there";
    EXPECT_TRUE(d.undo().ok());
    return commit.ok() ? std::string() : commit.error().sentence();
  };
  EXPECT_EQ(refused([&](Transaction& t) { (void)t.now().find(AnyId(steel)); },
                    [&](Transaction& t) { ASSERT_TRUE(set_density(t, steel, 5).ok()); }),
            "material \"steel\" was changed by the program (fast) while slow was running. Nothing "
            "was changed. Run it again.");
  EXPECT_EQ(refused([&](Transaction& t) { (void)t.now().find(Kind::material, "tin"); },
                    [&](Transaction& t) { ASSERT_TRUE(t.add("tin", model::Material{}).ok()); }),
            "material \"tin\" was added by the program (fast) while slow was running. Nothing was "
            "changed. Run it again.");
  EXPECT_EQ(refused([&](Transaction& t) { (void)t.now().share(AnyId(ball_id)); },
                    [&](Transaction& t) { ASSERT_TRUE(t.remove(AnyId(ball_id)).ok()); }),
            "solid \"bolt\" was removed by the program (fast) while slow was running. Nothing was "
            "changed. Run it again.");
  EXPECT_EQ(refused([&](Transaction& t) { (void)t.now().list(Kind::solid); },
                    [&](Transaction& t) { ASSERT_TRUE(t.add("nut", ball(steel)).ok()); }),
            "records were added or removed while slow was running. Nothing was changed. Run it "
            "again.");
  EXPECT_EQ(refused([&](Transaction& t) { (void)t.now().referrers(AnyId(steel)); },
                    [&](Transaction& t) { ASSERT_TRUE(t.add("nut", ball(steel)).ok()); }),
            "what refers to material \"steel\" was changed while slow was running. Nothing was "
            "changed. Run it again.");
  EXPECT_NE(refused([&](Transaction& t) { ASSERT_TRUE(t.remove(AnyId(ball_id)).ok()); },
                    [&](Transaction& t) {
                      ASSERT_TRUE(t.add("two", model::Object{}).ok());
                      ASSERT_TRUE(t.edit(AnyId(ball_id), [](model::Record& r) -> Result<void> {
                                     r.name = "renamed";
                                     return {};
                                   }).ok());
                    }),
            "")
      << "what one removes the other must not have changed";
}

TEST(Document, ManyThreadsCommitAndNothingIsLost) {
  Document d;
  constexpr int kThreads = 4, kEach = 50;
  std::vector<MaterialId> own;
  for (int t = 0; t < kThreads; ++t)
    own.push_back(make(d, "own " + std::to_string(t), model::Material{}));
  const auto shared = make(d, "shared", model::Material{});
  std::atomic<int> refusals{0};
  std::mutex mutex;
  std::vector<std::uint64_t> heard;
  d.on_commit([&](const Commit& c) {
    const std::lock_guard lock(mutex);
    heard.push_back(c.revision);
  });
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < kThreads; ++t)
      threads.emplace_back([&, t] {
        for (int i = 1; i <= kEach; ++i) {
          auto mine = d.begin("mine");
          if (!set_density(*mine, own[static_cast<std::size_t>(t)], i).ok() || !mine->commit().ok())
            ADD_FAILURE() << "an edit that nobody else touches was refused";
          for (;;) {  // adds one to what all share
            auto count = d.begin("count");
            const double now = density(count->now(), shared);
            if (!set_density(*count, shared, now + 1).ok()) ADD_FAILURE();
            if (count->commit().ok()) break;
            ASSERT_TRUE(count->is_overtaken());
            ++refusals;
          }
        }
      });
  }
  for (const auto id : own) EXPECT_EQ(density(*d.now(), id), kEach);
  EXPECT_EQ(density(*d.now(), shared), 1000 + kThreads * kEach) << "no count may be lost";
  ASSERT_EQ(heard.size(), std::size_t{2} * kThreads * kEach);
  EXPECT_TRUE(std::is_sorted(heard.begin(), heard.end())) << "listeners hear in order";
}

TEST(Document, TheDigestTellsContentAndNotIdsOrOrder) {
  Document a, b;
  const auto steel_a = make(a, "steel", model::Material{});
  make(a, "ball", ball(steel_a));
  make(b, "gone", model::Material{});
  ASSERT_TRUE(b.undo().ok());
  const auto ball_b = make(b, "ball", ball());
  const auto steel_b = make(b, "steel", model::Material{});
  EXPECT_NE(a.content_digest(), b.content_digest());
  auto tx = b.begin("x");
  ASSERT_TRUE(tx->edit(ball_b, [&](model::Record& r) -> Result<void> {
                  std::get<model::Solid>(r.body).material = steel_b;
                  return {};
                }).ok());
  ASSERT_TRUE(tx->commit().ok());
  EXPECT_EQ(a.content_digest(), b.content_digest());
  ASSERT_TRUE(edit_density(b, steel_b, 1000.0000001).ok());
  EXPECT_NE(a.content_digest(), b.content_digest());
}

TEST(Document, RecordsAreCheckedAtCommitAndTheElementIsNamed) {
  const auto refusal = [](const std::string& name, auto content) -> std::string {
    Document d;
    auto tx = d.begin("x");
    EXPECT_TRUE(tx->add(name, content).ok());
    const auto commit = tx->commit();
    return commit.ok() ? "" : commit.error().sentence();
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  model::Material m;
  m.density = -1;
  EXPECT_EQ(refusal("m", m), "material \"m\": the density is -1 kg/m^3; it must not be negative.");
  m.density = kNan;
  EXPECT_EQ(refusal("m", m), "material \"m\": the density is nan; it must be a finite number.");
  model::Solid s = ball();
  s.nodes[0].sizes[0] = -1;
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": radius of sphere \"ball\" is -1 m; it must be greater than 0.");
  s = ball();
  s.nodes.push_back({CsgKind::sphere, "inner", 0, {}, {0.1}});
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": node \"inner\" is inside sphere \"ball\", which is a primitive. Only an "
            "operation such as a union, or a modifier, can contain nodes.");
  s.nodes = {{CsgKind::union_, "u", -1, {}, {}}, {CsgKind::box, "u", 0, {}, {1, 1, 1}}};
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": there are two nodes named \"u\". Give each its own name.");
  s.nodes[1] = {CsgKind::box, "b", 1, {}, {1, 1, 1}};
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": node \"b\" does not come after its parent. Every node except the first "
            "needs a parent, and parents come first.");
  s.nodes[1] = {CsgKind::cone, "c", 0, {}, {0, 0, 1}};
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": both radii of cone \"c\" are 0. Give one of them a size.");
  s.nodes[1] = {CsgKind::box, "b", 0, {}, {3, 1, 2, 0.5}};
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": the fillet of box \"b\" is 0.5 m; it must be less than half the smallest "
            "side, 0.5 m.");
  s.nodes[1] = {CsgKind::cylinder, "c", 0, {}, {1, 0.5, 0.3}};
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": the fillet of cylinder \"c\" is 0.3 m; it must be less than half the "
            "smallest of diameter and height, 0.25 m.");
  s.nodes[1] = {CsgKind::torus, "t", 0, {}, {1, 1}};
  EXPECT_EQ(
      refusal("s", s),
      "solid \"s\": tube_radius of torus \"t\" is 1 m; it must be less than ring_radius, 1 m.");
  s.nodes[1] = {CsgKind::wedge, "w", 0, {}, {1, 1, 1, 1.5}};
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": top_x of wedge \"w\" is 1.5 m; it must not be greater than x, 1 m.");
  s.nodes[1] = {CsgKind::frustum, "f", 0, {{kNan, 0, 0}, {}, {}}, {1, 1, 0, 0, 1}};
  EXPECT_EQ(refusal("s", s),
            "solid \"s\": the position of node \"f\" is nan; it must be a finite number.");
  s.nodes[1].placement = {};
  EXPECT_EQ(refusal("s", s), "") << "a pyramid has a top of 0 by 0";
  model::Robot r;
  r.links.resize(2);
  r.links[0].name = "a";
  r.links[1].name = "b";
  r.links[1].parent = 1;
  EXPECT_EQ(refusal("r", r),
            "robot \"r\": link \"b\" does not come after its parent. Parents come first; -1 is the "
            "base.");
  r.links[1].parent = 0;
  r.links[1].lower = 1;
  r.links[1].upper = -1;
  EXPECT_EQ(refusal("r", r),
            "robot \"r\": the lower limit of link \"b\" is 1 and the upper -1. The lower limit "
            "must not exceed the upper one.");
  r.links[1].upper = 2;
  r.poses.push_back({"home", {0}});
  EXPECT_EQ(refusal("r", r),
            "robot \"r\": pose \"home\" has 1 joint value; the robot has 2 moving joints.");
  r.links[1].joint = model::JointKind::fixed;
  EXPECT_EQ(refusal("r", r), "");
  EXPECT_EQ(
      refusal("o", object_of({AnyId{}})),
      "object \"o\": part \"p0\" has neither a solid nor an object. Give a solid or an object.");
}

TEST(Document, UndoAndRedoOfRandomEditsGiveTheSameContentsAgain) {
  std::mt19937 random(test::seed());
  const auto pick = [&](std::size_t n) {
    return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };

  Document d;
  std::vector<std::string> digests{d.content_digest()};
  const auto check_references = [&] {
    // Reverse references and names against a full scan.
    const auto now = d.now();
    std::map<AnyId, std::set<AnyId>> expected;
    std::size_t count = 0;
    for (const AnyId id : now->list()) {
      ++count;
      model::for_each_reference(now->find(id)->body,
                                [&](AnyId to, std::string_view) { expected[to].insert(id); });
      ASSERT_EQ(now->find(id.kind, now->find(id)->name), id);
    }
    ASSERT_EQ(count, now->size());
    for (const AnyId id : now->list()) {
      const auto got = now->referrers(id);
      ASSERT_EQ(std::vector<AnyId>(expected[id].begin(), expected[id].end()), got);
    }
  };
  for (int step = 0; step < 400; ++step) {
    auto tx = d.begin("step " + std::to_string(step));
    ASSERT_TRUE(tx.ok());
    for (std::size_t edits = 1 + pick(4); edits > 0; --edits) {
      const auto ids = tx->now().list();
      const auto bodies = [&] {
        std::vector<AnyId> out;
        for (const AnyId id : ids)
          if (id.kind == Kind::solid || id.kind == Kind::object) out.push_back(id);
        return out;
      }();
      switch (pick(7)) {
        case 0: (void)tx->add(tx->free_name(Kind::material, "m"), model::Material{}).ok(); break;
        case 1: {
          const auto materials = tx->now().list(Kind::material);
          const MaterialId m = materials.empty()
                                   ? MaterialId{}
                                   : MaterialId{materials[pick(materials.size())].number};
          (void)tx->add(tx->free_name(Kind::solid, "s"), ball(m)).ok();
          break;
        }
        case 2: {
          std::vector<AnyId> parts;
          for (std::size_t n = bodies.empty() ? 0 : pick(4); n > 0; --n)
            parts.push_back(bodies[pick(bodies.size())]);
          (void)tx->add(tx->free_name(Kind::object, "o"), object_of(parts)).ok();
          break;
        }
        case 3:
          if (!ids.empty()) (void)tx->remove(ids[pick(ids.size())]).ok();
          break;
        case 4:
          if (!ids.empty()) {
            const AnyId id = ids[pick(ids.size())];
            const std::string name = tx->free_name(id.kind, "renamed");
            (void)
                tx->edit(id, [&](model::Record& r) -> Result<void> {
                    r.name = name;
                    return {};
                  }).ok();
          }
          break;
        case 5: {
          const auto materials = tx->now().list(Kind::material);
          if (!materials.empty())
            (void)set_density(*tx, materials[pick(materials.size())],
                              1.0 + static_cast<double>(pick(5)))
                .ok();
          break;
        }
        default: {
          const auto objects = tx->now().list(Kind::object);
          if (objects.empty() || bodies.empty()) break;
          const AnyId part =
              bodies[pick(bodies.size())];  // may make a cycle, which the commit refuses
          (void)
              tx->edit(objects[pick(objects.size())], [&](model::Record& r) -> Result<void> {
                  auto& o = std::get<model::Object>(r.body);
                  o.parts.push_back(
                      {"more" + std::to_string(o.parts.size()) + "x" + std::to_string(step),
                       part,
                       {},
                       {}});
                  return {};
                }).ok();
          break;
        }
      }
    }
    const std::string before = d.content_digest();
    const auto commit = tx->commit();
    if (!commit.ok()) {
      ASSERT_EQ(d.content_digest(), before) << "a refused commit must change nothing";
    } else if (!commit->changed.empty()) {
      digests.push_back(d.content_digest());
    }
    if (step % 20 == 0) check_references();
  }
  ASSERT_EQ(d.undo_labels().size() + 1, digests.size()) << "the budget is large enough for all";
  for (int round = 0; round < 2; ++round) {
    for (std::size_t i = digests.size() - 1; i > 0; --i) {
      ASSERT_EQ(d.content_digest(), digests[i]);
      ASSERT_TRUE(d.undo().ok());
      if (i % 37 == 0) check_references();
    }
    ASSERT_EQ(d.now()->size(), 0U);
    for (std::size_t i = 0; i + 1 < digests.size(); ++i) {
      ASSERT_EQ(d.content_digest(), digests[i]);
      ASSERT_TRUE(d.redo().ok());
    }
  }
  check_references();
}

TEST(WorldIndex, FindsMembersOfTheVersionOfTheWorldThatASnapshotHas) {
  using document::MemberList;
  Document d;
  auto tx = *d.begin("world");
  const AnyId what = *tx.add("ball", ball());
  model::World hall;
  hall.objects = {{"crate", what, {}}, {"lid", what, {}}};
  hall.frames = {{"bench", {}}};
  hall.signals.push_back({});
  hall.signals.back().name = "go";
  const WorldId id{tx.add("hall", hall)->number};
  ASSERT_TRUE(tx.commit().ok());
  const auto before = d.now();
  const auto index = document::world_index(*before, id);
  ASSERT_TRUE(index);
  EXPECT_EQ(index->find(MemberList::objects, "lid"), 1U);
  EXPECT_EQ(index->find(MemberList::frames, "bench"), 0U);
  EXPECT_EQ(index->find(MemberList::signals, "go"), 0U);
  EXPECT_EQ(index->find(MemberList::robots, "lid"), std::nullopt);
  EXPECT_EQ(document::world_index(*before, id), index);  // built once

  auto edit = *d.begin("without the crate");
  ASSERT_TRUE(edit.edit(AnyId(id),
                        [](model::Record& r) -> Result<void> {
                          auto& objects = std::get<model::World>(r.body).objects;
                          objects.erase(objects.begin());
                          return {};
                        })
                  .ok());
  ASSERT_TRUE(edit.commit().ok());
  EXPECT_EQ(document::world_index(*d.now(), id)->find(MemberList::objects, "lid"), 0U);
  EXPECT_EQ(document::world_index(*d.now(), id)->find(MemberList::objects, "crate"), std::nullopt);
  EXPECT_EQ(document::world_index(*before, id)->find(MemberList::objects, "crate"), 0U);
  EXPECT_EQ(document::world_index(*before, WorldId{what.number}), nullptr);
}

}  // namespace
}  // namespace robomosp
