// SPDX-License-Identifier: Apache-2.0
// Checks in lanes against exact distances: single configurations, samples of motions, and motions
// that are free for certain, for every kind of shape and joint.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "collision/collision.h"
#include "collision/cover.h"
#include "collision/random.h"
#include "collision/search_check.h"
#include "spatial/vec.h"
#include "support/seed.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using collision::CollisionModel;
using collision::MotionFound;
using collision::SearchCheck;
using test::unwrap;
using test::Workbench;

struct SpheresOf {
  CsgKind kind;
  std::array<double, 6> sizes;  ///< about 0.2 m
};
/// The torus becomes triangles, cone, ellipsoid and wedge hulls or shapes of their own.
const std::vector<SpheresOf> kKinds{{CsgKind::box, {0.2, 0.12, 0.16}},
                                    {CsgKind::cylinder, {0.08, 0.2}},
                                    {CsgKind::sphere, {0.1}},
                                    {CsgKind::cone, {0.1, 0.03, 0.2}},
                                    {CsgKind::ellipsoid, {0.12, 0.08, 0.05}},
                                    {CsgKind::wedge, {0.2, 0.1, 0.15, 0.05}},
                                    {CsgKind::torus, {0.1, 0.03}}};

class SearchChecks : public testing::Test {
 protected:
  Workbench bench;
  NoProgress none;
  collision::Random random{test::seed()};

  SolidId solid(document::Transaction& t, const std::string& name, const SpheresOf& kind) {
    model::Solid s;
    model::SolidNode n;
    n.kind = kind.kind;
    n.name = name;
    n.sizes = kind.sizes;
    s.nodes = {n};
    return unwrap(t.add(name, std::move(s)));
  }
  /// An arm of four links, the third of which slides, each of another kind of shape, among objects
  /// of all kinds.
  std::shared_ptr<const CollisionModel> world(const std::vector<SpheresOf>& of_links) {
    auto t = bench.document.begin("make");
    model::Robot r;
    for (int i = 0; i < 4; ++i) {
      model::Link l;
      l.name = "link" + std::to_string(i + 1);
      l.parent = i - 1;
      l.row.a = 0.4;
      l.row.alpha = i == 1 ? 0 : 0.9 * (i % 2);
      l.lower = i == 2 ? -0.2 : -3;
      l.upper = i == 2 ? 0.3 : 3;
      if (i == 2) l.joint = model::JointKind::prismatic;
      const std::string name = "part" + std::to_string(i);
      l.parts.push_back(
          {solid(*t, name, of_links[static_cast<std::size_t>(i) % of_links.size()]), {}});
      r.links.push_back(std::move(l));
    }
    const RobotId arm = unwrap(t->add("arm", std::move(r)));
    model::World w;
    w.robots.push_back({"arm", arm, {}, {}});
    w.robots[0].placement.position = {0.1, -0.2, 0.3};
    w.robots[0].placement.angles = {0.3, -0.2, 1};
    for (std::size_t k = 0; k < 3 * kKinds.size(); ++k) {
      model::PlacedObject o;
      o.name = "object" + std::to_string(k);
      o.what = solid(*t, o.name, kKinds[k % kKinds.size()]);
      for (double& x : o.placement.position) x = random.uniform(-1.2, 1.2);
      for (double& x : o.placement.angles) x = random.uniform(-3, 3);
      w.objects.push_back(std::move(o));
    }
    const WorldId id = unwrap(t->add("cell", std::move(w)));
    EXPECT_TRUE(t->commit().ok());
    const auto snapshot = bench.document.now();
    return unwrap(CollisionModel::of_world({bench.registry, bench.derived, *snapshot}, id, none));
  }
  static std::vector<double> lower(const CollisionModel& m) {
    std::vector<double> out;
    for (const auto& j : m.robots()[0].model->joints) out.push_back(j.lower);
    return out;
  }
  static std::vector<double> upper(const CollisionModel& m) {
    std::vector<double> out;
    for (const auto& j : m.robots()[0].model->joints) out.push_back(j.upper);
    return out;
  }
  void compare(const CollisionModel& m, int configurations, int motions);
};

void SearchChecks::compare(const CollisionModel& m, int configurations, int motions) {
  SearchCheck quick(m, 0, lower(m), upper(m));
  const std::size_t n = m.coordinate_count();
  std::vector<double> q(n), rows(2 * n), at(n);
  int free = 0, blocked = 0;
  for (int i = 0; i < configurations; ++i) {
    collision::random_configuration(*m.robots()[0].model, random, q.data());
    for (const double clearance : {1e-4, 0.03}) {
      const bool is_free = unwrap(m.near(q, clearance, none)).empty();
      (is_free ? free : blocked)++;
      ASSERT_EQ(unwrap(quick.is_free(q, clearance, none)), is_free)
          << "sample " << i << ", clearance " << clearance;
    }
  }
  EXPECT_GT(std::min(free, blocked), 2);
  int certain = 0, touched = 0;
  for (int i = 0; i < motions; ++i) {
    const double clearance = i % 2 ? 1e-3 : 0.02;
    collision::random_configuration(*m.robots()[0].model, random, rows.data());
    collision::random_configuration(*m.robots()[0].model, random, &rows[n]);
    if (i % 3)  // a short motion
      for (std::size_t j = 0; j < n; ++j) rows[n + j] = rows[j] + 0.05 * (rows[n + j] - rows[j]);
    const auto contact = unwrap(m.check_path(rows, clearance, none));
    const MotionFound found = unwrap(quick.check_rows(rows, clearance, none));
    // Where it is said for certain it is so; what touches between samples only is not said free.
    EXPECT_FALSE(found == MotionFound::free && contact.has_value()) << "motion " << i;
    EXPECT_FALSE(found == MotionFound::blocked && !contact.has_value()) << "motion " << i;
    (found == MotionFound::free ? certain : touched)++;
    const std::span<const double> a(rows.data(), n), b(&rows[n], n);
    const bool seems = unwrap(quick.seems_free(a, b, clearance, 0.01, none));
    EXPECT_TRUE(seems || contact) << "motion " << i;
    for (const double* end : {rows.data(), rows.data() + n})
      EXPECT_TRUE(!seems || unwrap(m.near({end, n}, clearance, none)).empty()) << "motion " << i;
  }
  EXPECT_GT(std::min(certain, touched), 0);
}

TEST_F(SearchChecks, AgreeWithDistancesWhereSpheresMeetPlainShapes) {
  compare(*world({kKinds[2]}), 200, 60);
}
TEST_F(SearchChecks, AgreeWithDistancesForBoxesCylindersConesAndEllipsoids) {
  compare(*world({kKinds[0], kKinds[1], kKinds[3], kKinds[4]}), 40, 20);
}
TEST_F(SearchChecks, AgreeWithDistancesForHullsAndTriangles) {
  compare(*world({kKinds[5], kKinds[6]}), 20, 8);
}

// A ball of 0.1 m on an arm of 0.5 m that turns about z, beside a plate of 2 mm in the way: at 90
// degrees they touch, and samples 0.5 m apart have none between. Nothing but the proof sees it.
TEST_F(SearchChecks, ThinWallsBetweenSamplesAreNotPassed) {
  auto t = bench.document.begin("make");
  model::Robot r;
  model::Link l;
  l.name = "rod";
  l.row.a = 0.5;
  l.lower = 0;
  l.upper = 3.1;
  l.parts.push_back({solid(*t, "ball", {CsgKind::sphere, {0.02}}), {}});
  r.links.push_back(std::move(l));
  const RobotId arm = unwrap(t->add("arm", std::move(r)));
  model::World w;
  w.robots.push_back({"arm", arm, {}, {}});
  w.objects.push_back({"plate", solid(*t, "plate", {CsgKind::box, {0.002, 0.2, 0.2}}), {}});
  w.objects[0].placement.position = {0, 0.5, -0.1};
  const WorldId id = unwrap(t->add("cell", std::move(w)));
  ASSERT_TRUE(t->commit().ok());
  const auto snapshot = bench.document.now();
  const auto m =
      unwrap(CollisionModel::of_world({bench.registry, bench.derived, *snapshot}, id, none));
  SearchCheck quick(*m, 0, lower(*m), upper(*m));
  const std::vector<double> rows{0.1, 3.0};
  const std::span<const double> a(rows.data(), 1), b(&rows[1], 1);
  EXPECT_TRUE(unwrap(quick.seems_free(a, b, 1e-3, 2, none)));  // its ends only
  EXPECT_FALSE(unwrap(quick.seems_free(a, b, 1e-3, 0.01, none)));
  EXPECT_EQ(unwrap(quick.check_rows(rows, 1e-3, none)), MotionFound::blocked);
  // The ball's centre is on the circle of 0.5 m; it is 1 + 20 + 1 mm from the plate's middle where
  // its angle from 90 degrees is asin(0.022 / 0.5).
  const double there = std::acos(-1) / 2 - std::asin(0.022 / 0.5);
  EXPECT_EQ(unwrap(quick.check_rows(std::vector{0.1, there - 1e-6}, 1e-3, none)),
            MotionFound::free);
  EXPECT_EQ(unwrap(quick.check_rows(std::vector{0.1, there + 1e-6}, 1e-3, none)),
            MotionFound::blocked);
  EXPECT_GT(quick.counts().configurations, 0U);
  EXPECT_EQ(quick.counts().distances, 0U);
}

TEST_F(SearchChecks, CoversHoldWhatTheyCover) {
  for (const SpheresOf& kind : kKinds) {
    auto t = bench.document.begin("make");
    const std::string name = "k" + std::to_string(static_cast<int>(kind.kind));
    const SolidId id = solid(*t, name, kind);
    ASSERT_TRUE(t->commit().ok());
    const auto snapshot = bench.document.now();
    const auto shapes = unwrap(bench.derived.shapes(*snapshot, id, none));
    const collision::BodyCover cover = collision::cover_of(*shapes);
    const auto mesh = unwrap(bench.derived.mesh(*snapshot, id, none));
    double most = 0;
    for (const auto& s : cover.spheres) most = std::max(most, s.radius);
    EXPECT_LT(most, 0.2) << name;
    for (std::size_t v = 0; v + 2 < mesh->positions.size(); v += 3) {
      const Vec3 p{mesh->positions[v], mesh->positions[v + 1], mesh->positions[v + 2]};
      EXPECT_TRUE(std::any_of(
          cover.spheres.begin(), cover.spheres.end(),
          [&](const auto& s) {
            return spatial::distance(p, {s.centre[0], s.centre[1], s.centre[2]}) <= s.radius + 1e-6;
          }))
          << name << " at " << v;
    }
  }
}

}  // namespace
}  // namespace robomosp
