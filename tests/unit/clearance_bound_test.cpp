// SPDX-License-Identifier: Apache-2.0
// Clearance within a tolerance: never above the least distance, below it by no more than was
// allowed, for the library's robots in random configurations and for shapes of every kind.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/collision_bounds.h>

#include "collision/collision.h"
#include "collision/random.h"
#include "motion/provider_params.h"
#include "spatial/convex_hull.h"
#include "spatial/pose.h"
#include "spatial/vec.h"
#include "support/seed.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using collision::CollisionModel;
using collision::Contact;
using test::Workbench;

std::vector<double> random_configurations(const CollisionModel& m, std::size_t count) {
  collision::Random random(test::seed());
  std::vector<double> q(count * m.coordinate_count());
  for (std::size_t i = 0; i < count; ++i)
    for (const auto& r : m.robots())
      collision::random_configuration(*r.model, random, &q[i * m.coordinate_count() + r.first]);
  return q;
}

class ClearanceBound : public ::testing::TestWithParam<const char*> {};

TEST_P(ClearanceBound, IsNeverAboveTheLeastDistanceAndBelowByNoMoreThanAllowed) {
  Workbench bench;
  NoProgress progress;
  const RobotId robot{bench.load(std::string("robots/") + GetParam() + ".rbt").number};
  const evaluation::Sources source{bench.registry, bench.derived, *bench.document.now()};
  const auto model = test::unwrap(CollisionModel::of_robot(source, robot, progress));
  ASSERT_TRUE(model);
  constexpr std::size_t kSamples = 24;
  const auto q = random_configurations(*model, kSamples);
  const auto exact = test::unwrap(model->clearance(q, progress));
  // Every pair by itself, without any bound before.
  const auto all =
      test::unwrap(model->distances(q, std::numeric_limits<double>::infinity(), progress));
  const std::size_t pairs = model->pairs().size();
  ASSERT_GT(pairs, 0U);
  for (std::size_t i = 0; i < kSamples; ++i) {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < pairs; ++k) least = std::min(least, all[i * pairs + k].distance);
    EXPECT_NEAR(exact[i].at.distance, least, 1e-9) << "configuration " << i;
  }
  for (const double tolerance : {1e-6, 1e-3, 1e-2, 1.0}) {
    const auto told = test::unwrap(model->clearance(q, tolerance, progress));
    ASSERT_EQ(told.size(), kSamples);
    std::size_t below = 0, apart = 0;
    for (std::size_t i = 0; i < kSamples; ++i) {
      SCOPED_TRACE("configuration " + std::to_string(i) + ", tolerance " +
                   std::to_string(tolerance));
      const double least = exact[i].at.distance, bound = told[i].at.distance;
      ASSERT_GE(told[i].pair.a, 0);
      if (least <= 0) {
        EXPECT_NEAR(bound, least, 1e-9);
        continue;
      }
      ++apart;
      EXPECT_LE(bound, least * (1 + 1e-9));
      EXPECT_GE(bound, least - tolerance - 1e-9);
      EXPECT_GE(bound, least * (0.5 - 1e-9));
      // What is told of how much it may be too small.
      const double most = spatial::distance(told[i].at.on_a, told[i].at.on_b);
      EXPECT_GE(most, least - 1e-9);
      EXPECT_LE(most - bound, tolerance + 1e-9);
      if (bound < least * (1 - 1e-6)) ++below;
    }
    // Of the irb140 the nearest bodies are always those about its wrist, 11.7 mm apart, which are
    // measured first; no bound is left to show.
    const bool is_measured_first = std::string(GetParam()) == "irb140";
    if (tolerance == 1.0 && model->has_bounds() && apart > kSamples / 2 && !is_measured_first) {
      EXPECT_GT(below, 0U) << "a bound that is always exact is no test of it";
    }
    // Equal questions, equal answers, whatever was asked before.
    for (const std::size_t i : {std::size_t{0}, kSamples / 2, kSamples - 1}) {
      const auto alone = test::unwrap(model->clearance(
          std::span(q).subspan(i * model->coordinate_count(), model->coordinate_count()), tolerance,
          progress));
      EXPECT_EQ(alone[0].at.distance, told[i].at.distance);
      EXPECT_EQ(alone[0].pair.a, told[i].pair.a);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Library, ClearanceBound,
                         ::testing::Values("pa10", "puma560", "panda", "ur10e", "irb140", "delta",
                                           "iiwa14", "cobra600", "gripper"),
                         [](const auto& robot) { return std::string(robot.param); });

TEST(ClearanceBoundArguments, WhatIsNoLengthIsRefused) {
  Workbench bench;
  NoProgress progress;
  const RobotId robot{bench.load("robots/puma560.rbt").number};
  const evaluation::Sources source{bench.registry, bench.derived, *bench.document.now()};
  const auto model = test::unwrap(CollisionModel::of_robot(source, robot, progress));
  const auto q = model->shown();
  for (const double wrong :
       {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_FALSE(model->clearance(q, wrong, progress).ok());
  EXPECT_TRUE(model->clearance(q, 1e300, progress).ok());
  EXPECT_TRUE(model->clearance(q, 1e-300, progress).ok());
}

/// A ring of square section about z, a mesh that is not convex.
Mesh ring(double inner, double outer, double height, int sides) {
  Mesh m;
  for (int i = 0; i < sides; ++i) {
    const double a = 2 * std::numbers::pi * i / sides;
    for (const double r : {inner, outer})
      for (const double z : {-height / 2, height / 2})
        for (const double x : {r * std::cos(a), r * std::sin(a), z}) {
          m.positions.push_back(static_cast<float>(x));
          m.normals.push_back(0);
        }
  }
  const auto at = [&](int i, int k) { return static_cast<std::uint32_t>(4 * (i % sides) + k); };
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    for (const std::uint32_t v : {a, b, c, a, c, d}) m.triangles.push_back(v);
  };
  for (int i = 0; i < sides; ++i) {
    const int n = i + 1;
    quad(at(i, 2), at(n, 2), at(n, 3), at(i, 3));
    quad(at(i, 1), at(n, 1), at(n, 0), at(i, 0));
    quad(at(i, 3), at(n, 3), at(n, 1), at(i, 1));
    quad(at(i, 0), at(n, 0), at(n, 2), at(i, 2));
  }
  return m;
}

/// Every kind of shape against a ring, near and far, within it and around it: the engine's own
/// distances, and those of finely sampled points, which are never below.
TEST(ClearanceBoundShapes, EveryKindAgainstAMeshAgreesWithItsExactDistance) {
  Workbench bench;
  NoProgress progress;
  const Mesh meshes[] = {ring(0.3, 0.5, 0.2, 24), ring(0.05, 0.08, 0.6, 10)};
  const auto engine = test::unwrap(bench.registry.create<CollisionEngine>("fcl"));
  const auto info = test::unwrap(bench.registry.find(CollisionEngine::kInterfaceId, "fcl"));
  std::vector<ShapedBody> bodies(1);
  bodies[0].shapes.push_back({ShapeKind::mesh, {}, &meshes[0], {}, {}});
  const auto add = [&](ShapeKind kind, Vec3 sizes, const Mesh* mesh) {
    bodies.push_back({{Shape{kind, sizes, mesh, {}, {}}}});
  };
  add(ShapeKind::mesh, {}, &meshes[1]);
  add(ShapeKind::box, {0.2, 0.1, 0.3}, nullptr);
  add(ShapeKind::sphere, {0.1, 0, 0}, nullptr);
  add(ShapeKind::cylinder, {0.1, 0.3, 0}, nullptr);
  add(ShapeKind::capsule, {0.05, 0.4, 0}, nullptr);
  add(ShapeKind::cone, {0.1, 0.02, 0.3}, nullptr);
  add(ShapeKind::ellipsoid, {0.1, 0.2, 0.05}, nullptr);
  add(ShapeKind::convex, {}, &meshes[1]);
  const auto params =
      test::unwrap(motion::checked_params(info, model::ProviderChoice{}, "collision"));
  const auto scene = test::unwrap(engine->build(bodies, *params, progress));
  ASSERT_TRUE(scene);
  const auto* bounds = static_cast<const CollisionBounds*>(scene->extension(CollisionBounds::kId));
  ASSERT_TRUE(bounds);
  EXPECT_EQ(scene->extension("robomosp.no_such/1"), nullptr);
  std::vector<CollisionPair> pairs;
  for (std::size_t k = 1; k < bodies.size(); ++k)
    pairs.push_back(k % 2 == 0 ? CollisionPair{0, static_cast<std::int32_t>(k)}
                               : CollisionPair{static_cast<std::int32_t>(k), 0});
  std::mt19937 random(test::seed());
  std::normal_distribution<double> normal;
  constexpr std::size_t kSamples = 300;
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < kSamples; ++i)
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      double q[4];
      for (double& x : q) x = normal(random);
      const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
      for (double& x : q) x /= n;
      Pose p;
      p.R = spatial::quaternion_rotation(q);
      const double far = i % 3 == 0 ? 0.05 : i % 3 == 1 ? 0.4 : 2;
      if (b > 0) p.p = {far * normal(random), far * normal(random), far * normal(random)};
      poses.push_back(p);
    }
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::vector<PairDistance> exact(kSamples * pairs.size()), told(exact.size());
  ASSERT_TRUE(scene->distances(poses, pairs, kInf, exact, progress).ok());
  std::vector<std::uint8_t> touch(exact.size());
  ASSERT_TRUE(scene->collisions(poses, pairs, touch, progress).ok());
  std::size_t touching = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_EQ(touch[i] != 0, exact[i].distance <= 0) << i;
    touching += touch[i];
  }
  EXPECT_GT(touching, exact.size() / 20);
  EXPECT_LT(touching, exact.size() / 2);
  for (const double tolerance : {1e-9, 1e-3, 0.05, 1e6})
    for (const double interest : {kInf, 0.3}) {
      ASSERT_TRUE(bounds->lower_bounds(poses, pairs, interest, tolerance, told, progress).ok());
      for (std::size_t i = 0; i < told.size(); ++i) {
        SCOPED_TRACE("pair " + std::to_string(i % pairs.size()) + " of sample " +
                     std::to_string(i / pairs.size()));
        const double d = exact[i].distance;
        if (d <= 0) {
          EXPECT_LE(told[i].distance, 0);
          continue;
        }
        EXPECT_GT(told[i].distance, 0);
        EXPECT_LE(told[i].distance, d * (1 + 1e-8) + 1e-12);
        const double counts = std::min(d, interest);
        EXPECT_GE(told[i].distance, std::max(counts - tolerance, counts / 2) * (1 - 1e-8) - 1e-12);
        if (told[i].on_a == told[i].on_b) {
          EXPECT_GE(d, std::min(interest - tolerance, interest / 2) - 1e-9);
        } else {
          EXPECT_LE(d, spatial::distance(told[i].on_a, told[i].on_b) * (1 + 1e-8) + 1e-12);
        }
      }
    }
  // The exact distances are those of the nearest of many points of both surfaces, which are never
  // nearer: two meshes, whose triangles are sampled.
  const auto points = [](const Mesh& m, const Pose& at) {
    const auto v = spatial::vertices(m);
    std::vector<Vec3> out;
    for (std::size_t t = 0; t < m.triangles.size(); t += 3)
      for (int a = 0; a <= 8; ++a)
        for (int b = 0; a + b <= 8; ++b) {
          const double x = a / 8.0, y = b / 8.0;
          const Vec3 p = spatial::add(spatial::scale(v[m.triangles[t]], 1 - x - y),
                                      spatial::add(spatial::scale(v[m.triangles[t + 1]], x),
                                                   spatial::scale(v[m.triangles[t + 2]], y)));
          out.push_back(spatial::transform(at, p));
        }
    return out;
  };
  for (std::size_t i = 0; i < 12; ++i) {
    const double d = exact[i * pairs.size()].distance;
    if (d <= 0) continue;
    double least = kInf;
    for (const Vec3& x : points(meshes[0], poses[i * bodies.size()]))
      for (const Vec3& y : points(meshes[1], poses[i * bodies.size() + 1]))
        least = std::min(least, spatial::distance(x, y));
    EXPECT_GE(least, d - 1e-9);
    EXPECT_LE(least, d + 0.06);
  }
}

/// Farthest point of a box, cylinder or sphere in a direction, in the world.
Vec3 farthest(const Shape& s, const Pose& at, const Vec3& way) {
  const Vec3 d = spatial::rotate_back(at, way);
  Vec3 p{};
  const double r = std::hypot(d[0], d[1]);
  if (s.kind == ShapeKind::box)
    for (std::size_t k = 0; k < 3; ++k) p[k] = std::copysign(s.sizes[k] / 2, d[k]);
  if (s.kind == ShapeKind::cylinder)
    p = {r > 0 ? d[0] / r * s.sizes[0] : 0, r > 0 ? d[1] / r * s.sizes[0] : 0,
         std::copysign(s.sizes[1] / 2, d[2])};
  if (s.kind == ShapeKind::sphere) p = spatial::scale(spatial::unit(d), s.sizes[0]);
  return spatial::transform(at, p);
}

/// Nearest point of one of them to a point outside, in the world.
Vec3 nearest(const Shape& s, const Pose& at, const Vec3& point) {
  Vec3 p = spatial::transform(spatial::inverse(at), point);
  const double r = std::hypot(p[0], p[1]);
  if (s.kind == ShapeKind::box)
    for (std::size_t k = 0; k < 3; ++k) p[k] = std::clamp(p[k], -s.sizes[k] / 2, s.sizes[k] / 2);
  if (s.kind == ShapeKind::cylinder) {
    for (std::size_t k = 0; k < 2; ++k) p[k] *= r > s.sizes[0] ? s.sizes[0] / r : 1;
    p[2] = std::clamp(p[2], -s.sizes[1] / 2, s.sizes[1] / 2);
  }
  if (s.kind == ShapeKind::sphere) p = spatial::scale(spatial::unit(p), s.sizes[0]);
  return spatial::transform(at, p);
}

/// Depths of shapes that overlap: out along the way told they are free, and no way of many is
/// shorter.
TEST(Depths, AreTheLeastWayOut) {
  Workbench bench;
  NoProgress progress;
  const auto engine = test::unwrap(bench.registry.create<CollisionEngine>("fcl"));
  const auto info = test::unwrap(bench.registry.find(CollisionEngine::kInterfaceId, "fcl"));
  const auto params =
      test::unwrap(motion::checked_params(info, model::ProviderChoice{}, "collision"));
  const std::vector<Shape> shapes{{ShapeKind::box, {0.8, 0.5, 0.3}, nullptr, {}, {}},
                                  {ShapeKind::box, {0.1, 1.5, 0.2}, nullptr, {}, {}},
                                  {ShapeKind::cylinder, {0.3, 0.9, 0}, nullptr, {}, {}},
                                  {ShapeKind::cylinder, {0.5, 0.1, 0}, nullptr, {}, {}},
                                  {ShapeKind::sphere, {0.4, 0, 0}, nullptr, {}, {}}};
  std::vector<ShapedBody> bodies;
  for (const Shape& s : shapes) bodies.push_back({{s}});
  const auto scene = test::unwrap(engine->build(bodies, *params, progress));
  ASSERT_TRUE(scene);
  // Nothing but convex shapes: bounds would say no more than distances.
  EXPECT_EQ(scene->extension(CollisionBounds::kId), nullptr);
  std::vector<CollisionPair> pairs;
  for (std::int32_t a = 0; a < 5; ++a)
    for (std::int32_t b = 0; b < 5; ++b)
      if (a != b) pairs.push_back({a, b});
  std::mt19937 random(test::seed());
  std::normal_distribution<double> normal;
  const auto place = [&](double far) {
    double q[4];
    for (double& x : q) x = normal(random);
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& x : q) x /= n;
    Pose p;
    p.R = spatial::quaternion_rotation(q);
    p.p = {far * normal(random), far * normal(random), far * normal(random)};
    return p;
  };
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::vector<PairDistance> out(pairs.size()), freed(1);
  std::size_t deep = 0;
  for (int sample = 0; sample < 60; ++sample) {
    std::vector<Pose> poses;
    for (std::size_t b = 0; b < bodies.size(); ++b) poses.push_back(place(0.15));
    ASSERT_TRUE(scene->distances(poses, pairs, kInf, out, progress).ok());
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      SCOPED_TRACE("sample " + std::to_string(sample) + ", bodies " + std::to_string(pairs[k].a) +
                   " and " + std::to_string(pairs[k].b));
      const double depth = -out[k].distance;
      if (!(depth > 1e-6)) continue;
      ++deep;
      const auto a = static_cast<std::size_t>(pairs[k].a), b = static_cast<std::size_t>(pairs[k].b);
      // From b's point to a's is the way that b has to go.
      const Vec3 way = spatial::sub(out[k].on_a, out[k].on_b);
      EXPECT_NEAR(spatial::norm(way), depth, 1e-9);
      std::vector<Pose> moved = poses;
      moved[b].p = spatial::add(moved[b].p, spatial::scale(way, 1 + 1e-6));
      ASSERT_TRUE(scene->distances(moved, std::span(&pairs[k], 1), kInf, freed, progress).ok());
      EXPECT_GE(freed[0].distance, -1e-7 * depth);
      for (int i = 0; i < 400; ++i) {
        const Vec3 n = spatial::unit({normal(random), normal(random), normal(random)});
        const double width =
            spatial::dot(n, spatial::sub(farthest(shapes[a], poses[a], n),
                                         farthest(shapes[b], poses[b], spatial::scale(n, -1))));
        EXPECT_LE(depth, width + 1e-8) << "way " << n[0] << " " << n[1] << " " << n[2];
      }
    }
  }
  EXPECT_GT(deep, 200U);
}

/// Shapes apart, by any way to compute them: the plane across the way that is told has one on each
/// side, and no points are nearer.
TEST(Distances, HaveAPlaneBetweenAndNoNearerPoints) {
  Workbench bench;
  NoProgress progress;
  const auto engine = test::unwrap(bench.registry.create<CollisionEngine>("fcl"));
  const auto info = test::unwrap(bench.registry.find(CollisionEngine::kInterfaceId, "fcl"));
  const auto params =
      test::unwrap(motion::checked_params(info, model::ProviderChoice{}, "collision"));
  const std::vector<Shape> shapes{{ShapeKind::box, {0.8, 0.5, 0.3}, nullptr, {}, {}},
                                  {ShapeKind::box, {0.1, 1.5, 0.2}, nullptr, {}, {}},
                                  {ShapeKind::cylinder, {0.3, 0.9, 0}, nullptr, {}, {}},
                                  {ShapeKind::cylinder, {0.5, 0.1, 0}, nullptr, {}, {}},
                                  {ShapeKind::sphere, {0.4, 0, 0}, nullptr, {}, {}},
                                  {ShapeKind::sphere, {0.1, 0, 0}, nullptr, {}, {}}};
  std::vector<ShapedBody> bodies;
  // Once in the body's frame and once placed in it.
  for (const Shape& s : shapes) bodies.push_back({{s}});
  std::mt19937 random(test::seed());
  std::normal_distribution<double> normal;
  const auto place = [&](double far) {
    double q[4];
    for (double& x : q) x = normal(random);
    const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& x : q) x /= n;
    Pose p;
    p.R = spatial::quaternion_rotation(q);
    p.p = {far * normal(random), far * normal(random), far * normal(random)};
    return p;
  };
  for (const Shape& s : shapes) {
    Shape placed = s;
    placed.pose = place(0.3);
    bodies.push_back({{placed}});
  }
  const auto scene = test::unwrap(engine->build(bodies, *params, progress));
  ASSERT_TRUE(scene);
  std::vector<CollisionPair> pairs;
  const auto count = static_cast<std::int32_t>(bodies.size());
  for (std::int32_t a = 0; a < count; ++a)
    for (std::int32_t b = 0; b < count; ++b)
      if (a != b) pairs.push_back({a, b});
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::vector<PairDistance> out(pairs.size()), near(pairs.size());
  std::size_t apart = 0;
  for (int sample = 0; sample < 100; ++sample) {
    std::vector<Pose> poses;
    for (std::size_t b = 0; b < bodies.size(); ++b) poses.push_back(place(sample % 2 ? 0.7 : 3));
    ASSERT_TRUE(scene->distances(poses, pairs, kInf, out, progress).ok());
    ASSERT_TRUE(scene->distances(poses, pairs, 0.5, near, progress).ok());
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const double d = out[k].distance;
      if (d <= 0.5) EXPECT_NEAR(near[k].distance, d, 1e-12);
      else EXPECT_GE(near[k].distance, 0.5);
      if (!(d > 1e-6)) continue;
      ++apart;
      const auto a = static_cast<std::size_t>(pairs[k].a), b = static_cast<std::size_t>(pairs[k].b);
      const auto shape = [&](std::size_t body) { return bodies[body].shapes[0]; };
      const auto at = [&](std::size_t body) {
        return spatial::compose(poses[body], shape(body).pose);
      };
      const Vec3 n = spatial::unit(spatial::sub(out[k].on_b, out[k].on_a));
      EXPECT_NEAR(spatial::distance(out[k].on_a, out[k].on_b), d, 1e-9);
      const auto between = [&](const Vec3& way) {
        return spatial::dot(way, spatial::sub(farthest(shape(b), at(b), spatial::scale(way, -1)),
                                              farthest(shape(a), at(a), way)));
      };
      // The plane across the way is between them; it turns by more than the distance is off.
      EXPECT_LE(between(n), d + 1e-9);
      EXPECT_GE(between(n), d - 1e-4);
      // Nearest points in turn find none that are nearer.
      Vec3 on_a = out[k].on_a, on_b = out[k].on_b;
      for (int i = 0; i < 2000; ++i) {
        on_a = nearest(shape(a), at(a), on_b);
        on_b = nearest(shape(b), at(b), on_a);
      }
      EXPECT_NEAR(spatial::distance(on_a, on_b), d, 1e-9) << "bodies " << a << " and " << b;
    }
  }
  EXPECT_GT(apart, 5000U);
}

}  // namespace
}  // namespace robomosp
