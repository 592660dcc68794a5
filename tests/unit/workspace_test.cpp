// SPDX-License-Identifier: Apache-2.0
// Workspaces against areas and volumes in closed form, reachability against the geometry of an arm
// with a spherical wrist, slices against the manipulability of a planar arm, and their pictures.
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>

#include "recording/plot/colour_map.h"
#include "recording/plot/heat_map.h"
#include "robotics/joint_sampler.h"
#include "robotics/joint_slice.h"
#include "robotics/workspace.h"
#include "scene/voxels.h"
#include "sim/workspace_maps.h"
#include "spatial/vec.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

robotics::Workspace workspace_of(const RobotModel& m, const robotics::WorkspaceOptions& o) {
  NoProgress none;
  return test::unwrap(
      robotics::workspace(m, std::vector<double>(m.coordinate_count(), 0.0), o, none));
}

/// Three slides along x, y, z of 0.8, 0.5 and 0.3 m.
RobotModel gantry() {
  RobotModel m;
  m.name = "gantry";
  const Pose x = conformance::turn_y(kHalfTurn / 2), z;
  conformance::add_joint(m, "x", -1, JointType::prismatic, x, {}).upper = 0.8;
  conformance::add_joint(m, "y", 0, JointType::prismatic,
                         conformance::multiply(conformance::turn_y(-kHalfTurn / 2),
                                               conformance::turn_x(-kHalfTurn / 2)),
                         {})
      .upper = 0.5;
  conformance::add_joint(m, "z", 1, JointType::prismatic, conformance::turn_x(kHalfTurn / 2), {})
      .upper = 0.3;
  for (JointModel& j : m.joints) j.lower = 0;
  m.tips = {{"tool", 2, {}}};
  m.number_coordinates();
  return m;
}

RobotModel turning_freely(RobotModel m) {
  for (JointModel& j : m.joints)
    if (j.type == JointType::revolute) j.lower = -kHalfTurn, j.upper = kHalfTurn;
  return m;
}

void expect_size(const robotics::Workspace& w, double exact, double share) {
  EXPECT_NEAR(w.all.size, exact, w.all.error);
  EXPECT_NEAR(w.all.size, exact, share * exact);
  EXPECT_LT(std::fabs(w.growth()), share);
  EXPECT_GT(w.all.voxels, w.all.surface);
}

TEST(Workspace, OfAPlanarArmIsTheAreaOfItsAnnulus) {
  const RobotModel m = turning_freely(conformance::planar_rods());
  robotics::WorkspaceOptions o;
  o.voxel = 0.02;
  const auto w = workspace_of(m, o);
  EXPECT_EQ(w.dimension, 2);
  EXPECT_EQ(w.grid.count[2], 1U);
  expect_size(w, kHalfTurn * (1.15 * 1.15 - 0.25 * 0.25), 0.01);
  EXPECT_NEAR(w.upper[0], 1.15, 1e-3);
  // Nothing is reached in the hole: a voxel's middle is nearer to it by half a diagonal at most.
  for (std::size_t v = 0; v < w.hits.size(); ++v)
    if (w.hits[v]) {
      EXPECT_GT(std::hypot(w.grid.centre(v)[0], w.grid.centre(v)[1]), 0.25 - 0.0142);
    }
}

TEST(Workspace, OfThreeSlidesIsTheirBoxWithItsCorners) {
  robotics::WorkspaceOptions o;
  o.voxel = 0.02;
  const auto w = workspace_of(gantry(), o);
  EXPECT_EQ(w.dimension, 3);
  expect_size(w, 0.8 * 0.5 * 0.3, 0.02);
  const Vec3 upper{0.8, 0.5, 0.3};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(w.lower[k], 0, 1e-12);
    EXPECT_NEAR(w.upper[k], upper[k], 1e-12);
  }
}

TEST(Workspace, OfAScaraIsAShellOfACylinder) {
  const RobotModel m = turning_freely(conformance::scara());
  robotics::WorkspaceOptions o;
  o.voxel = 0.021;
  o.samples = 400000;
  const auto w = workspace_of(m, o);
  expect_size(w, kHalfTurn * (0.6 * 0.6 - 0.05 * 0.05) * 0.21, 0.03);
  EXPECT_NEAR(w.upper[2] - w.lower[2], 0.21, 1e-12);
}

/// A turn about z without limits, one about y from straight down to straight up, and a slide of
/// 0.3..0.6 m away from the axes: the tip fills a shell of a ball.
RobotModel spherical_arm() {
  RobotModel m;
  m.name = "spherical arm";
  conformance::add_joint(m, "turn", -1, JointType::revolute, {}, {});
  JointModel& lift = conformance::add_joint(m, "lift", 0, JointType::revolute,
                                            conformance::turn_x(kHalfTurn / 2), {});
  lift.lower = -kHalfTurn / 2, lift.upper = kHalfTurn / 2;
  JointModel& slide = conformance::add_joint(m, "slide", 1, JointType::prismatic,
                                             conformance::turn_y(kHalfTurn / 2), {});
  slide.lower = 0.3, slide.upper = 0.6;
  m.joints[0].lower = -kHalfTurn, m.joints[0].upper = kHalfTurn;
  m.tips = {{"tool", 2, {}}};
  m.number_coordinates();
  return m;
}
constexpr double kShell = 4.0 / 3 * kHalfTurn * (0.6 * 0.6 * 0.6 - 0.3 * 0.3 * 0.3);

TEST(Workspace, OfASphericalArmIsAShellOfABallWithinItsErrorAtAnyVoxelSize) {
  std::map<double, double> error_of;
  for (const double voxel : {0.03, 0.04, 0.06})
    for (const std::uint64_t seed : {1U, 2U}) {
      robotics::WorkspaceOptions o;
      o.voxel = voxel;
      o.seed = seed;
      o.samples = 1000000;
      const auto w = workspace_of(spherical_arm(), o);
      EXPECT_EQ(w.dimension, 3);
      EXPECT_NEAR(w.all.size, kShell, w.all.error) << voxel;
      EXPECT_NEAR(w.all.size, kShell, 0.07 * kShell) << voxel;
      EXPECT_TRUE(w.is_settled()) << voxel << " " << w.growth();
      error_of[voxel] = w.all.error;
    }
  // The surface counts voxels over two dimensions, so that the error goes with the size.
  EXPECT_NEAR(error_of[0.06] / error_of[0.03], 2, 0.2);
  // The surface has a voxel for each column along the axis nearest to its normal n, the greatest of
  // |n_i| for an area of a voxel's face: on a sphere 0.83 in the mean (by sampling of directions).
  const auto directions = robotics::sphere_directions(10000);
  double mean = 0;
  for (const Vec3& n : directions)
    mean += std::max({std::fabs(n[0]), std::fabs(n[1]), std::fabs(n[2])}) / 10000;
  const double expected = 0.5 * 0.03 * mean * 4 * kHalfTurn * (0.6 * 0.6 + 0.3 * 0.3);
  EXPECT_NEAR(error_of[0.03], expected, 0.1 * expected);
}

/// One turn, between the limits if any, about an axis that leans by `lean` from the vertical; the
/// tip is 0.5 m from it.
RobotModel one_turn(double lower, double upper, double lean) {
  RobotModel m;
  m.name = "one turn";
  JointModel& j =
      conformance::add_joint(m, "turn", -1, JointType::revolute, conformance::turn_x(lean), {});
  j.lower = lower, j.upper = upper;
  m.tips = {{"tool", 0, conformance::shift(0.5, 0, 0)}};
  m.number_coordinates();
  return m;
}

TEST(Workspace, OfOneJointIsTheLengthOfItsCurve) {
  robotics::WorkspaceOptions o;
  o.samples = 20000;
  for (const double lean : {0.0, 0.4, kHalfTurn / 2}) {
    const auto arc = workspace_of(one_turn(-1, 0.5, lean), o);
    EXPECT_EQ(arc.dimension, 1) << lean;
    EXPECT_NEAR(arc.all.size, 0.5 * 1.5, arc.all.error) << lean;
    EXPECT_LT(arc.all.error, 2e-3 * arc.all.size) << lean;
    EXPECT_TRUE(arc.is_settled()) << lean;
    // Turned several times, it is one circle.
    const auto circle = workspace_of(one_turn(-20, 20, lean), o);
    EXPECT_EQ(circle.dimension, 1) << lean;
    EXPECT_NEAR(circle.all.size, 2 * kHalfTurn * 0.5, circle.all.error) << lean;
    EXPECT_LT(circle.all.error, 2e-3 * circle.all.size) << lean;
  }
}

TEST(Workspace, OfOneJointLeavesOutWhatItsFilterDoes) {
  robotics::WorkspaceOptions o;
  o.samples = 20000;
  o.filter = [](std::span<const double> q, std::span<std::uint8_t> keep) -> Result<void> {
    for (std::size_t i = 0; i < keep.size(); ++i)
      if (q[i] > -0.5 && q[i] < 0.25) keep[i] = 0;
    return {};
  };
  const auto w = workspace_of(one_turn(-1, 0.5, 0.4), o);
  EXPECT_NEAR(w.all.size, 0.5 * (1.5 - 0.75), w.all.error);
  EXPECT_LT(w.all.error, 5e-3);
}

TEST(Workspace, TellsByItsGrowthThatSamplesAreTooFew) {
  robotics::WorkspaceOptions o;
  o.voxel = 0.02;
  o.samples = 8000;
  const auto few = workspace_of(spherical_arm(), o);
  EXPECT_FALSE(few.is_settled());
  EXPECT_GT(few.growth(), 0.2);
  EXPECT_LT(few.all.size, 0.8 * kShell);
  EXPECT_GT(few.all.size, few.half.size);
}

TEST(Workspace, KeepsToItsRegionAndItsFilter) {
  robotics::WorkspaceOptions o;
  o.voxel = 0.025;
  o.region = {Vec3{0.1, 0.1, 0.1}, Vec3{0.5, 0.3, 0.2}};
  const auto inside = workspace_of(gantry(), o);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_GE(inside.lower[k], (*o.region)[0][k]);
    EXPECT_LE(inside.upper[k], (*o.region)[1][k]);
    EXPECT_NEAR(inside.upper[k] - inside.lower[k], (*o.region)[1][k] - (*o.region)[0][k], 0.01);
  }
  o.region.reset();
  o.voxel = 0.05;
  o.filter = [](std::span<const double> q, std::span<std::uint8_t> keep) -> Result<void> {
    for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = q[3 * i] < 0.4;
    return {};
  };
  const auto left = workspace_of(gantry(), o);
  EXPECT_LT(left.upper[0], 0.4);
  EXPECT_GT(left.upper[0], 0.39);
  EXPECT_NEAR(left.upper[1], 0.5, 1e-12);
  EXPECT_LT(left.counted, left.samples);
}

TEST(Workspace, DoesNotDependOnTheNumberOfThreads) {
  robotics::WorkspaceOptions o;
  o.samples = 30000;
  o.threads = 1;
  const auto one = workspace_of(conformance::puma560(), o);
  o.threads = 5;
  const auto five = workspace_of(conformance::puma560(), o);
  EXPECT_EQ(one.hits, five.hits);
  EXPECT_EQ(one.best, five.best);
  EXPECT_EQ(one.mean, five.mean);
  o.seed = 2;
  EXPECT_NE(one.hits, workspace_of(conformance::puma560(), o).hits);
}

TEST(Workspace, TellsWhatHasNoEnd) {
  NoProgress none;
  RobotModel m = gantry();
  m.joints[1].upper = std::numeric_limits<double>::infinity();
  const auto r = robotics::workspace(m, std::vector<double>(3), {}, none);
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().sentence().find("the prismatic joint \"y\" has no limits"),
            std::string::npos);
  robotics::WorkspaceOptions o;
  o.voxel = 1e-5;
  EXPECT_EQ(robotics::workspace(gantry(), std::vector<double>(3), o, none).error().code,
            ErrorCode::invalid_argument);
}

TEST(Workspace, StopsWhenCancelled) {
  struct Stop final : Progress {
    void report(double, std::string_view) override {}
    [[nodiscard]] bool cancelled() const override { return true; }
  } stop;
  const auto r = robotics::workspace(gantry(), std::vector<double>(3), {}, stop);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
}

/// Counts what is reported, and stops after some of it.
struct Watch final : Progress {
  void report(double share, std::string_view) override {
    EXPECT_GE(share, last);
    EXPECT_LE(share, 1);
    last = share;
    ++reports;
  }
  [[nodiscard]] bool cancelled() const override { return reports >= stop_after; }
  double last = 0;
  int reports = 0, stop_after = 1 << 30;
};

TEST(Workspace, ReportsItsProgressAndStopsInTheMiddle) {
  robotics::WorkspaceOptions o;
  o.samples = 20000;
  std::size_t looked_at = 0;
  o.filter = [&](std::span<const double>, std::span<std::uint8_t> keep) -> Result<void> {
    looked_at += keep.size();
    return {};
  };
  Watch all;
  ASSERT_TRUE(robotics::workspace(gantry(), std::vector<double>(3), o, all).ok());
  EXPECT_GE(all.reports, 19);  // with a filter, which may take long, at every 1024
  EXPECT_GT(all.last, 0.9);
  EXPECT_EQ(looked_at, o.samples);
  looked_at = 0;
  Watch some;
  some.stop_after = 3;
  const auto r = robotics::workspace(gantry(), std::vector<double>(3), o, some);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
  EXPECT_LT(looked_at, 4000U);
}

TEST(JointSlice, ReportsItsProgressAndStopsInTheMiddle) {
  robotics::SliceOptions o;
  o.axes = {robotics::SliceAxis{0, -3, 3, 60}, robotics::SliceAxis{1, -3, 3, 60}};
  Watch all;
  ASSERT_TRUE(
      robotics::joint_slice(conformance::planar_rods(), std::vector<double>(2), o, all).ok());
  EXPECT_GT(all.last, 0.9);
  Watch some;
  some.stop_after = 2;
  const auto r = robotics::joint_slice(conformance::planar_rods(), std::vector<double>(2), o, some);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
}

/// Two slides along x and y of 1 m and 0.8 m carry a cube of 0.1 m; the base has a cube of 0.2 m in
/// their way, and the world a thin post.
class Slides : public testing::Test {
 protected:
  test::Workbench bench;
  NoProgress none;
  RobotId robot;
  WorldId world;

  void SetUp() override {
    auto t = bench.document.begin("slides");
    const auto box = [&](const char* name, double x, double y, double z) {
      model::Solid s;
      model::SolidNode n;
      n.name = "box";
      n.sizes = {x, y, z};
      n.placement.position = {0, 0, -0.5 * z};
      s.nodes = {n};
      return test::unwrap(t->add(name, std::move(s)));
    };
    const auto tool = box("tool", 0.1, 0.1, 0.1), block = box("block", 0.2, 0.2, 0.1),
               post = box("post", 0.1, 0.1, 1), crumb = box("crumb", 0.01, 0.01, 0.01);
    model::Robot r;
    for (const bool is_first : {true, false}) {
      model::Link l;
      l.name = is_first ? "carriage" : "arm";
      l.parent = is_first ? -1 : 0;
      l.joint = model::JointKind::prismatic;
      l.origin.emplace();
      l.axis = is_first ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
      l.lower = 0;
      l.upper = is_first ? 1 : 0.8;
      l.parts.push_back({is_first ? crumb : tool, {}});
      if (is_first) l.parts[0].placement.position = {0, 0, -5};  // far out of the way
      r.links.push_back(std::move(l));
    }
    r.base_parts.push_back({block, {}});
    r.base_parts[0].placement.position = {0.3, 0.3, 0};
    robot = test::unwrap(t->add("slides", std::move(r)));
    model::World w;
    w.robots.push_back({"left", robot, {}, {}});
    w.robots.back().placement.position = {2, 1, 0};
    model::PlacedObject o{"post", post, {}};
    o.placement.position = {2.75, 1.55, 0};
    w.objects.push_back(o);
    world = test::unwrap(t->add("cell", std::move(w)));
    ASSERT_TRUE(t->commit().ok());
  }

  sim::RobotContact contact(bool with_world) {
    const auto snapshot = bench.document.now();
    const sim::Simulator source{bench.registry, bench.derived, *snapshot};
    return {test::unwrap(with_world ? collision::CollisionModel::of_world(source, world, none)
                                    : collision::CollisionModel::of_robot(source, robot, none)),
            0};
  }
  std::shared_ptr<const RobotModel> model() {
    return test::unwrap(bench.derived.robot_model(*bench.document.now(), robot, {}, none));
  }
  robotics::Workspace reached(const sim::RobotContact& c) {
    robotics::WorkspaceOptions o;
    o.voxel = 0.017;  // its multiples are not the edges of the cubes
    o.samples = 40000;
    o.filter = sim::without_collisions(c, none);
    return test::unwrap(robotics::workspace(*model(), std::vector<double>(2), o, none));
  }
};

TEST_F(Slides, DoNotReachWhereTheyTouchThemselvesOrObstacles) {
  // The tool's middle stays out of the other cube made larger by half of its own.
  const auto is_out = [](const robotics::Workspace& w, double x, double y, double half) {
    const double within = half - 0.015;  // a voxel's middle is off by half a diagonal at most
    for (std::size_t v = 0; v < w.hits.size(); ++v) {
      const Vec3 p = w.grid.centre(v);
      if (w.hits[v] && std::fabs(p[0] - x) < within && std::fabs(p[1] - y) < within) return false;
    }
    return true;
  };
  const auto alone = reached(contact(false));
  EXPECT_NEAR(alone.all.size, 0.8 - 0.3 * 0.3, 0.015);
  EXPECT_TRUE(is_out(alone, 0.3, 0.3, 0.15));
  EXPECT_FALSE(is_out(alone, 0.75, 0.55, 0.1));
  const auto among = reached(contact(true));
  EXPECT_NEAR(alone.all.size - among.all.size, 0.2 * 0.2, 0.006);
  EXPECT_TRUE(is_out(among, 0.3, 0.3, 0.15));
  EXPECT_TRUE(is_out(among, 0.75, 0.55, 0.1));
  EXPECT_LT(among.counted, alone.counted);
  EXPECT_LT(alone.counted, alone.samples);
}

TEST_F(Slides, HaveSlicesThatMarkCollisions) {
  const auto c = contact(true);
  robotics::SliceOptions o;
  o.part = robotics::TwistPart::translation;
  o.axes = {robotics::SliceAxis{0, 0, 1, 41}, robotics::SliceAxis{1, 0, 0.8, 33}};
  o.filter = sim::without_collisions(c, none);
  const auto s = test::unwrap(robotics::joint_slice(*model(), std::vector<double>(2), o, none));
  const auto is_in = [](double x, double y, double cx, double cy, double half) {
    return std::fabs(x - cx) < half && std::fabs(y - cy) < half;
  };
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {
    const double x = o.axes[0].at(i % 41), y = o.axes[1].at(i / 41);
    if (is_in(x, y, 0.3, 0.3, 0.151) != is_in(x, y, 0.3, 0.3, 0.149)) continue;  // just touching
    if (is_in(x, y, 0.75, 0.55, 0.101) != is_in(x, y, 0.75, 0.55, 0.099)) continue;
    EXPECT_EQ(s.collides[i] != 0, is_in(x, y, 0.3, 0.3, 0.15) || is_in(x, y, 0.75, 0.55, 0.1))
        << x << " " << y;
  }
  const auto r = sim::slice_recording(*model(), o, s);
  const auto m = test::unwrap(recording::heat_map(r, {}));
  EXPECT_TRUE(m.has_collisions);
  EXPECT_EQ(m.cells + static_cast<std::size_t>(std::count(s.collides.begin(), s.collides.end(), 1)),
            s.nodes.size());
}

TEST_F(Slides, ChecksThatWereCancelledAreNoAnswer) {
  const auto c = contact(false);
  Watch stop;
  stop.stop_after = 0;
  const std::vector<double> q(20);
  std::vector<std::uint8_t> keep(10, 1);
  const auto r = sim::without_collisions(c, stop)(q, keep);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
}

TEST(Workspace, MapsTheManipulabilityOfAPlanarArm) {
  robotics::WorkspaceOptions o;
  o.voxel = 0.02;
  o.part = robotics::TwistPart::translation;
  const auto w = workspace_of(turning_freely(conformance::planar_rods()), o);
  // l1 l2 |sin q2|, where r^2 = l1^2 + l2^2 + 2 l1 l2 cos q2.
  const double l1 = 0.7, l2 = 0.45;
  std::size_t compared = 0;
  for (std::size_t v = 0; v < w.hits.size(); ++v) {
    const double r = std::hypot(w.grid.centre(v)[0], w.grid.centre(v)[1]);
    if (!w.hits[v] || r < 0.5 || r > 0.95) continue;
    const double c = (r * r - l1 * l1 - l2 * l2) / (2 * l1 * l2);
    EXPECT_NEAR(w.mean[v], l1 * l2 * std::sqrt(1 - c * c), 0.02);
    EXPECT_GE(w.best[v], w.mean[v]);
    ++compared;
  }
  EXPECT_GT(compared, 1000U);
}

TEST(JointSampler, KeepsCoupledJointsWithinTheirLimits) {
  RobotModel m = gantry();
  m.joints[2].coupling = {0, -0.5, 0.3};  // z = 0.3 - 0.5 x in 0..0.3, so that x is in 0..0.6
  m.number_coordinates();
  const auto range = robotics::joint_range(m, 0);
  EXPECT_NEAR(range.lower, 0, 1e-15);
  EXPECT_NEAR(range.upper, 0.6, 1e-15);
}

TEST(SphereDirections, AreUnitVectorsSpreadEvenly) {
  const auto d = robotics::sphere_directions(200);
  Vec3 sum{};
  for (const Vec3& v : d) {
    EXPECT_NEAR(std::hypot(v[0], v[1], v[2]), 1, 1e-12);
    double nearest = 4;
    for (const Vec3& u : d)
      if (&u != &v) nearest = std::min(nearest, std::hypot(u[0] - v[0], u[1] - v[1], u[2] - v[2]));
    // A hexagonal packing of 200 points has a distance of sqrt(8 pi / (200 sqrt 3)) = 0.27.
    EXPECT_GT(nearest, 0.2);
    EXPECT_LT(nearest, 0.3);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += v[k] / 200;
  }
  EXPECT_LT(std::hypot(sum[0], sum[1], sum[2]), 0.01);
}

TEST(JointSlice, OfAPlanarArmHasItsManipulabilityAndItsSingularCurves) {
  const RobotModel m = conformance::planar_rods();
  NoProgress none;
  robotics::SliceOptions o;
  o.part = robotics::TwistPart::translation;
  // q2 = 0 lies between two nodes.
  o.axes = {robotics::SliceAxis{0, -3, 3, 13}, robotics::SliceAxis{1, -3, 3, 40}};
  const auto s = test::unwrap(robotics::joint_slice(m, std::vector<double>(2), o, none));
  EXPECT_EQ(s.rank, 2);
  std::set<std::size_t> marked;
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {
    const double q2 = o.axes[1].at(i / 13);
    EXPECT_NEAR(s.nodes[i].manipulability, 0.7 * 0.45 * std::fabs(std::sin(q2)), 1e-12);
    // Singular values of a 2x2 matrix from its determinant and the sum of squares of its elements.
    const double f = 0.49 + 2 * 0.45 * 0.45 + 2 * 0.7 * 0.45 * std::cos(q2);
    const double det = 0.7 * 0.45 * std::sin(q2);
    const double root = std::sqrt(f * f - 4 * det * det);
    EXPECT_NEAR(s.nodes[i].least, std::sqrt(0.5 * (f - root)), 1e-9);
    if (s.singular[i]) marked.insert(i / 13);
  }
  ASSERT_GE(s.curve.size(), 13U);
  for (const auto& x : s.curve) EXPECT_NEAR(x[1], 0, 1e-5);
  for (const std::size_t row : marked) EXPECT_LT(std::fabs(o.axes[1].at(row)), 6.0 / 39);
}

TEST(JointSlice, SeesTheWristSingularityOfAPuma) {
  const RobotModel m = turning_freely(conformance::puma560());
  NoProgress none;
  robotics::SliceOptions o;
  o.part = robotics::TwistPart::rotation;
  o.axes = {robotics::SliceAxis{3, -2, 2, 9}, robotics::SliceAxis{4, -2, 2, 10}};
  const auto s =
      test::unwrap(robotics::joint_slice(m, std::vector{0.1, 0.4, -0.3, 0.0, 0.0, 0.2}, o, none));
  // Three rotations of the arm and three of the wrist: turning is never lost.
  EXPECT_EQ(s.rank, 3);
  EXPECT_TRUE(s.curve.empty());
  o.part = robotics::TwistPart::all;
  const auto all =
      test::unwrap(robotics::joint_slice(m, std::vector{0.1, 0.4, -0.3, 0.0, 0.0, 0.2}, o, none));
  EXPECT_EQ(all.rank, 6);
  ASSERT_GE(all.curve.size(), 9U);
  for (const auto& x : all.curve) EXPECT_NEAR(x[1], 0, 1e-4);  // joints 4 and 6 on one line
}

class Reachability : public testing::Test {
 protected:
  test::Workbench bench;
  NoProgress none;

  std::vector<double> shares(RobotModel m, std::span<const Vec3> points, const sim::ReachOptions& o,
                             const char* provider) {
    const auto model = std::make_shared<const RobotModel>(std::move(m));
    model::ProviderChoice choice;
    choice.name = provider;
    const auto ik = test::unwrap(sim::bind_ik(bench.registry, model, choice));
    return test::unwrap(sim::reachability(bench.registry, ik, points, o, none));
  }
};

// The wrist's middle stands at p - t d for a tool of length t along the direction d. With free
// joints it can be where the triangle of upper arm and forearm closes, beside the shoulder offset.
bool is_wrist_in_reach(const Vec3& w) {
  const double upper = 0.4318, fore = std::hypot(0.4318, 0.0203), offset = 0.15005;
  const double around = w[0] * w[0] + w[1] * w[1] - offset * offset;
  if (around < 0) return false;
  const double s = std::sqrt(around + w[2] * w[2]);
  return s > fore - upper && s < fore + upper;
}

TEST_F(Reachability, OfASphericalWristIsTheShareOfItsGeometry) {
  RobotModel m = turning_freely(conformance::puma560());
  const double tool = 0.25;
  m.tips[0].tool = conformance::multiply(m.tips[0].tool, conformance::shift(0, 0, tool));
  std::vector<Vec3> points{{0.45, 0.1, 0.1}, {0.4, -0.3, 0.05}};  // dexterous
  for (int i = 0; i < 12; ++i) points.push_back({0.05 + 0.1 * i, 0.02 * i, 0.3 - 0.05 * i});
  sim::ReachOptions o;
  o.directions = 60;
  o.rolls = 1;
  const auto got = shares(m, points, o, "spherical_wrist");
  const auto directions = robotics::sphere_directions(60);
  bool is_partial = false, is_none = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double expected = 0;
    for (const Vec3& d : directions)
      expected += is_wrist_in_reach({points[i][0] - tool * d[0], points[i][1] - tool * d[1],
                                     points[i][2] - tool * d[2]}) /
                  60.0;
    EXPECT_NEAR(got[i], expected, 1e-12) << i;
    is_partial = is_partial || (expected > 0.1 && expected < 0.9);
    is_none = is_none || expected == 0;
  }
  EXPECT_EQ(got[0], 1);
  EXPECT_EQ(got[1], 1);
  EXPECT_TRUE(is_partial);
  EXPECT_TRUE(is_none);
  o.threads = 3;
  EXPECT_EQ(shares(m, points, o, "spherical_wrist"), got);
}

TEST_F(Reachability, WithAFreeTurnAndWithNarrowLimits) {
  RobotModel m = turning_freely(conformance::puma560());
  const std::vector<Vec3> points{{0.5, 0.1, 0.2}};
  sim::ReachOptions o;
  o.directions = 16;
  o.rolls = 0;
  EXPECT_EQ(shares(m, points, o, "numeric")[0], 1);
  // A last joint that hardly turns: of one roll some directions are lost, of many fewer.
  m.joints[5].lower = -0.3, m.joints[5].upper = 0.3;
  o.rolls = 1;
  const double one = shares(m, points, o, "spherical_wrist")[0];
  o.rolls = 24;
  const double many = shares(m, points, o, "spherical_wrist")[0];
  EXPECT_LT(one, 1);
  EXPECT_GT(many, one);
}

TEST(WorkspaceRecordings, HoldVoxelsAndNodes) {
  robotics::WorkspaceOptions o;
  o.samples = 5000;
  const auto w = workspace_of(gantry(), o);
  const auto r = sim::workspace_recording(gantry(), w);
  EXPECT_EQ(r.rows(), w.all.voxels);
  double samples = 0;
  for (const double s : r.find("samples")->values) samples += s;
  EXPECT_EQ(samples, 5000);
  EXPECT_EQ(r.find("x")->unit, "m");
}

/// Oklab of an sRGB colour, by the inverse of what colour_map uses (Ottosson, 2020).
Vec3 oklab(const Colour& c) {
  const auto linear = [](float x) {
    const double v = static_cast<double>(x);
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  const double r = linear(c.r), g = linear(c.g), b = linear(c.b);
  const double l = std::cbrt(0.4122214708 * r + 0.5363325363 * g + 0.0514459929 * b);
  const double m = std::cbrt(0.2119034982 * r + 0.6806995451 * g + 0.1073969566 * b);
  const double s = std::cbrt(0.0883024619 * r + 0.2817188376 * g + 0.6299787005 * b);
  return {0.2104542553 * l + 0.7936177850 * m - 0.0040720468 * s,
          1.9779984951 * l - 2.4285922050 * m + 0.4505937099 * s,
          0.0259040371 * l + 0.7827717662 * m - 0.8086757660 * s};
}

TEST(ColourMap, HasEvenStepsToTheEyeAndGetsLighter) {
  const auto colours = recording::colour_map(65);
  std::vector<double> steps;
  for (std::size_t i = 1; i < colours.size(); ++i) {
    const Vec3 a = oklab(colours[i - 1]), b = oklab(colours[i]);
    EXPECT_GT(b[0], a[0]);
    steps.push_back(spatial::norm(spatial::sub(b, a)));
  }
  const auto [least, most] = std::minmax_element(steps.begin(), steps.end());
  EXPECT_LT(*most / *least, 1.02);  // colours outside of sRGB would be cut and uneven
  EXPECT_EQ(recording::hex_of({1, 0, 0.5F, 1}), "#ff0080");
}

TEST(Axes, HaveRoundMarksWithinTheirRange) {
  EXPECT_EQ(recording::ticks_within(0, 1, 5), (std::vector<double>{0, 0.2, 0.4, 3 * 0.2, 0.8, 1}));
  EXPECT_EQ(recording::ticks_within(0.13, 0.41, 2), (std::vector<double>{0.2, 0.4}));
  const auto r = recording::value_range(std::vector<double>{0.1, NAN, 3.0, INFINITY});
  EXPECT_EQ(r.low, 0);
  EXPECT_EQ(r.high, 3);
}

/// Three by two by two voxels of 0.1 m with a corner left out; the value is 0, 1, 2 ...
recording::Recording few_voxels() {
  recording::Recording r;
  r.title = "few";
  r.voxel = 0.1;
  for (const char* name : {"x", "y", "z", "manipulability"})
    r.columns.push_back({name, "m", "", {}});
  r.columns[3].unit = "";
  for (int i = 0; i < 11; ++i) {
    r.columns[0].values.push_back(0.05 + 0.1 * (i % 3));
    r.columns[1].values.push_back(-0.05 + 0.1 * (i / 3 % 2));
    r.columns[2].values.push_back(0.15 + 0.1 * (i / 6));
    r.columns[3].values.push_back(i);
  }
  return r;
}

TEST(Voxels, ShowTheirOuterFacesInTheirColours) {
  render::Scene scene;
  Pose at;
  at.p = {1, 2, 3};
  ASSERT_TRUE(scene::add_voxels(scene, few_voxels(), at, {}).ok());
  std::size_t faces = 0;
  double area = 0, flux = 0;
  std::set<std::uint64_t> ids;
  for (const auto& item : scene.items) {
    EXPECT_EQ(item.pose.p, at.p);
    ids.insert(item.id);
    const Mesh& m = *item.mesh;
    faces += m.triangle_count() / 2;
    for (std::size_t t = 0; t < m.triangles.size(); t += 3) {
      std::array<Vec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t c = 0; c < 3; ++c)
          p[k][c] = static_cast<double>(m.positions[3 * m.triangles[t + k] + c]);
      const Vec3 n = spatial::cross(spatial::sub(p[1], p[0]), spatial::sub(p[2], p[0]));
      area += 0.5 * spatial::norm(n);
      flux += spatial::dot(p[0], n) / 6;
      double along = 0;
      for (std::size_t c = 0; c < 3; ++c)
        along += n[c] * static_cast<double>(m.normals[3 * m.triangles[t] + c]);
      EXPECT_GT(along, 0);
    }
  }
  // A corner less leaves the surface of the block as it is: 2 (6 + 6 + 4) faces.
  EXPECT_EQ(faces, 32U);
  EXPECT_NEAR(area, 0.32, 1e-6);
  EXPECT_NEAR(flux, 0.011, 1e-7);  // closed and turned outwards: the volume (Gauss)
  EXPECT_EQ(ids.size(), scene.items.size());
  ASSERT_EQ(scene.legends.size(), 1U);
  EXPECT_EQ(scene.legends[0].title, "manipulability");
  EXPECT_EQ(scene.legends[0].colours.size(), 20U);
  EXPECT_EQ(scene.legends[0].ticks.front().text, "0");
  EXPECT_EQ(scene.legends[0].ticks.back().text, "10");
  // 10 is the highest value and in the highest colour.
  EXPECT_EQ(scene.items.back().appearance.colour.g, recording::colour_map(20).back().g);
}

TEST(Voxels, AreCutOpenAndSeenThrough) {
  render::Scene scene;
  scene::VoxelView view;
  view.cut = scene::VoxelView::Cut{{0.1, 0, 0}, {2, 0, 0}};  // leaves the four at x = 0.05
  view.opacity = 0.3;
  view.bands = 4;
  ASSERT_TRUE(scene::add_voxels(scene, few_voxels(), {}, view).ok());
  std::size_t faces = 0;
  for (const auto& item : scene.items) {
    faces += item.mesh->triangle_count() / 2;
    EXPECT_EQ(item.appearance.colour.a, 0.3F);
  }
  EXPECT_EQ(faces, 16U);  // of a block of 1 x 2 x 2
  view.above = 6;         // leaves two, 6 and 9
  render::Scene high;
  ASSERT_TRUE(scene::add_voxels(high, few_voxels(), {}, view).ok());
  faces = 0;
  for (const auto& item : high.items) faces += item.mesh->triangle_count() / 2;
  EXPECT_EQ(faces, 10U);
  EXPECT_EQ(high.legends[0].ticks.back().text, "10");  // the colours stay those of all
  view.above.reset();
  view.cut->point = {-1, 0, 0};
  EXPECT_FALSE(scene::add_voxels(scene, few_voxels(), {}, view).ok());
  view = {};
  view.column = "shine";
  EXPECT_EQ(scene::add_voxels(scene, few_voxels(), {}, view).error().code, ErrorCode::unknown_name);
  EXPECT_FALSE(scene::add_voxels(scene, {}, {}, {}).ok());
}

TEST(HeatMaps, AreSectionsThroughVoxels) {
  const auto r = few_voxels();
  recording::HeatMapRequest o;
  o.at = -0.04;
  const auto m = test::unwrap(recording::heat_map(r, o));
  EXPECT_EQ(m.x.count, 3U);
  EXPECT_EQ(m.y.count, 2U);
  EXPECT_NEAR(*m.at, -0.05, 1e-12);
  EXPECT_EQ(m.values, (std::vector<double>{0, 1, 2, 6, 7, 8}));
  EXPECT_EQ(m.x.label, "x [m]");
  EXPECT_NEAR(m.x.low(), 0, 1e-12);
  EXPECT_NEAR(m.y.high(), 0.3, 1e-12);
  EXPECT_TRUE(m.is_metric);
  o.at = 0.05;
  EXPECT_EQ(test::unwrap(recording::heat_map(r, o)).cells, 5U);
  o.x = "y", o.y = "x", o.at = 9;
  EXPECT_NEAR(*test::unwrap(recording::heat_map(r, o)).at, 0.25, 1e-12);
  o.x = "shine";
  EXPECT_EQ(recording::heat_map(r, o).error().code, ErrorCode::unknown_name);
  o.x = "x", o.y = "manipulability";
  EXPECT_FALSE(recording::heat_map(r, o).ok());
}

TEST(HeatMaps, HaveAxesAColourBarAndMarks) {
  NoProgress none;
  robotics::SliceOptions o;
  o.part = robotics::TwistPart::translation;
  o.axes = {robotics::SliceAxis{0, -3, 3, 13}, robotics::SliceAxis{1, -3, 3, 40}};
  const RobotModel arm = conformance::planar_rods();
  const auto s = test::unwrap(robotics::joint_slice(arm, std::vector<double>(2), o, none));
  const auto r = sim::slice_recording(arm, o, s);
  recording::HeatMapRequest want;
  want.column = "condition";
  want.is_log = true;
  want.high = 100;
  want.curve = s.curve;
  const auto m = test::unwrap(recording::heat_map(r, want));
  EXPECT_FALSE(m.is_metric);
  EXPECT_EQ(m.values.size(), 520U);
  const std::string svg = recording::to_svg(m);
  for (const char* part : {">q1 [rad]<", ">q2 [rad]<", ">condition<", ">100<", ">10<", ">singular<",
                           ">planar2rods: joint slice<"})
    EXPECT_NE(svg.find(part), std::string::npos) << part;
  std::size_t marks = 0;
  for (auto at = svg.find("<circle"); at != std::string::npos; at = svg.find("<circle", at + 1))
    ++marks;
  EXPECT_EQ(marks, s.curve.size() + 1);
  want.low = -1;
  EXPECT_FALSE(recording::heat_map(r, want).ok());
}

}  // namespace
}  // namespace robomosp
