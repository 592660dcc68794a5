// SPDX-License-Identifier: Apache-2.0
// Arms for suites of closed-form inverse kinematics: published tables without masses, and made-up
// geometry that no special case fits (layer: contract helper for tests, header-only).
#pragma once

#include <robomosp/sdk/conformance/models.h>

namespace robomosp::conformance {

/// KUKA KR 5 arc (Robotics Toolbox mdl_KR5, with a tool of 115 mm): axis 3 against axis 2.
[[nodiscard]] inline RobotModel kr5() {
  const double r = kPi / 2;
  return serial("kr5", false,
                {{0, 0.4, 0.18, r, -155, 155, {}},
                 {0, 0.135, 0.6, kPi, -180, 65, {}},
                 {0, 0.135, 0.12, -r, -15, 158, {}},
                 {0, 0.62, 0, r, -350, 350, {}},
                 {0, 0, 0, -r, -130, 130, {}},
                 {0, 0, 0, 0, -350, 350, {}}},
                shift(0, 0, 0.115));
}
/// ABB IRB 140 (Robotics Toolbox mdl_irb140).
[[nodiscard]] inline RobotModel irb140() {
  const double r = kPi / 2;
  return serial("irb140", false,
                {{0, 0.352, 0.07, -r, -180, 180, {}},
                 {0, 0, 0.36, 0, -90, 110, {}},
                 {0, 0, 0, r, -230, 50, {}},
                 {0, 0.38, 0, -r, -200, 200, {}},
                 {0, 0, 0, r, -115, 115, {}},
                 {0, 0.065, 0, r, -400, 400, {}}});
}
/// Universal Robots UR5 (Robotics Toolbox mdl_ur5).
[[nodiscard]] inline RobotModel ur5() {
  const double r = kPi / 2;
  return serial("ur5", false,
                {{0, 0.089459, 0, r, -360, 360, {}},
                 {0, 0, -0.425, 0, -360, 360, {}},
                 {0, 0, -0.39225, 0, -360, 360, {}},
                 {0, 0.10915, 0, r, -360, 360, {}},
                 {0, 0.09465, 0, -r, -360, 360, {}},
                 {0, 0.0823, 0, 0, -360, 360, {}}});
}
/// KUKA LBR iiwa 14 R820: 360/420/400/126 mm, limits 170/120/170/120/170/120/175 degrees (KUKA, LBR
/// iiwa specification; iiwa_stack).
[[nodiscard]] inline RobotModel iiwa14() {
  const double r = kPi / 2;
  return serial("iiwa14", false,
                {{0, 0.36, 0, -r, -170, 170, {}},
                 {0, 0, 0, r, -120, 120, {}},
                 {0, 0.42, 0, r, -170, 170, {}},
                 {0, 0, 0, -r, -120, 120, {}},
                 {0, 0.4, 0, -r, -170, 170, {}},
                 {0, 0, 0, r, -120, 120, {}},
                 {0, 0.126, 0, 0, -175, 175, {}}});
}
/// Axes 1, 2 and 3 skew to each other, the wrist's axes meet at angles that are not right.
[[nodiscard]] inline RobotModel skew_arm() {
  return serial("skew arm", false,
                {{0.2, 0.3, 0.1, 1.1, -170, 170, {}},
                 {-0.3, 0.1, 0.4, -0.5, -170, 170, {}},
                 {0.4, 0.15, 0.05, 1.3, -170, 170, {}},
                 {0.1, 0.4, 0, 1.2, -170, 170, {}},
                 {0.5, 0, 0, -1.4, -170, 170, {}},
                 {0, 0.1, 0.02, 0.3, -170, 170, {}}},
                multiply(shift(0.03, -0.02, 0.05), turn_x(0.7)));
}
/// Axes 1 and 2 meet, axis 3 is skew to them.
[[nodiscard]] inline RobotModel meeting_arm() {
  const double r = kPi / 2;
  return serial("arm with meeting axes", false,
                {{0, 0.3, 0, r, -170, 170, {}},
                 {0, 0.1, 0.4, 0.6, -170, 170, {}},
                 {0, 0.05, 0.1, -r, -170, 170, {}},
                 {0, 0.35, 0, r, -170, 170, {}},
                 {0, 0, 0, -r, -170, 170, {}},
                 {0, 0.1, 0, 0, -170, 170, {}}});
}
/// Axes 1 and 2 are parallel, axis 3 is not.
[[nodiscard]] inline RobotModel parallel_first_arm() {
  const double r = kPi / 2;
  return serial("arm with axes 1 and 2 parallel", false,
                {{0, 0.3, 0.35, 0, -170, 170, {}},
                 {0, 0.1, 0.25, r, -170, 170, {}},
                 {0, 0.05, 0.1, r, -170, 170, {}},
                 {0, 0.3, 0, r, -170, 170, {}},
                 {0, 0, 0, -r, -170, 170, {}},
                 {0, 0.1, 0, 0, -170, 170, {}}});
}

/// The same arm with limits of one whole turn, so that limits hide no configuration.
[[nodiscard]] inline RobotModel within_one_turn(RobotModel m) {
  for (JointModel& j : m.joints)
    if (j.type == JointType::revolute) j.lower = -kPi, j.upper = kPi;
  m.name += " without limits";
  return m;
}

}  // namespace robomosp::conformance
