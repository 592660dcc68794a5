// SPDX-License-Identifier: Apache-2.0
// Workspaces against areas and volumes in closed form, reachability against the geometry of an arm
// with a spherical wrist, slices against the manipulability of a planar arm.
#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>

#include "robotics/joint_sampler.h"
#include "robotics/joint_slice.h"
#include "robotics/workspace.h"
#include "sim/workspace_maps.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

constexpr double kPi = std::numbers::pi;

robotics::Workspace workspace_of(const RobotModel& m, const robotics::WorkspaceOptions& o) {
  NoProgress none;
  return test::unwrap(
      robotics::workspace(m, std::vector<double>(m.coordinate_count(), 0.0), o, none));
}

/// Three slides along x, y, z of 0.8, 0.5 and 0.3 m.
RobotModel gantry() {
  RobotModel m;
  m.name = "gantry";
  const Pose x = conformance::turn_y(kPi / 2), z;
  conformance::add_joint(m, "x", -1, JointType::prismatic, x, {}).upper = 0.8;
  conformance::add_joint(
      m, "y", 0, JointType::prismatic,
      conformance::multiply(conformance::turn_y(-kPi / 2), conformance::turn_x(-kPi / 2)), {})
      .upper = 0.5;
  conformance::add_joint(m, "z", 1, JointType::prismatic, conformance::turn_x(kPi / 2), {}).upper =
      0.3;
  for (JointModel& j : m.joints) j.lower = 0;
  m.tips = {{"tool", 2, {}}};
  m.number_coordinates();
  return m;
}

RobotModel turning_freely(RobotModel m) {
  for (JointModel& j : m.joints)
    if (j.type == JointType::revolute) j.lower = -kPi, j.upper = kPi;
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
  expect_size(w, kPi * (1.15 * 1.15 - 0.25 * 0.25), 0.01);
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
  expect_size(w, kPi * (0.6 * 0.6 - 0.05 * 0.05) * 0.21, 0.03);
  EXPECT_NEAR(w.upper[2] - w.lower[2], 0.21, 1e-12);
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

}  // namespace
}  // namespace robomosp
