// SPDX-License-Identifier: Apache-2.0
// Edits of long lists look at what changed: they are refused exactly when a look at all of the
// record refuses them, in the same words; and what they take does not grow with the list.
#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "document/document.h"
#include "document/validate.h"
#include "model/data.h"
#include "model/parametric.h"
#include "support/allocations.h"
#include "support/seed.h"

namespace robomosp {
namespace {

using document::Document;
using model::LongList;
using model::Parameter;
using model::PlacedObject;
using model::Record;
using model::World;
using test::cost;
using test::Cost;

constexpr std::size_t kBlock = LongList<PlacedObject>::kBlock;

model::Solid ball() {
  model::Solid s;
  s.nodes.push_back({CsgKind::sphere, "ball", -1, {}, {0.1}});
  return s;
}

template <class Change>
Result<void> edit(Document& d, AnyId id, Change&& change) {
  auto tx = d.begin("edit");
  RMP_TRY(tx->edit(id, [&](Record& r) -> Result<void> {
    change(r);
    return {};
  }));
  auto done = tx->commit();
  if (!done.ok()) return std::move(done).error();
  return {};
}

World& world_of(Record& r) { return std::get<World>(r.body); }

/// The same content in blocks of its own.
template <class T>
LongList<T> apart(const LongList<T>& list) {
  return LongList<T>(std::vector<T>(list.begin(), list.end()));
}

std::string sentence(const Result<void>& r) { return r.ok() ? "ok" : r.error().sentence(); }

struct Hall {
  explicit Hall(std::size_t objects) {
    auto tx = d.begin("hall");
    for (int i = 0; i < 3; ++i) solids.emplace_back(*tx->add("ball" + std::to_string(i), ball()));
    World w;
    for (std::size_t i = 0; i < objects; ++i)
      w.objects.push_back({"o" + std::to_string(i), solids[i / kBlock % 2], {}});
    w.frames.push_back({"frame", {}});
    world = AnyId(*tx->add("hall", std::move(w)));
    EXPECT_TRUE(tx->commit().ok());
  }
  [[nodiscard]] const World& now() const { return std::get<World>(d.now()->find(world)->body); }

  Document d;
  std::vector<AnyId> solids;
  AnyId world;
};

TEST(LongList, IsAVectorWhoseCopiesShareBlocks) {
  LongList<int> list;
  std::vector<int> model;
  std::mt19937 random(test::seed());
  std::vector<std::pair<LongList<int>, std::vector<int>>> copies;
  for (int step = 0; step < 20'000; ++step) {
    const int value = static_cast<int>(random() % 1000);
    const std::size_t at = model.empty() ? 0 : random() % model.size();
    switch (random() % 12) {
      case 0:
        if (model.empty()) break;
        list.erase(at);
        model.erase(model.begin() + static_cast<std::ptrdiff_t>(at));
        break;
      case 1:
        if (model.empty()) break;
        list[at] = value;
        model[at] = value;
        break;
      case 2: copies.emplace_back(list, model); break;
      case 3:
        if (random() % 20 != 0) break;
        EXPECT_EQ(erase_if(list, [&](int v) { return v < value; }),
                  std::erase_if(model, [&](int v) { return v < value; }));
        break;
      case 4:
        if (random() % 20 != 0) break;
        list.resize(at);
        model.resize(at);
        break;
      case 5:
        if (copies.empty()) break;
        list = copies.back().first;
        model = copies.back().second;
        break;
      default: list.push_back(value); model.push_back(value);
    }
    if (step % 50 != 0) continue;
    ASSERT_EQ(list.size(), model.size());
    ASSERT_TRUE(std::equal(list.begin(), list.end(), model.begin(), model.end()));
    for (const auto& [copy, content] : copies)
      ASSERT_TRUE(std::equal(copy.begin(), copy.end(), content.begin(), content.end()));
    if (!copies.empty()) {
      ASSERT_EQ(list == copies.back().first, model == copies.back().second);
    }
    if (copies.size() > 8) copies.erase(copies.begin());
  }
  LongList<int> moved = std::move(list);
  EXPECT_TRUE(std::equal(moved.begin(), moved.end(), model.begin(), model.end()));
  EXPECT_TRUE(list.empty());  // NOLINT: a list that was moved from is an empty one
}

TEST(EditChecks, AreThoseOfTheWholeRecordInTheSameWords) {
  Hall hall(5 * kBlock + 7);
  std::mt19937 random(test::seed());
  std::size_t refused = 0;
  for (int step = 0; step < 1500; ++step) {
    const std::size_t n = hall.now().objects.size(), at = random() % n, other = random() % n;
    const unsigned kind = static_cast<unsigned>(random() % 14);
    const auto change = [&](Record& r) {
      World& w = world_of(r);
      switch (kind) {
        case 0:
        case 1:
        case 2: w.objects.push_back({"n" + std::to_string(step), hall.solids[0], {}}); break;
        case 3:
          w.objects.push_back({"n" + std::to_string(random() % 50), hall.solids[1], {}});
          break;
        case 4: w.objects.push_back({w.objects[at].name, hall.solids[1], {}}); break;
        case 5: w.objects[at].name = w.objects[other].name; break;
        case 6: w.objects[at].placement.position = {0.001 * step, 0, 0}; break;
        case 7:
          w.objects[at].placement.position[1] = std::numeric_limits<double>::quiet_NaN();
          w.objects[other].name = "1 is no name";
          break;
        case 8: w.objects[at].what = {}; break;
        case 9: w.objects.erase(at); break;
        case 10: w.frames.push_back({w.objects[at].name, {}}); break;
        case 11: w.objects[at].name = "frame"; break;
        case 12:
          w.frames.back().name = "f" + std::to_string(step);
          w.objects[other].name = "frame" + std::to_string(step % 3);
          break;
        default:  // a name goes from one member to another
          w.objects[other].name = "m" + std::to_string(step);
          if (at != other) w.frames.push_back({w.objects[other].name + "b", {}});
          w.objects.resize(w.objects.size() - 1);
          break;
      }
    };
    Record whole = *hall.d.now()->find(hall.world);
    const unsigned state = static_cast<unsigned>(random());
    random.seed(state);
    change(whole);
    world_of(whole).objects = apart(world_of(whole).objects);
    const Result<void> wanted = document::check_record(whole);
    random.seed(state);
    const Result<void> got = edit(hall.d, hall.world, change);
    ASSERT_EQ(sentence(got), sentence(wanted)) << "step " << step << " of kind " << kind;
    refused += wanted.ok() ? 0 : 1;
    if (wanted.ok()) {
      ASSERT_TRUE(model::equal(hall.d.now()->find(hall.world)->body, whole.body));
    }
  }
  EXPECT_GT(refused, 300U);
}

/// What an edit does not touch is wrong when what it refers to goes in the same commit.
TEST(EditChecks, AnUnchangedPartThatRefersToWhatGoesIsRefused) {
  Hall hall(4 * kBlock);
  const AnyId goes = hall.solids[0];
  EXPECT_EQ(sentence([&]() -> Result<void> {
              auto tx = hall.d.begin("remove");
              return tx->remove(goes);
            }()),
            "cannot remove solid \"ball0\": world \"hall\" refers to it. Remove or change that one "
            "first.");

  const LongList<PlacedObject> before = hall.now().objects;
  auto tx = hall.d.begin("away and back");
  ASSERT_TRUE(tx->edit(hall.world, [&](Record& r) -> Result<void> {
                  world_of(r).objects = {};
                  return {};
                }).ok());
  ASSERT_TRUE(tx->remove(goes).ok());
  ASSERT_TRUE(tx->edit(hall.world, [&](Record& r) -> Result<void> {
                  world_of(r).objects = before;  // the very blocks that the document holds
                  world_of(r).description = "as it was";
                  return {};
                }).ok());
  const auto done = tx->commit();
  ASSERT_FALSE(done.ok());
  EXPECT_NE(done.error().sentence().find("refers to solid #" + std::to_string(goes.number) +
                                         ", which does not exist"),
            std::string::npos)
      << done.error().sentence();
  EXPECT_TRUE(hall.d.now()->find(goes));
}

/// The index of who refers to what is that of all references, whatever blocks they stand in.
TEST(EditChecks, WhoRefersToWhatIsKeptThroughBlocks) {
  Hall hall(3 * kBlock);
  std::mt19937 random(test::seed());
  for (int step = 0; step < 400; ++step) {
    ASSERT_TRUE(
        edit(hall.d, hall.world, [&](Record& r) {
          auto& objects = world_of(r).objects;
          const std::size_t at = objects.empty() ? 0 : random() % objects.size();
          const AnyId what = hall.solids[random() % 3];
          switch (random() % 4) {
            case 0: objects.push_back({"s" + std::to_string(step), what, {}}); break;
            case 1:  // a whole block, so that it refers to nothing else
              for (std::size_t i = at - at % kBlock;
                   i < objects.size() && i < at - at % kBlock + kBlock; ++i)
                objects[i].what = what;
              break;
            case 2: {
              const std::size_t gone =
                  erase_if(objects, [&](const auto& o) { return o.what == what; });
              for (std::size_t i = 0; i < gone; ++i)
                objects.push_back({"r" + std::to_string(step) + "_" + std::to_string(i),
                                   hall.solids[random() % 2],
                                   {}});
              break;
            }
            default:
              if (at > 2 * kBlock) objects.resize(at);
              for (int i = 0; i < 40; ++i)
                objects.push_back({"t" + std::to_string(step) + "_" + std::to_string(i), what, {}});
          }
        }).ok());
    if (step % 7 == 0) {
      ASSERT_TRUE(hall.d.undo().ok());
    }
    const auto now = hall.d.now();
    for (const AnyId solid : hall.solids) {
      const auto& objects = hall.now().objects;
      const bool is_used = std::any_of(objects.begin(), objects.end(),
                                       [&](const auto& o) { return o.what == solid; });
      ASSERT_EQ(now->referrers(solid),
                is_used ? std::vector<AnyId>{hall.world} : std::vector<AnyId>{})
          << "step " << step;
    }
  }
}

/// Every edit of parameters gives what evaluating all of them anew gives, value or refusal.
TEST(EditChecks, ParametersThatFollowAreThoseThatDepend) {
  Document d;
  AnyId id;
  {
    model::Solid s = ball();
    for (int i = 0; i < 150; ++i)
      s.parametric.parameters.push_back({"p" + std::to_string(i),
                                         i % 3 ? "p" + std::to_string(i / 2) + " + 1 mm" : "", "m",
                                         0.001 * i, ""});
    s.parametric.expressions["ball.radius"] = "p149 + 1 m";
    s.parametric.expressions["ball.position.x"] = "p7";
    auto tx = d.begin("solid");
    id = AnyId(*tx->add("ball", std::move(s)));
    ASSERT_TRUE(tx->commit().ok());
  }
  const model::WorldParameters no_worlds = [](const Expression::Name&) { return std::nullopt; };
  std::mt19937 random(test::seed());
  std::size_t refused = 0;
  for (int step = 0; step < 1500; ++step) {
    const auto change = [&](Record& r) {
      model::Solid& s = std::get<model::Solid>(r.body);
      auto& p = s.parametric.parameters;
      const std::size_t at = random() % p.size();
      const std::string one = "p" + std::to_string(random() % (p.size() + 2));
      switch (random() % 10) {
        case 0: p.push_back({"p" + std::to_string(p.size()), one + " + 2 mm", "m", 0, ""}); break;
        case 1: p.push_back({"p" + std::to_string(random() % 200), "", "m", 0.004, ""}); break;
        case 2: p[at].expression = one + "/2 + 1 mm"; break;  // a circle now and then
        case 3:
          p[at].expression.clear();
          p[at].value = 0.001 * step;
          break;
        case 4: s.parametric.expressions["ball.position.y"] = one; break;
        case 5: p[at].unit = random() % 2 ? "rad" : "m"; break;
        case 6: p.erase(at); break;
        case 7: p[at].description = one; break;
        case 8: s.nodes[0].placement.position[0] = 0.5; break;
        default: p[at].expression = "1 m"; p[p.size() / 2].expression = one + " + p3";
      }
    };
    Record whole = *d.now()->find(id);
    const Record before = whole;
    const unsigned state = static_cast<unsigned>(random());
    random.seed(state);
    change(whole);
    model::follow_edit(before.body, whole.body);
    auto& p = std::get<model::Solid>(whole.body).parametric;
    p.parameters = apart(p.parameters);
    Result<void> wanted = model::resolve(whole.body, "", no_worlds);
    random.seed(state);
    const Result<void> got = edit(d, id, change);
    if (!wanted.ok()) {
      ++refused;
      wanted = std::move(wanted).error().in("solid \"ball\"");
      ASSERT_EQ(sentence(got), sentence(wanted)) << "step " << step;
    } else if (got.ok()) {
      ASSERT_TRUE(model::equal(d.now()->find(id)->body, whole.body)) << "step " << step;
    } else {
      ASSERT_EQ(sentence(got), sentence(document::check_record(whole))) << "step " << step;
    }
  }
  EXPECT_GT(refused, 100U);
}

#if ROBOMOSP_COUNTS_MEMORY

Cost cost_of_adding(std::size_t objects) {
  Hall hall(objects);
  return cost([&](int i) {
    ASSERT_TRUE(edit(hall.d, hall.world, [&](Record& r) {
                  world_of(r).objects.push_back({"n" + std::to_string(i), hall.solids[0], {}});
                }).ok());
  });
}

TEST(EditGrowth, AddingAnObjectToAWorldTakesWhatItAdds) {
  const Cost few = cost_of_adding(4 * kBlock), many = cost_of_adding(160 * kBlock);
  RecordProperty("allocations", static_cast<int>(many.allocations));
  EXPECT_LT(many.allocations, few.allocations + 5);
  // A pointer a block, of which a copy is made for the edit.
  EXPECT_LT(many.bytes, few.bytes + 2.5 * 16 * 160);
}

Cost cost_of_parameter(std::size_t parameters) {
  Document d;
  model::Solid s = ball();
  s.parametric.parameters.push_back({"p0", "", "m", 0.001, ""});
  for (std::size_t i = 1; i < parameters; ++i)
    s.parametric.parameters.push_back(
        {"p" + std::to_string(i), "p" + std::to_string(i - 1) + " + 1 mm", "m", 0, ""});
  auto tx = d.begin("solid");
  const AnyId id(*tx->add("ball", std::move(s)));
  EXPECT_TRUE(tx->commit().ok());
  return cost([&](int i) {
    ASSERT_TRUE(edit(d, id, [&](Record& r) {
                  auto& p = std::get<model::Solid>(r.body).parametric.parameters;
                  const std::size_t n = parameters + static_cast<std::size_t>(i);
                  p.push_back({"p" + std::to_string(n), "p" + std::to_string(n - 1) + " + 1 mm",
                               "m", 0, ""});
                }).ok());
  });
}

/// Reading an expression takes dozens of allocations: those of the chain are not read again.
TEST(EditGrowth, AddingAParameterReadsItsExpressionOnly) {
  const Cost few = cost_of_parameter(2 * kBlock), many = cost_of_parameter(40 * kBlock);
  EXPECT_LT(many.allocations, few.allocations + 5);
  EXPECT_LT(many.bytes, few.bytes + 2.5 * 16 * 40);
}

#endif

/// A look at every pair of rules took 30 s for so many.
TEST(EditGrowth, RulesOfPairsAreLookedAtOnceEach) {
  Record arm;
  arm.name = "arm";
  auto& robot = arm.body.emplace<model::Robot>();
  robot.links.resize(1);
  robot.links[0].name = "upper";
  for (int i = 0; i < 300; ++i)
    for (int j = 0; j < i; ++j)
      robot.pair_rules.push_back({"l" + std::to_string(i), "l" + std::to_string(j), true, ""});
  EXPECT_EQ(sentence(document::check_record(arm)), "ok");
  robot.pair_rules.push_back({"l3", "l200", false, ""});
  EXPECT_NE(sentence(document::check_record(arm)).find("has two rules"), std::string::npos);
}

/// What the history keeps of an edit is what the edit replaced.
TEST(EditGrowth, TheHistoryKeepsTheBlocksThatWereReplaced) {
  Hall hall(160 * kBlock);
  const std::size_t before = hall.d.history_bytes();
  for (int i = 0; i < 100; ++i)
    ASSERT_TRUE(edit(hall.d, hall.world, [&](Record& r) {
                  world_of(r).objects[static_cast<std::size_t>(i)].placement.position[0] += 1;
                }).ok());
  const std::size_t kept = hall.d.history_bytes() - before;
  EXPECT_LT(kept, 100 * (3 * kBlock * sizeof(PlacedObject)));
  EXPECT_GT(kept, 100 * (kBlock * sizeof(PlacedObject)));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(hall.d.undo().ok());
  EXPECT_EQ(hall.now().objects[7].placement.position[0], 0);
}

}  // namespace
}  // namespace robomosp
