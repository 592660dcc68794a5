// SPDX-License-Identifier: Apache-2.0
// Provider "constrained": the SDK's suite of trees and of closed loops, and mechanisms whose
// equations are known in closed form.
#include <robomosp/sdk/conformance/dynamics_suite_loops.h>
#include <robomosp/sdk/conformance/mechanisms.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_articulated.so";
const std::string kInverse = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so";

/// A slider-crank in the xy plane: a crank of 0.2 m, a rod of 0.5 m whose end slides along x.
RobotModel slider_crank() {
  const auto rod = [](double l) { return body(l, l / 2, 0, 0, 0, l * l * l / 12, l * l * l / 12); };
  RobotModel m;
  m.name = "slider-crank";
  m.gravity = {0, -9.81, 0};
  add_joint(m, "crank", -1, JointType::revolute, Pose{}, rod(0.2));
  add_joint(m, "rod", 0, JointType::revolute, shift(0.2, 0, 0), rod(0.5));
  add_joint(m, "piston", -1, JointType::prismatic, turn_y(kPi / 2), body(0.8, 0, 0, 0, 0, 0, 0));
  m.loops = {{"pin", 1, 2, shift(0.5, 0, 0), Pose{}, kLoopX | kLoopY}};
  m.tips = {{"pin", 1, shift(0.5, 0, 0)}};
  m.number_coordinates();
  return m;
}

/// The four-bar whose loop is closed by a hinge in space: three of its five directions are implied
/// by the joints.
RobotModel redundant_four_bar() {
  RobotModel m = four_bar(1, 0.3, 0.9, 0.7);
  m.name = "redundant four-bar";
  m.loops[0].fixed = kLoopRevolute;
  m.joints[0].spring = {3, 0.4};
  return m;
}

/// A floating body with two arms whose hands hold each other: a weld, a ball, or one fixed turn.
RobotModel hands_together(const char* name, std::uint32_t fixed) {
  RobotModel m = floating_manipulator();
  m.name = name;
  add_joint(m, "second elbow", 6, JointType::spherical, shift(0.4, 0, 0),
            body(0.7, 0.1, 0.02, 0, 0.004, 0.01, 0.01));
  add_joint(m, "second wrist", 7, JointType::spherical, shift(0.3, 0, 0),
            body(0.5, 0.1, 0, 0.03, 0.002, 0.004, 0.004));
  m.loops = {{"hands", 3, 8, shift(0, 0, 0.15), multiply(shift(0.2, 0, 0), turn_x(0.3)), fixed}};
  m.number_coordinates();
  return m;
}

INSTANTIATE_TEST_SUITE_P(Constrained, DynamicsConformance,
                         testing::ValuesIn(with_inverse_of(
                             kInverse, dynamics_cases(kFile, "newton_euler", "constrained",
                                                      {puma560(), pa10_nus(), scara(), tree(),
                                                       floating_manipulator(), long_chain(30)}))),
                         dynamics_case_name);
INSTANTIATE_TEST_SUITE_P(Constrained, LoopConformance,
                         testing::ValuesIn(dynamics_cases(
                             kFile, "", "constrained",
                             {four_bar(1, 0.3, 0.9, 0.7), redundant_four_bar(), slider_crank(),
                              hands_together("hands welded", kLoopWeld),
                              hands_together("hands hinged", kLoopRevolute),
                              hands_together("hands at a point", kLoopPoint),
                              hands_together("hands with one turn", kLoopPoint | kLoopTurnY)})),
                         dynamics_case_name);

}  // namespace
}  // namespace robomosp::conformance
