// SPDX-License-Identifier: Apache-2.0
// Mechanisms beyond rows of revolute and prismatic joints: from the record to the model, and loops.
// Expected poses are products of elementary matrices written out here; loops are checked against
// closed forms and numerical derivatives.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>

#include "model/placement.h"
#include "robotics/build_model.h"
#include "robotics/closure.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"

namespace robomosp::robotics {
namespace {

using conformance::kDeg;
using conformance::kPi;
using conformance::shift;
using conformance::turn_x;
using conformance::turn_y;
using conformance::turn_z;
using model::JointKind;
using spatial::compose;

constexpr Vec3 kDownwards{0, 0, -9.81};

template <class... P>
Pose product(const Pose& first, const P&... rest) {
  Pose t = first;
  ((t = compose(t, rest)), ...);
  return t;
}

/// One link of the kind with this row, standard convention.
model::Robot single(JointKind kind, model::DhRow row = {0.3, 0.4, 0.2, 0.1}) {
  model::Robot r;
  model::Link l;
  l.name = "only";
  l.joint = kind;
  l.row = row;
  r.links.push_back(l);
  return r;
}

RobotModel built_mechanism(const model::Robot& r) {
  auto m = build_robot_model("test", r, {}, kDownwards);
  EXPECT_TRUE(m.ok()) << (m.ok() ? "" : m.error().sentence());
  return m.ok() ? std::move(m).value() : RobotModel{};
}
std::string fault(const model::Robot& r) {
  const auto m = build_robot_model("test", r, {}, kDownwards);
  EXPECT_FALSE(m.ok());
  return m.ok() ? "" : m.error().sentence();
}

/// base_T_link of the last link.
Pose last_link(const model::Robot& r, const std::vector<double>& q) {
  const RobotModel m = built_mechanism(r);
  EXPECT_EQ(m.coordinate_count(), q.size());
  std::vector<Pose> frames(m.joints.size()), poses(r.links.size());
  forward_kinematics(m, q, frames);
  link_poses(link_frames(r), frames, poses);
  return poses.back();
}

void expect_same(const Pose& a, const Pose& b, double tolerance = 1e-14) {
  EXPECT_LT(conformance::position_gap(a, b), tolerance);
  EXPECT_LT(conformance::rotation_gap(a, b), tolerance);
}

// A standard row is Rz(theta) Tz(d) [joint] Tx(a) Rx(alpha).
const Pose kBefore = product(turn_z(0.1), shift(0, 0, 0.2)),
           kAfter = product(shift(0.3, 0, 0), turn_x(0.4));

TEST(Mechanisms, AUniversalJointTurnsAboutZAndThenTheNewX) {
  expect_same(last_link(single(JointKind::universal), {0.7, -0.4}),
              product(kBefore, turn_z(0.7), turn_x(-0.4), kAfter));
}
TEST(Mechanisms, ACylindricalJointSlidesAlongZAndTurnsAboutIt) {
  expect_same(last_link(single(JointKind::cylindrical), {0.25, -1.4}),
              product(kBefore, shift(0, 0, 0.25), turn_z(-1.4), kAfter));
}
TEST(Mechanisms, APlanarJointSlidesAlongXAndYAndTurnsAboutZ) {
  expect_same(last_link(single(JointKind::planar), {0.25, -0.5, 0.6}),
              product(kBefore, shift(0.25, -0.5, 0), turn_z(0.6), kAfter));
}
TEST(Mechanisms, ABallJointTurnsByItsQuaternion) {
  const double s = std::sin(0.35), c = std::cos(0.35);
  expect_same(last_link(single(JointKind::spherical), {c, s, 0, 0}),
              product(kBefore, turn_x(0.7), kAfter));
}
TEST(Mechanisms, AFreeJointHasPositionAndQuaternion) {
  const double s = std::sin(-0.2), c = std::cos(-0.2);
  expect_same(last_link(single(JointKind::free), {1, 2, 3, c, 0, s, 0}),
              product(kBefore, shift(1, 2, 3), turn_y(-0.4), kAfter));
}

TEST(Mechanisms, SequencesAreOfJointsWithOneCoordinateAndNoBodiesBetween) {
  model::Robot r = single(JointKind::planar);
  r.links[0].given = MassProperties{2, {0.1, 0, 0}, {1, 1, 1, 0, 0, 0}};
  const RobotModel m = built_mechanism(r);
  ASSERT_EQ(m.joints.size(), 3U);
  EXPECT_EQ(m.joints[0].body.mass, 0);
  EXPECT_EQ(m.joints[1].body.mass, 0);
  EXPECT_EQ(m.joints[2].body.mass, 2);
  EXPECT_EQ(m.joints[0].name, "only along x");
  EXPECT_EQ(m.joints[2].type, JointType::revolute);
  EXPECT_EQ(moving_links(r), (std::vector<std::int32_t>{0, 0, 0}));
  EXPECT_EQ(coordinate_units(r), (std::vector<std::string_view>{"m", "m", "rad"}));
}

TEST(Mechanisms, AnOriginStandsInsteadOfARowAndItsAxisInTheLinksFrame) {
  model::Robot r = single(JointKind::revolute, {9, 9, 9, 9});
  r.links[0].origin = model::Placement{{0.1, 0.2, 0.3}, {0, 0, kPi / 2}};
  const Pose at = product(shift(0.1, 0.2, 0.3), turn_z(kPi / 2));
  r.links[0].axis = {0, 1, 0};
  expect_same(last_link(r, {0.6}), product(at, turn_y(0.6)));
  r.links[0].axis = {0, 0, -2};
  expect_same(last_link(r, {0.6}), product(at, turn_z(-0.6)));
  r.links[0].axis = {1, 2, -2};
  Pose about;
  about.R = spatial::from_axis_angle({1, 2, -2}, 0.6);
  expect_same(last_link(r, {0.6}), product(at, about));
  r.links[0].axis = {0, 0, 0};
  EXPECT_EQ(
      fault(r),
      "robot \"test\", link 1 \"only\": its joint's axis has no direction. Give a vector such "
      "as (0, 0, 1).");
}

TEST(Mechanisms, EveryLinkMayHaveItsOwnConvention) {
  model::Robot r = single(JointKind::revolute);
  r.links.push_back(r.links[0]);
  r.links[1].parent = 0;
  r.links[1].convention = model::Convention::mdh;
  const Pose first = product(turn_z(0.1 + 0.5), shift(0, 0, 0.2), kAfter);
  expect_same(last_link(r, {0.5, -0.8}),
              product(first, turn_x(0.4), shift(0.3, 0, 0), turn_z(0.1 - 0.8), shift(0, 0, 0.2)));
}

TEST(Mechanisms, AJointThatFollowsAFollowerFollowsTheFirst) {
  model::Robot r = single(JointKind::revolute);
  for (int i = 1; i < 3; ++i) {
    r.links.push_back(r.links[0]);
    r.links.back().parent = i - 1;
    r.links.back().mimic = model::Mimic{i - 1, 2.0, 0.25};
  }
  const RobotModel m = built_mechanism(r);
  EXPECT_EQ(m.coordinate_count(), 1U);
  EXPECT_EQ(m.joints[2].coupling.of, 0);
  EXPECT_DOUBLE_EQ(m.joints[2].coupling.ratio, 4);
  EXPECT_DOUBLE_EQ(m.joints[2].coupling.offset, 2 * 0.25 + 0.25);
  const double q = 0.1;
  const auto at = [](double angle) {
    return product(turn_z(0.1 + angle), shift(0, 0, 0.2), kAfter);
  };
  expect_same(last_link(r, {q}), product(at(q), at(2 * q + 0.25), at(4 * q + 0.75)));
  r.links[1].mimic->link = 1;
  EXPECT_NE(fault(r).find("which does not come before it"), std::string::npos);
  r.links[1].mimic->link = 0;
  r.links[0].joint = JointKind::planar;
  EXPECT_NE(fault(r).find("follows that of link 1 \"only\", which is neither"), std::string::npos);
}

TEST(Mechanisms, PayloadsAddToTheBodyThatCarriesThemAndToolsAreTips) {
  model::Robot r = single(JointKind::revolute, {});
  r.links[0].given = MassProperties{2, {0, 0, 0}, {1, 2, 3, 0, 0, 0}};
  r.tool.position = {0, 0, 0.5};
  r.payload = MassProperties{1, {0, 0, 0.1}, {0, 0, 0, 0, 0, 0}};
  r.tools.push_back({"camera", 0, {{0.2, 0, 0}, {}}, MassProperties{1, {}, {}}});
  r.tools.push_back({"mark", -1, {{0, 3, 0}, {}}, std::nullopt});
  const RobotModel m = built_mechanism(r);
  EXPECT_EQ(m.joints[0].body.mass, 4);
  EXPECT_NEAR(m.joints[0].body.com[2], 0.6 / 4, 1e-15);
  EXPECT_NEAR(m.joints[0].body.com[0], 0.2 / 4, 1e-15);
  ASSERT_EQ(m.tips.size(), 3U);
  EXPECT_EQ(m.tips[1].name, "camera");
  EXPECT_EQ(m.tips[2].joint, -1);
  r.tools[0].link = 4;
  EXPECT_EQ(fault(r),
            "robot \"test\", tool \"camera\": it is attached to link 5, which does not exist. Name "
            "a link of "
            "the robot, or the base.");
}

TEST(Mechanisms, SpringsPassiveJointsAndJerkReachTheModel) {
  model::Robot r = single(JointKind::prismatic);
  r.links[0].spring = {120, 0.3};
  r.links[0].passive = true;
  r.links[0].max_jerk = 40;
  const RobotModel m = built_mechanism(r);
  EXPECT_EQ(m.joints[0].spring.stiffness, 120);
  EXPECT_EQ(m.joints[0].spring.rest, 0.3);
  EXPECT_TRUE(m.joints[0].passive);
  EXPECT_EQ(m.joints[0].max_jerk, 40);
  r.links[0].spring.stiffness = -1;
  EXPECT_NE(fault(r).find("spring's stiffness is -1"), std::string::npos);
  r.links[0].joint = JointKind::free;
  EXPECT_NE(fault(r).find("coordinates of several kinds"), std::string::npos);
}

TEST(Mechanisms, HomeIsNeutralWithUnitQuaternions) {
  model::Robot r = single(JointKind::free);
  r.links.push_back(single(JointKind::revolute).links[0]);
  r.links[1].parent = 0;
  EXPECT_EQ(home_joint_values(r), (std::vector<double>{0, 0, 0, 1, 0, 0, 0, 0}));
  EXPECT_EQ(neutral_coordinates(built_mechanism(r)), home_joint_values(r));
  r.poses.push_back({"home", {1, 2, 3, 0, 1, 0, 0, 0.5}});
  EXPECT_EQ(home_joint_values(r), r.poses[0].q);
}

TEST(Loops, FaultsNameTheLoop) {
  model::Robot r = single(JointKind::revolute);
  r.loops.push_back({"pin", model::LoopKind::revolute, 0, 0, {}, {}});
  EXPECT_EQ(fault(r),
            "robot \"test\", loop \"pin\": both of its links move together, so it has no effect. "
            "Name two links that move relative to each other.");
  r.loops[0].link_b = 7;
  EXPECT_NE(fault(r).find("loop \"pin\": it refers to link 8"), std::string::npos);
}

// The residual's derivative by central differences, for every kind of joint and an open loop that
// fixes all six directions.
TEST(Loops, TheJacobianIsTheDerivativeOfTheResidual) {
  RobotModel m = conformance::floating_manipulator();
  m.loops = {
      {"weld", 5, 6, compose(shift(0.1, 0.2, 0.3), turn_x(0.4)), shift(0.3, 0, 0.1), kLoopWeld},
      {"hinge", 4, -1, turn_y(0.5), compose(shift(0.2, 0.1, 0), turn_x(1.1)), kLoopRevolute}};
  std::vector<double> q = neutral_coordinates(m);
  std::vector<double> by(m.dof());
  for (std::size_t v = 0; v < by.size(); ++v)
    by[v] = 0.3 * std::sin(1.0 + 2.0 * static_cast<double>(v));
  move_configuration(m, by, q);
  const std::size_t rows = loop_rows(m);
  ASSERT_EQ(rows, 11U);
  std::vector<Pose> frames(m.joints.size());
  const auto residual = [&](std::span<const double> at) {
    std::vector<double> r(rows);
    forward_kinematics(m, at, frames);
    loop_residual(m, frames, r);
    return r;
  };
  residual(q);
  std::vector<double> jacobian(rows * m.dof());
  loop_jacobian(m, frames, jacobian);
  const double h = 1e-5;
  for (std::size_t v = 0; v < m.dof(); ++v) {
    std::vector<double> step(m.dof(), 0.0), plus = q, minus = q;
    step[v] = h;
    move_configuration(m, step, plus);
    step[v] = -h;
    move_configuration(m, step, minus);
    const auto up = residual(plus), down = residual(minus);
    for (std::size_t k = 0; k < rows; ++k)
      EXPECT_NEAR(jacobian[k * m.dof() + v], (up[k] - down[k]) / (2 * h), 1e-8)
          << "row " << k << ", velocity " << v;
  }
}

/// Rocker angle of a four-bar with ground g, crank a, coupler b, rocker c, by the triangle of the
/// crank's end, the rocker's foot and the rocker's end (law of cosines): the branch with the
/// coupler above the diagonal.
double rocker_angle(double g, double a, double b, double c, double crank) {
  const double x = a * std::cos(crank) - g, y = a * std::sin(crank);
  const double d = std::hypot(x, y);
  return std::atan2(y, x) - std::acos((c * c + d * d - b * b) / (2 * c * d));
}

TEST(Loops, AFourBarFollowsItsCrankAllTheWayRoundOnOneBranch) {
  const double g = 0.4, a = 0.1, b = 0.35, c = 0.25;
  const RobotModel m = conformance::four_bar(g, a, b, c);
  const auto held = actuated_velocities(m);
  EXPECT_EQ(held, (std::vector<bool>{true, false, false}));
  std::vector<double> q{0.3, 1.0, 1.8};
  for (int k = 0; k <= 12; ++k) {
    std::vector<double> target = q;
    target[0] = 0.3 + 2 * kPi * k / 12;
    const Closure closed = close_loops(m, q, target, held);
    ASSERT_TRUE(closed.is_closed) << closed.residual;
    q = closed.q;
    EXPECT_EQ(q[0], target[0]);
    EXPECT_NEAR(std::remainder(q[2] - rocker_angle(g, a, b, c, q[0]), 2 * kPi), 0, 1e-10);
  }
}

TEST(Loops, WhatCannotCloseSaysHowFarItIsOpen) {
  // Ground 1, crank 0.1, coupler 0.2, rocker 0.3: at best 0.4 apart.
  const RobotModel m = conformance::four_bar(1, 0.1, 0.2, 0.3);
  const std::vector<double> q{0, 0, kPi};
  const Closure c = close_loops(m, q, q, {true, false, false});
  EXPECT_FALSE(c.is_closed);
  EXPECT_NEAR(c.residual, 0.4, 1e-6);
  EXPECT_EQ(c.worst_loop, 0U);
}

TEST(Loops, ASingularStartIsLeft) {
  // Everything stretched along x: the coupler cannot begin to move to first order.
  const RobotModel m = conformance::four_bar(0.45, 0.2, 0.4, 0.25);
  const std::vector<double> q{0, 0, 0};
  const Closure c = close_loops(m, q, q, {true, false, false});
  ASSERT_TRUE(c.is_closed) << c.residual;
  const Closure again = close_loops(m, q, q, {true, false, false});
  EXPECT_EQ(c.q, again.q) << "closing is deterministic";
}

}  // namespace
}  // namespace robomosp::robotics
