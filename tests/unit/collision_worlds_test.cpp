// SPDX-License-Identifier: Apache-2.0
// Worlds of many bodies, thin walls on a path, and a redundant arm that keeps away from a post.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "collision/broad_phase.h"
#include "collision/cache.h"
#include "collision/collision.h"
#include "io/native.h"
#include "sim/simulate.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using collision::CollisionModel;
using test::unwrap;
using test::Workbench;

constexpr double kInf = std::numeric_limits<double>::infinity();

/// The same numbers on every platform (Numerical Recipes' quick generator).
class Random {
 public:
  double uniform(double low, double high) {
    state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return low + (high - low) * static_cast<double>(state_ >> 11) * 0x1.0p-53;
  }

 private:
  std::uint64_t state_ = 20261121;
};

TEST(BoxTree, FindsTheLeavesThatAreNearEnoughAndNoOthers) {
  Random random;
  const auto box = [&] {
    spatial::Box b;
    for (double& x : b.centre) x = random.uniform(-5, 5);
    for (double& x : b.half) x = random.uniform(0.01, 0.5);
    return b;
  };
  for (const std::size_t count : {1U, 2U, 3U, 70U, 500U}) {
    std::vector<spatial::Box> leaves;
    for (std::size_t i = 0; i < count; ++i) leaves.push_back(box());
    leaves.resize(2 * count, leaves[0]);  // many at one place
    const spatial::BoxTree tree(leaves);
    for (auto& b : leaves)
      for (double& x : b.centre) x += random.uniform(-1, 1);  // they have moved since
    std::vector<spatial::Box> boxes;
    tree.refit(leaves, boxes);
    for (int trial = 0; trial < 20; ++trial) {
      const spatial::Box asked = box();
      const double within = random.uniform(0, 2);
      std::vector<std::size_t> found, expected;
      tree.near(
          boxes, asked, [&] { return within; }, [&](std::size_t i) { found.push_back(i); });
      std::sort(found.begin(), found.end());
      for (std::size_t i = 0; i < leaves.size(); ++i)
        if (spatial::gap(leaves[i], asked) <= within) expected.push_back(i);
      ASSERT_EQ(found, expected) << count << " leaves, trial " << trial;
    }
  }
  int visits = 0;
  spatial::BoxTree().near(
      {}, {}, [] { return kInf; }, [&](std::size_t) { ++visits; });
  EXPECT_EQ(visits, 0);
}

class Worlds : public testing::Test {
 protected:
  Workbench bench;
  NoProgress none;

  SolidId solid(document::Transaction& t, const std::string& name, CsgKind kind,
                std::array<double, 6> sizes, Vec3 at) {
    model::Solid s;
    model::SolidNode n;
    n.kind = kind;
    n.name = name;
    n.parent = -1;
    n.sizes = sizes;
    n.placement.position = at;
    s.nodes = {n};
    return unwrap(t.add(name, std::move(s)));
  }
  /// `count` rods of 1 m, 0.8 m of each filled by a box of the width.
  RobotId arm(document::Transaction& t, int count, double width) {
    const SolidId rod = solid(t, "rod", CsgKind::box, {0.8, width, width}, {-0.5, 0, -width / 2});
    model::Robot r;
    for (int i = 0; i < count; ++i) {
      model::Link l;
      l.name = "rod" + std::to_string(i + 1);
      l.parent = i - 1;
      l.row.a = 1;
      l.row.alpha = 0.7 * (i % 2);
      l.lower = -3;
      l.upper = 3;
      l.parts.push_back({rod, {}});
      r.links.push_back(std::move(l));
    }
    return unwrap(t.add("arm", std::move(r)));
  }
  std::shared_ptr<const CollisionModel> model_of(WorldId world) {
    const auto snapshot = bench.document.now();
    return unwrap(
        CollisionModel::of_world({bench.registry, bench.derived, *snapshot}, world, none));
  }
};

TEST_F(Worlds, ManyBodiesGiveTheAnswersOfAllPairsToTheBit) {
  auto t = bench.document.begin("world");
  const RobotId robot = arm(*t, 4, 0.12);
  const SolidId ball = solid(*t, "ball", CsgKind::sphere, {0.15}, {});
  const SolidId post = solid(*t, "post", CsgKind::cylinder, {0.08, 0.9}, {});
  const SolidId crate = solid(*t, "crate", CsgKind::box, {0.2, 0.3, 0.25}, {});
  Random random;
  model::World w;
  for (int i = 0; i < 3; ++i) {
    model::PlacedRobot placed{"arm" + std::to_string(i), robot, {}, {0.3, -0.4, 0.5, 0.2}};
    placed.placement.position = {2.5 * i, 0.3 * i, 0};
    w.robots.push_back(placed);
  }
  for (int i = 0; i < 60; ++i) {
    model::PlacedObject o{"o" + std::to_string(i),
                          i % 3 == 0   ? ball
                          : i % 3 == 1 ? post
                                       : crate,
                          {}};
    o.placement.position = {random.uniform(-3, 9), random.uniform(-5, 5), random.uniform(-2, 2)};
    w.objects.push_back(o);
  }
  w.pair_rules = {{"arm0", "o7", true, "soft"}};
  const WorldId world = unwrap(t->add("cell", std::move(w)));
  ASSERT_TRUE(t->commit().ok());
  const auto m = model_of(world);
  ASSERT_GT(m->pairs().size(), 700U);
  std::vector<double> q;
  for (int i = 0; i < 40 * 12; ++i) q.push_back(random.uniform(-2, 2));
  const auto all = unwrap(m->distances(q, kInf, none));
  const auto least = unwrap(m->clearance(q, none));
  ASSERT_EQ(least.size(), 40U);
  std::size_t touching = 0;
  const auto same = [&](const collision::Contact& c, const CollisionPair& p,
                        const PairDistance& d) {
    return c.pair.a == p.a && c.pair.b == p.b && c.at.distance == d.distance &&
           c.at.on_a == d.on_a && c.at.on_b == d.on_b;
  };
  for (std::size_t i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    const PairDistance* d = &all[i * m->pairs().size()];
    const std::span<const double> own(&q[12 * i], 12);
    std::size_t first = 0;
    std::vector<std::size_t> near, hits;
    for (std::size_t k = 0; k < m->pairs().size(); ++k) {
      if (d[k].distance < d[first].distance) first = k;
      if (d[k].distance < 0.4) near.push_back(k);
      if (d[k].distance <= 0) hits.push_back(k);
    }
    EXPECT_TRUE(same(least[i], m->pairs()[first], d[first]));
    const auto contacts = unwrap(m->near(own, 0.4, none));
    ASSERT_EQ(contacts.size(), near.size());
    for (std::size_t k = 0; k < near.size(); ++k)
      EXPECT_TRUE(same(contacts[k], m->pairs()[near[k]], d[near[k]]));
    const auto touch = unwrap(m->collisions(own, none));
    ASSERT_EQ(touch.size(), hits.size());
    for (std::size_t k = 0; k < hits.size(); ++k)
      EXPECT_EQ(m->describe(touch[k]), m->describe(m->pairs()[hits[k]]));
    touching += hits.size();
  }
  EXPECT_GT(touching, 5U);
  // A fine sampling of a motion never touches before the check of the whole says so.
  int contacts = 0;
  for (std::size_t i = 0; i + 1 < 20; ++i) {
    const std::span<const double> path(&q[12 * i], 24);
    const auto contact = unwrap(m->check_path(path, 1e-4, none));
    const double until = contact ? contact->share : 1;
    contacts += contact ? 1 : 0;
    for (int s = 0; s < 50 && until > 0; ++s) {
      std::vector<double> at(12);
      for (std::size_t k = 0; k < 12; ++k)
        at[k] = path[k] + until * s / 50 * (path[12 + k] - path[k]);
      ASSERT_TRUE(unwrap(m->collisions(at, none)).empty()) << i << ", " << s;
    }
  }
  EXPECT_GT(contacts, 5);
}

TEST_F(Worlds, AWallThatAllSamplesMissIsMetOnThePath) {
  auto t = bench.document.begin("world");
  const RobotId robot = arm(*t, 3, 0.1);
  ASSERT_TRUE(t->edit(robot, [](model::Record& r) -> Result<void> {
                 for (auto& l : std::get<model::Robot>(r.body).links) l.row.alpha = 0;
                 return {};
               }).ok());
  // A sheet of 1 mm across the circle of the third rod.
  const SolidId sheet = solid(*t, "sheet", CsgKind::box, {0.4, 0.001, 0.4}, {0, 0, -0.2});
  model::World w;
  w.robots.push_back({"arm", robot, {}, {0, 0, 0}});
  model::PlacedObject o{"sheet", sheet, {}};
  o.placement.position = {2.5, 0, 0};
  w.objects.push_back(o);
  const WorldId world = unwrap(t->add("cell", std::move(w)));
  ASSERT_TRUE(t->commit().ok());
  const auto m = model_of(world);
  std::vector<double> path;
  for (int i = 0; i <= 10; ++i) path.insert(path.end(), {-0.55 + 0.1 * i, 0, 0});
  for (std::size_t i = 0; i < path.size(); i += 3)
    ASSERT_TRUE(unwrap(m->collisions(std::span<const double>(path).subspan(i, 3), none)).empty());
  // The rods' edge, 0.05 to the left of their axis, meets the sheet's corner at (2.3, -0.0005):
  // the distance is -(2.3 sin q + 0.0005 cos q) - 0.05.
  const auto expect_first = [&](const std::vector<double>& way, double begin, double step) {
    constexpr double kTolerance = 1e-5;
    const auto contact = unwrap(m->check_path(way, kTolerance, none));
    ASSERT_TRUE(contact);
    const double q = begin + step * (static_cast<double>(contact->segment) + contact->share);
    const double expected = -(2.3 * std::sin(q) + 0.0005 * std::cos(q)) - 0.05;
    EXPECT_NEAR(contact->contact.at.distance, expected, 1e-9);
    EXPECT_LE(expected, kTolerance);
    EXPECT_GT(expected, 0) << "the first time, not a later one";
  };
  expect_first(path, -0.55, 0.1);
  expect_first({-0.55, 0, 0, 0.45, 0, 0}, -0.55, 1);
}

TEST_F(Worlds, RulesForPairsAreSavedLoadedAndUndone) {
  auto t = bench.document.begin("world");
  const RobotId robot = arm(*t, 3, 0.1);
  ASSERT_TRUE(t->commit().ok());
  const auto rule = [&] {
    auto edit = bench.document.begin("allow");
    ASSERT_TRUE(edit->edit(robot,
                           [](model::Record& r) -> Result<void> {
                             std::get<model::Robot>(r.body).pair_rules = {
                                 {"rod1", "rod3", true, "a cable"}, {"rod2", "rod1", false, ""}};
                             return {};
                           })
                    .ok());
    ASSERT_TRUE(edit->commit().ok());
  };
  const auto checked = [&] {
    const auto snapshot = bench.document.now();
    const auto m =
        unwrap(CollisionModel::of_robot({bench.registry, bench.derived, *snapshot}, robot, none));
    std::string out;
    for (const CollisionPair& p : m->pairs()) out += m->describe(p) + "; ";
    return out;
  };
  EXPECT_EQ(checked(), "rod1 and rod3; ");
  rule();
  EXPECT_EQ(checked(), "rod1 and rod2; ");
  const std::string text = unwrap(io::print(*bench.document.now(), robot, "arm.rbt", {}));
  EXPECT_NE(text.find("reason \"a cable\""), std::string::npos) << text;
  ASSERT_TRUE(bench.document.undo().ok());
  EXPECT_EQ(checked(), "rod1 and rod3; ");
  ASSERT_TRUE(bench.document.redo().ok());
  EXPECT_EQ(checked(), "rod1 and rod2; ");
  // The text again, without the bodies, whose files were never written.
  std::string bare;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string line = text.substr(at, end - at);
    if (line.find("part {") == std::string::npos) bare += line + "\n";
    at = end + 1;
  }
  auto load = bench.document.begin("load");
  const auto loaded = unwrap(io::load_text(*load, bare, "arm again", {}, {}));
  const model::Robot* again = load->now().get(RobotId{loaded.id.number});
  ASSERT_NE(again, nullptr);
  ASSERT_EQ(again->pair_rules.size(), 2U);
  const auto is_first_allowed = again->pair_rules[0].is_allowed;
  EXPECT_NE(is_first_allowed, again->pair_rules[1].is_allowed);
  EXPECT_EQ(again->pair_rules[is_first_allowed ? 0 : 1].reason, "a cable");
}

TEST_F(Worlds, BrokenNumbersAreRefusedInASentence) {
  auto t = bench.document.begin("world");
  const RobotId robot = arm(*t, 3, 0.1);
  model::World w;
  w.robots.push_back({"arm", robot, {}, {0, 0, 0}});
  const WorldId world = unwrap(t->add("cell", std::move(w)));
  ASSERT_TRUE(t->commit().ok());
  const auto m = model_of(world);
  const std::vector<double> broken{0, std::nan(""), 0}, half{0, 0}, good{0, 0, 0};
  for (const auto& q : {broken, half, std::vector<double>{}}) {
    EXPECT_FALSE(m->collisions(q, none).ok());
    EXPECT_FALSE(m->clearance(q, none).ok());
    EXPECT_FALSE(m->near(q, 1, none).ok());
    EXPECT_FALSE(m->distances(q, 1, none).ok());
    EXPECT_FALSE(m->check_path(q, 1e-4, none).ok());
  }
  EXPECT_FALSE(m->near(good, std::nan(""), none).ok());
  for (const double tolerance : {0.0, -1.0, std::nan(""), kInf})
    EXPECT_FALSE(m->check_path(good, tolerance, none).ok()) << tolerance;
  std::vector<double> gradient(3, 7.0);
  const auto field = unwrap(m->field(0, 0.3, none));
  EXPECT_EQ(field->distance(broken, gradient), 0.3) << "nothing is known of it";
  EXPECT_TRUE(field->outcome().ok());
  EXPECT_EQ(gradient, std::vector<double>(3));
}

TEST_F(Worlds, ARedundantArmKeepsFartherFromALampAlongItsPath) {
  // The PA-10 on its circle, with a lamp that hangs beside its elbow.
  const AnyId robot = bench.load("robots/pa10.rbt");
  const AnyId circle = bench.load("trajectories/circle.tjc");
  auto t = bench.document.begin("lamp");
  // Bodies generated from its rows: links but one apart are near each other however it stands.
  ASSERT_TRUE(t->edit(robot, [](model::Record& r) -> Result<void> {
                 auto& pa10 = std::get<model::Robot>(r.body);
                 pa10.base_parts.clear();
                 for (auto& l : pa10.links) l.parts.clear();
                 return {};
               }).ok());
  model::World w;
  w.robots.push_back({"pa10", RobotId{robot.number}, {}, {0, 0.179, 0, 1.298, 0, 1.664, 0}});
  w.trajectories.push_back({"circle", TrajectoryId{circle.number}, {}});
  model::PlacedObject o{"lamp", solid(*t, "shade", CsgKind::sphere, {0.06}, {}), {}};
  o.placement.position = {0.12, 0.24, 0.82};
  w.objects.push_back(o);
  const WorldId world = unwrap(t->add("cell", std::move(w)));
  ASSERT_TRUE(t->commit().ok());
  const auto snapshot = bench.document.now();
  collision::CollisionCache cache;
  const sim::Simulator source{bench.registry, bench.derived, *snapshot, &cache};
  const auto model = unwrap(cache.find(source, world, none));
  const auto least_to_lamp = [&](IkObjective objective, double* fastest) {
    sim::Run run{world, "pa10", "circle", 8.0, {1e-8, 1e-8}, objective, false, 0.2};
    const auto recording = unwrap(source.inverse_kinematics(run, none));
    if (!recording) return -kInf;
    for (const char* error : {"position_error", "rotation_error"})
      for (const double x : recording->find(error)->values) EXPECT_LE(x, 1e-8);
    *fastest = 0;
    for (int j = 1; j <= 7; ++j)
      for (const double x : recording->find("qd" + std::to_string(j))->values)
        *fastest = std::max(*fastest, std::fabs(x));
    // Its column of clearance is made with the same prepared model, which is left in the cache.
    const auto with = unwrap(collision::with_clearance(source, *recording, none));
    EXPECT_EQ(with->find("clearance")->values.size(), recording->rows());
    EXPECT_EQ(unwrap(cache.find(source, world, none)), model);
    const auto q = unwrap(collision::configurations(*model, *recording));
    double least = kInf;
    for (std::size_t i = 0; i < recording->rows(); ++i)
      for (const auto& c : unwrap(model->near(std::span<const double>(&q[7 * i], 7), 1, none)))
        if (model->describe(c.pair).find("lamp") != std::string::npos)
          least = std::min(least, c.at.distance);
    return least;
  };
  double calm = 0, fastest = 0;
  const double plain = least_to_lamp(IkObjective::none, &calm);
  const double kept = least_to_lamp(IkObjective::clearance, &fastest);
  RecordProperty("plain", std::to_string(plain));
  RecordProperty("kept", std::to_string(kept));
  EXPECT_GT(plain, 0.02);
  EXPECT_GT(kept, plain + 0.05);
  EXPECT_LT(fastest, 10 * calm + 0.1) << "without jumps";
}

}  // namespace
}  // namespace robomosp
