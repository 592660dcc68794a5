// SPDX-License-Identifier: Apache-2.0
// Shapes from CSG, the pairs of a robot, whole paths and the clearance as a field.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "collision/cache.h"
#include "collision/collision.h"
#include "evaluation/shapes.h"
#include "spatial/convex_hull.h"
#include "spatial/pose.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using collision::CollisionModel;
using model::SolidNode;
using test::unwrap;
using test::Workbench;

SolidNode node(CsgKind kind, const char* name, std::int32_t parent, std::array<double, 6> sizes,
               Vec3 at = {}) {
  SolidNode n;
  n.kind = kind;
  n.name = name;
  n.parent = parent;
  n.sizes = sizes;
  n.placement.position = at;
  return n;
}

TEST(ConvexHull, OfPointsInABoxHasItsCornersAndVolume) {
  std::vector<Vec3> points;
  for (int x = 0; x <= 4; ++x)
    for (int y = 0; y <= 3; ++y)
      for (int z = 0; z <= 2; ++z) points.push_back({0.1 * x, 0.1 * y, 0.1 * z});
  const auto hull = spatial::convex_hull(points);
  ASSERT_TRUE(hull);
  EXPECT_NEAR(hull->volume, 0.4 * 0.3 * 0.2, 1e-12);
  for (const auto& t : hull->triangles) {
    const Vec3 n =
        spatial::unit(spatial::cross(spatial::sub(hull->points[t[1]], hull->points[t[0]]),
                                     spatial::sub(hull->points[t[2]], hull->points[t[0]])));
    for (const Vec3& p : points)
      EXPECT_LE(spatial::dot(n, spatial::sub(p, hull->points[t[0]])), 1e-9);
  }
  for (Vec3& p : points) p[2] = 0.3 * p[0];
  EXPECT_FALSE(spatial::convex_hull(points)) << "a plane has no volume";
}

class Shapes : public testing::Test {
 protected:
  Workbench bench;
  NoProgress none;

  std::shared_ptr<const std::vector<evaluation::ShapePiece>> shapes(std::vector<SolidNode> nodes) {
    auto t = bench.document.begin("solid");
    model::Solid s;
    s.nodes = std::move(nodes);
    const auto id = unwrap(t->add("part" + std::to_string(++count_), std::move(s)));
    EXPECT_TRUE(t->commit().ok());
    const auto snapshot = bench.document.now();
    return unwrap(bench.derived.shapes(*snapshot, id, none));
  }
  int count_ = 0;
};

TEST_F(Shapes, PrimitivesAndUnionsOfThemStayPrimitives) {
  const auto s = shapes({node(CsgKind::union_, "all", -1, {}),
                         node(CsgKind::box, "plate", 0, {0.4, 0.2, 0.02}),
                         node(CsgKind::cylinder, "post", 0, {0.03, 0.3}, {0.1, 0, 0.02}),
                         node(CsgKind::sphere, "knob", 0, {0.04}, {0.1, 0, 0.32})});
  ASSERT_EQ(s->size(), 3U);
  EXPECT_EQ((*s)[0].kind, ShapeKind::box);
  EXPECT_NEAR((*s)[0].pose.p[2], 0.01, 1e-15) << "boxes stand on z = 0, shapes are centred";
  EXPECT_EQ((*s)[1].kind, ShapeKind::cylinder);
  EXPECT_NEAR((*s)[1].pose.p[2], 0.02 + 0.15, 1e-15);
  EXPECT_EQ((*s)[2].kind, ShapeKind::sphere);
}

TEST_F(Shapes, ConvexSolidsBecomeHullsAndHollowOnesMeshes) {
  const auto cone = shapes({node(CsgKind::cone, "cone", -1, {0.1, 0.05, 0.2})});
  ASSERT_EQ(cone->size(), 1U);
  EXPECT_EQ((*cone)[0].kind, ShapeKind::convex);
  // A cylinder with its rims rounded off, and a box with a corner cut off, are convex.
  EXPECT_EQ((*shapes({node(CsgKind::cylinder, "c", -1, {0.1, 0.2, 0.01})}))[0].kind,
            ShapeKind::convex);
  const auto cut =
      shapes({node(CsgKind::difference, "d", -1, {}), node(CsgKind::box, "b", 0, {0.2, 0.2, 0.2}),
              node(CsgKind::box, "half", 0, {0.2, 0.4, 0.4}, {0.15, 0, 0})});
  ASSERT_EQ(cut->size(), 1U);
  EXPECT_EQ((*cut)[0].kind, ShapeKind::convex);
  const auto bored =
      shapes({node(CsgKind::difference, "d", -1, {}), node(CsgKind::box, "b", 0, {0.2, 0.2, 0.2}),
              node(CsgKind::cylinder, "h", 0, {0.05, 0.4}, {0, 0, -0.1})});
  ASSERT_EQ(bored->size(), 1U);
  EXPECT_EQ((*bored)[0].kind, ShapeKind::mesh);
}

TEST_F(Shapes, EllipsoidsAndWhatAScaleMakesOfPrimitivesSayWhatTheyAre) {
  const evaluation::TakenShapes all{true, true};
  const auto egg = shapes({node(CsgKind::ellipsoid, "e", -1, {0.1, 0.05, 0.2})});
  ASSERT_EQ(egg->size(), 1U);
  EXPECT_EQ((*egg)[0].shape(all).kind, ShapeKind::ellipsoid);
  EXPECT_EQ((*egg)[0].shape(all).sizes, (Vec3{0.1, 0.05, 0.2}));
  // Whoever takes none gets a hull about as far within as beyond it.
  ASSERT_EQ((*egg)[0].shape({true, false}).kind, ShapeKind::convex);
  double least = 2, most = 0;
  for (const Vec3& p : (*egg)[0].points()) {
    const double at = std::hypot(p[0] / 0.1, p[1] / 0.05, p[2] / 0.2);
    least = std::min(least, at), most = std::max(most, at);
  }
  EXPECT_GT(least, 1);
  EXPECT_LT(most, 1.005);
  const auto hull = spatial::convex_hull((*egg)[0].points());
  ASSERT_TRUE(hull);
  EXPECT_NEAR(hull->volume, 4 * std::numbers::pi / 3 * 0.001, 0.01 * 0.005);

  const auto scaled = [&](CsgKind kind, std::array<double, 6> sizes) {
    return (*shapes({node(CsgKind::scale, "s", -1, {2, 2, 3}, {1, 0, 0}),
                     node(kind, "child", 0, sizes, {0.1, 0, 0})}))[0];
  };
  const auto ball = scaled(CsgKind::sphere, {0.1});
  EXPECT_EQ(ball.shape(all).kind, ShapeKind::ellipsoid);
  EXPECT_EQ(ball.shape(all).sizes, (Vec3{0.2, 0.2, 0.1 * 3}));
  EXPECT_NEAR(ball.pose.p[0], 1.2, 1e-15);
  const auto box = scaled(CsgKind::box, {0.1, 0.2, 0.3});
  EXPECT_EQ(box.kind, ShapeKind::box);
  EXPECT_EQ(box.sizes, (Vec3{0.2, 0.4, 0.3 * 3}));
  EXPECT_NEAR(box.pose.p[2], 0.45, 1e-15);
  EXPECT_EQ(scaled(CsgKind::cylinder, {0.1, 0.2}).kind, ShapeKind::cylinder);
  EXPECT_EQ(scaled(CsgKind::cone, {0.1, 0, 0.2}).shape(all).kind, ShapeKind::cone);
  EXPECT_EQ(scaled(CsgKind::torus, {0.1, 0.02}).kind, ShapeKind::mesh);
}

TEST_F(Shapes, DifferencesOfUnionsAreDividedAndPatternsCopied) {
  // Two arms of an L; the hole is in one of them only, and the tool swallows the third part.
  const auto l = shapes({node(CsgKind::difference, "d", -1, {}), node(CsgKind::union_, "u", 0, {}),
                         node(CsgKind::box, "one", 1, {0.4, 0.1, 0.1}),
                         node(CsgKind::box, "two", 1, {0.1, 0.1, 0.4}, {0.15, 0, 0}),
                         node(CsgKind::box, "lost", 1, {0.02, 0.02, 0.02}, {-0.1, 0, 0.04}),
                         node(CsgKind::cylinder, "hole", 0, {0.03, 1}, {-0.1, 0, -0.5})});
  ASSERT_EQ(l->size(), 2U);
  EXPECT_EQ((*l)[0].kind, ShapeKind::mesh);
  EXPECT_EQ((*l)[1].kind, ShapeKind::convex);
  const auto row = shapes({node(CsgKind::linear_pattern, "p", -1, {3, 0.5, 0, 0}),
                           node(CsgKind::box, "b", 0, {0.1, 0.1, 0.1})});
  ASSERT_EQ(row->size(), 3U);
  EXPECT_NEAR((*row)[2].pose.p[0], 1.0, 1e-12);
  const auto ring = shapes({node(CsgKind::circular_pattern, "p", -1, {4, 2 * std::numbers::pi}),
                            node(CsgKind::sphere, "b", 0, {0.1}, {1, 0, 0})});
  ASSERT_EQ(ring->size(), 4U);
  EXPECT_NEAR((*ring)[1].pose.p[1], 1.0, 1e-12);
}

/// Two rods of 1 m in a plane, each a box of 0.1 by 0.1 along x, and a post far out.
class Rods : public testing::Test {
 protected:
  Workbench bench;
  NoProgress none;
  WorldId world;
  RobotId robot;

  void SetUp() override {
    auto t = bench.document.begin("world");
    model::Solid rod;
    rod.nodes = {node(CsgKind::box, "b", -1, {0.8, 0.1, 0.1}, {-0.5, 0, -0.05})};
    const auto rod_id = unwrap(t->add("rod", std::move(rod)));
    model::Solid post;
    post.nodes = {node(CsgKind::cylinder, "p", -1, {0.05, 1}, {0, 0, -0.5})};
    const auto post_id = unwrap(t->add("post", std::move(post)));
    model::Robot arm;
    for (int i = 0; i < 3; ++i) {
      model::Link l;
      l.name = "rod" + std::to_string(i + 1);
      l.parent = i - 1;
      l.row.a = 1;
      l.lower = -3;
      l.upper = 3;
      l.parts.push_back({rod_id, {}});
      arm.links.push_back(std::move(l));
    }
    robot = unwrap(t->add("arm", std::move(arm)));
    model::World w;
    w.robots.push_back({"arm", robot, {}, {0, 0, 0}});
    model::PlacedObject o{"post", post_id, {}};
    o.placement.position = {0, 2.5, 0};
    w.objects.push_back(o);
    world = unwrap(t->add("cell", std::move(w)));
    ASSERT_TRUE(t->commit().ok());
  }
  std::shared_ptr<const CollisionModel> model_of() {
    const auto snapshot = bench.document.now();
    const evaluation::Sources source{bench.registry, bench.derived, *snapshot};
    return unwrap(CollisionModel::of_world(source, world, none));
  }
};

TEST_F(Rods, NeighboursMayTouchAndRulesDecideOtherwise) {
  const auto m = model_of();
  const auto names = [&](const std::vector<CollisionPair>& pairs) {
    std::vector<std::string> out;
    for (const CollisionPair& p : pairs) out.push_back(m->describe(p));
    return out;
  };
  EXPECT_EQ(names(m->pairs()),
            (std::vector<std::string>{"post and arm.rod1", "post and arm.rod2", "post and arm.rod3",
                                      "arm.rod1 and arm.rod3"}));
  ASSERT_EQ(m->passed().size(), 2U);
  EXPECT_EQ(m->passed()[0].reason, collision::PairReason::adjacent);

  auto t = bench.document.begin("rules");
  ASSERT_TRUE(t->edit(world, [](model::Record& r) -> Result<void> {
                 std::get<model::World>(r.body).pair_rules = {{"arm", "post", true, "soft"},
                                                              {"arm.rod3", "post", false, ""},
                                                              {"arm.rod2", "arm.rod1", false, ""}};
                 return {};
               }).ok());
  ASSERT_TRUE(t->commit().ok());
  const auto ruled = model_of();
  std::vector<std::string> left;
  for (const CollisionPair& p : ruled->pairs()) left.push_back(ruled->describe(p));
  EXPECT_EQ(left, (std::vector<std::string>{"post and arm.rod3", "arm.rod1 and arm.rod2",
                                            "arm.rod1 and arm.rod3"}))
      << "a body's own name counts before that of its robot";
}

TEST_F(Rods, DistancesFollowTheConfiguration) {
  const auto m = model_of();
  // Straight along x: the rods reach from y = -0.05 to 0.05, the post from y = 2.45 on.
  const auto nearest = unwrap(m->clearance(std::vector<double>{0, 0, 0}, none));
  EXPECT_EQ(m->describe(nearest[0].pair), "arm.rod1 and arm.rod3");
  // Rod 1 ends at x = 0.9, rod 3 begins at 2.1.
  EXPECT_NEAR(nearest[0].at.distance, 1.2, 1e-9);
  const auto all = unwrap(
      m->distances(std::vector<double>{0, 0, 0}, std::numeric_limits<double>::infinity(), none));
  // Post's wall before the corner of rod 1 nearest to x = 0: (0.1, 0.05).
  EXPECT_NEAR(all[0].distance, std::hypot(0.1, 2.45) - 0.05, 1e-9);
  // Straight up along y: rod 3 lies over the post.
  const std::vector<double> up{std::numbers::pi / 2, 0, 0};
  const auto hits = unwrap(m->collisions(up, none));
  ASSERT_FALSE(hits.empty());
  EXPECT_EQ(m->describe(hits[0]).substr(0, 4), "post");
}

TEST_F(Rods, APathIsCheckedBetweenItsSamples) {
  const auto m = model_of();
  // From one side of the post to the other: neither end touches.
  const std::vector<double> path{1.2, 0, 0, 2.0, 0, 0};
  for (const std::size_t end : {0U, 3U})
    EXPECT_TRUE(unwrap(m->collisions(std::span<const double>(path).subspan(end, 3), none)).empty());
  const auto contact = unwrap(m->check_path(path, 1e-5, none));
  ASSERT_TRUE(contact);
  EXPECT_EQ(contact->segment, 0U);
  // The side of the rods, 0.05 to the left of the axis, meets the post's wall, 0.05 about (0, 2.5):
  // their distance is 2.5 cos(q) - 0.1.
  const double q = 1.2 + 0.8 * contact->share;
  EXPECT_NEAR(2.5 * std::cos(q) - 0.1, 1e-5, 1e-5);
  EXPECT_LE(contact->contact.at.distance, 1e-5);
  // The same with many samples, none of which touches before.
  std::vector<double> fine;
  for (int i = 0; i <= 400; ++i) fine.insert(fine.end(), {1.2 + 0.002 * i, 0, 0});
  const auto again = unwrap(m->check_path(fine, 1e-5, none));
  ASSERT_TRUE(again);
  EXPECT_NEAR(1.2 + 0.002 * (static_cast<double>(again->segment) + again->share), q, 1e-5);
  // Away from the post nothing is met.
  EXPECT_FALSE(unwrap(m->check_path(std::vector<double>{1.2, 0, 0, -1, 0.5, 0.5}, 1e-5, none)));
  // What would take minutes is refused with its limit.
  const auto far = m->check_path(std::vector<double>{1.2, 0, 0, 1.2, 10001, 0}, 1e-5, none);
  ASSERT_FALSE(far.ok());
  EXPECT_NE(far.error().sentence().find("at most 10000 apart"), std::string::npos)
      << far.error().sentence();
}

TEST_F(Rods, TheGradientOfTheClearanceIsThatOfDifferences) {
  const auto m = model_of();
  const auto field = unwrap(m->field(0, 5, none));
  for (const std::vector<double>& q :
       {std::vector{0.9, 0.3, 0.2}, std::vector{1.2, 0.1, -0.4}, std::vector{0.2, 2.0, 1.5}}) {
    std::vector<double> gradient(3), unused(3);
    field->distance(q, gradient);
    for (std::size_t j = 0; j < 3; ++j) {
      constexpr double h = 1e-6;
      std::vector<double> plus = q, minus = q;
      plus[j] += h;
      minus[j] -= h;
      const double slope =
          (field->distance(plus, unused) - field->distance(minus, unused)) / (2 * h);
      EXPECT_NEAR(gradient[j], slope, 1e-6) << "joint " << j + 1;
    }
  }
}

TEST_F(Rods, APreparedModelIsKeptUntilSomethingThatItWasMadeFromChanges) {
  collision::CollisionCache cache;
  const auto find = [&](AnyId id) {
    const auto snapshot = bench.document.now();
    return unwrap(cache.find({bench.registry, bench.derived, *snapshot}, id, none));
  };
  // Of the post from the nearest corner of rod 1 when all rods lie along x: (0.1, half its width).
  const auto of_post = [&](const CollisionModel& m) {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    return unwrap(m.distances(std::vector<double>{0, 0, 0}, kFar, none))[0].distance;
  };
  const auto expected = [](double y, double half_width, double radius) {
    return std::hypot(0.1, y - half_width) - radius;
  };
  const auto change = [&](AnyId id, auto&& fn) {
    auto t = bench.document.begin("change");
    ASSERT_TRUE(t->edit(id, [&](model::Record& r) -> Result<void> {
                   fn(r.body);
                   return {};
                 }).ok());
    ASSERT_TRUE(t->commit().ok());
  };
  const auto kept = find(world);
  EXPECT_EQ(find(world), kept);
  EXPECT_NE(find(robot), kept) << "the robot alone is another model";
  EXPECT_EQ(find(world), kept);
  const auto snapshot = bench.document.now();
  const AnyId post = *snapshot->find(Kind::solid, "post"),
              rod = *snapshot->find(Kind::solid, "rod");

  auto t = bench.document.begin("unrelated");
  ASSERT_TRUE(t->add("other", model::Solid(*snapshot->get(SolidId{post.number}))).ok());
  ASSERT_TRUE(t->commit().ok());
  EXPECT_EQ(find(world), kept) << "what it does not refer to makes nothing anew";

  // The world itself, a solid that it refers to, and one that its robot refers to.
  EXPECT_NEAR(of_post(*find(world)), expected(2.5, 0.05, 0.05), 1e-9);
  change(world, [](auto& body) {
    std::get<model::World>(body).objects[0].placement.position = {0, 3.5, 0};
  });
  EXPECT_NEAR(of_post(*find(world)), expected(3.5, 0.05, 0.05), 1e-9);
  change(post, [](auto& body) { std::get<model::Solid>(body).nodes[0].sizes[0] = 0.25; });
  EXPECT_NEAR(of_post(*find(world)), expected(3.5, 0.05, 0.25), 1e-9);
  change(rod, [](auto& body) { std::get<model::Solid>(body).nodes[0].sizes[1] = 0.2; });
  EXPECT_NEAR(of_post(*find(world)), expected(3.5, 0.1, 0.25), 1e-9);
  // Within a transaction that is not committed, and after it was dropped.
  const auto committed = find(world);
  {
    auto open = bench.document.begin("try");
    ASSERT_TRUE(open->edit(post,
                           [](model::Record& r) -> Result<void> {
                             std::get<model::Solid>(r.body).nodes[0].sizes[0] = 0.05;
                             return {};
                           })
                    .ok());
    const auto inside =
        unwrap(cache.find({bench.registry, bench.derived, open->now()}, world, none));
    EXPECT_NEAR(of_post(*inside), expected(3.5, 0.1, 0.05), 1e-9);
  }
  EXPECT_EQ(find(world), committed);
}

TEST_F(Rods, SampledPairsAreTheSameForTheSameSeed) {
  const auto snapshot = bench.document.now();
  const evaluation::Sources source{bench.registry, bench.derived, *snapshot};
  const auto m = unwrap(CollisionModel::of_robot(source, robot, none));
  ASSERT_EQ(m->pairs().size(), 1U);
  // Rods 1 and 3 meet when the arm folds back, so the pair touches neither always nor never.
  EXPECT_TRUE(unwrap(m->sample_pairs(2000, 7, none)).empty());
  const auto few = unwrap(m->sample_pairs(1, 7, none)), same = unwrap(m->sample_pairs(1, 7, none));
  ASSERT_EQ(few.size(), 1U);
  EXPECT_EQ(few[0].always, same[0].always);
}

}  // namespace
}  // namespace robomosp
