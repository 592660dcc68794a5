// SPDX-License-Identifier: Apache-2.0
// Mechanisms beyond the simple tree for conformance suites: floating bases, ball joints, coupled
// joints, springs, closed loops, long chains (layer: contract helper for tests, header-only).
#pragma once

#include <robomosp/sdk/conformance/models.h>

namespace robomosp::conformance {

/// A joint added to a mechanism under construction.
inline JointModel& add_joint(RobotModel& m, std::string name, std::int32_t parent, JointType type,
                             const Pose& placement, const MassProperties& mass) {
  JointModel j;
  j.name = std::move(name);
  j.parent = parent;
  j.type = type;
  j.placement = placement;
  j.body = mass;
  m.joints.push_back(std::move(j));
  return m.joints.back();
}

/// A free body that carries an arm with a ball shoulder, a sprung elbow and a gripper of two
/// fingers of which one follows the other, and a second arm of one joint: 15 coordinates, 13
/// velocities.
[[nodiscard]] inline RobotModel floating_manipulator() {
  RobotModel m;
  m.name = "floating manipulator";
  add_joint(m, "body", -1, JointType::free, shift(0.1, -0.2, 0.3),
            body(20, 0.02, -0.01, 0.05, 0.9, 1.1, 0.7, 0.02, -0.01, 0.03));
  add_joint(m, "shoulder", 0, JointType::spherical, multiply(shift(0.3, 0.1, 0.2), turn_x(0.4)),
            body(4, 0, 0.02, 0.2, 0.06, 0.05, 0.02, 0.001, 0.002, -0.001));
  JointModel& elbow =
      add_joint(m, "elbow", 1, JointType::revolute, multiply(shift(0, 0, 0.4), turn_y(kPi / 2)),
                body(2.5, 0.15, 0.01, 0, 0.01, 0.03, 0.03));
  elbow.lower = -2.5, elbow.upper = 2.5;
  elbow.armature = 0.05;
  elbow.friction = {0.3, 0.2, -0.25};
  elbow.spring = {12, 0.3};
  JointModel& slide =
      add_joint(m, "slide", 2, JointType::prismatic, multiply(shift(0.3, 0, 0), turn_y(kPi / 2)),
                body(1.2, 0, 0.01, 0.05, 0.004, 0.004, 0.002));
  slide.lower = 0, slide.upper = 0.2;
  slide.friction = {2, 0, 0};
  JointModel& left = add_joint(m, "left finger", 3, JointType::prismatic,
                               multiply(shift(0, 0.02, 0.1), turn_x(-kPi / 2)),
                               body(0.1, 0, 0, 0.01, 1e-4, 1e-4, 5e-5));
  left.lower = 0, left.upper = 0.04;
  left.armature = 0.2;
  JointModel& right = add_joint(m, "right finger", 3, JointType::prismatic,
                                multiply(shift(0, -0.02, 0.1), turn_x(kPi / 2)),
                                body(0.1, 0, 0, 0.01, 1e-4, 1e-4, 5e-5));
  right.lower = 0, right.upper = 0.05;
  right.coupling = {4, 1.25, 0};
  JointModel& second =
      add_joint(m, "antenna", 0, JointType::revolute, multiply(shift(-0.2, 0, 0.2), turn_x(-0.7)),
                body(0.5, 0.2, 0, 0, 0.001, 0.01, 0.01));
  second.lower = -2, second.upper = 2;
  m.tips = {{"gripper", 3, shift(0, 0, 0.15)}, {"antenna", 6, shift(0.4, 0, 0)}};
  m.number_coordinates();
  return m;
}

/// A plane four-bar: ground, crank, coupler and rocker of these lengths [m] in the xy plane,
/// uniform slender rods of 1 kg/m, gravity along -y. Crank and rocker turn about the base's z at
/// (0, 0) and (ground, 0); the coupler's end meets the rocker's end.
[[nodiscard]] inline RobotModel four_bar(double ground, double crank, double coupler,
                                         double rocker) {
  const auto rod = [](double l) { return body(l, l / 2, 0, 0, 0, l * l * l / 12, l * l * l / 12); };
  RobotModel m;
  m.name = "four-bar";
  m.gravity = {0, -9.81, 0};
  add_joint(m, "crank", -1, JointType::revolute, Pose{}, rod(crank));
  add_joint(m, "coupler", 0, JointType::revolute, shift(crank, 0, 0), rod(coupler)).passive = true;
  add_joint(m, "rocker", -1, JointType::revolute, shift(ground, 0, 0), rod(rocker)).passive = true;
  m.loops = {{"pin", 1, 2, shift(coupler, 0, 0), shift(rocker, 0, 0), kLoopX | kLoopY}};
  m.tips = {{"coupler", 1, shift(coupler, 0, 0)}};
  m.number_coordinates();
  return m;
}

/// A serial chain of n revolute joints with bodies, axes turned against each other.
[[nodiscard]] inline RobotModel long_chain(int n) {
  std::vector<Row> rows;
  for (int i = 0; i < n; ++i)
    rows.push_back({0.1, 0.05, 0.1, i % 2 ? kPi / 2 : -0.7, -90, 90,
                    body(1, -0.05, 0.01, 0, 0.01, 0.02, 0.02)});
  return serial("chain of " + std::to_string(n), false, rows);
}

}  // namespace robomosp::conformance
