// SPDX-License-Identifier: Apache-2.0
// The revolute joints between a robot's base and one tip as axes in space, the input of closed-form
// inverse kinematics; and the configuration nearest to an unreachable pose (layer: data processing,
// spatial).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp::spatial {

/// Most joints supported by these functions.
inline constexpr std::size_t kMostArmJoints = 12;

/// One revolute joint of a serial arm.
struct ArmJoint {
  Vec3 axis{0, 0, 1};       ///< unit direction in the base frame at q = 0
  Vec3 point{};             ///< a point of the axis in the base frame at q = 0 [m]
  Pose placement;           ///< joint before_T_joint at q = 0
  double lower = 0;         ///< [rad]; may be infinite
  double upper = 0;         ///< [rad]; may be infinite
  std::size_t q_index = 0;  ///< of its entry in a configuration of the mechanism
  std::size_t joint = 0;    ///< index into RobotModel::joints
  std::string name;
};

struct SerialArm {
  std::vector<ArmJoint> joints;
  Pose tool;          ///< last joint_T_tip
  Pose tip_at_zero;   ///< base_T_tip at q = 0
  double length = 1;  ///< sum of the distances between joints and to the tip, > 0 [m]
  [[nodiscard]] std::size_t size() const { return joints.size(); }
};

/// The joints on the path to `tip`; an error names a joint that is not an independent revolute one.
/// Other joints do not matter. `most` is the greatest number of joints.
[[nodiscard]] Result<SerialArm> serial_arm(const RobotModel& model, std::size_t tip,
                                           std::size_t most = kMostArmJoints);

/// base_T_tip for one angle a joint [rad].
[[nodiscard]] Pose arm_tip(const SerialArm& arm, std::span<const double> q);

/// base_T_tip and the geometric Jacobian, joint after joint (v, w) at the tip's origin in base
/// axes.
Pose arm_jacobian(const SerialArm& arm, std::span<const double> q, std::span<double> jacobian);

/// Moves q, with a tip orientation close to the target's, to where the tip's origin is closest to
/// the target's, keeping the orientation and ignoring limits. Returns the remaining distance [m].
/// Gauss-Newton on the position with the orientation as linearised constraint, damped.
double closest_position(const SerialArm& arm, const Pose& target, std::span<double> q);

/// Moves q within the limits to a local minimum of position error / arm length and rotation error,
/// summed as squares (Levenberg-Marquardt, joints at limits held). Returns that sum.
double closest_pose(const SerialArm& arm, const Pose& target, std::span<double> q);

/// The unit twist (v, w) in the base frame that the tip cannot make at q, with lengths relative to
/// the arm length; zeros if its singular value exceeds `tolerance` times the greatest.
[[nodiscard]] std::array<double, 6> lost_direction(const SerialArm& arm, std::span<const double> q,
                                                   double tolerance = 1e-7);

}  // namespace robomosp::spatial
