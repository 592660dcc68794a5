// SPDX-License-Identifier: Apache-2.0
// Velocities and accelerations of all frames of a RobotModel and of points on its links, Jacobians
// of such points and their time derivatives (layer: data processing, robotics). Everything is
// reported in the base frame; nothing is allocated. [any thread]
#pragma once

#include <span>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// How a frame moves: of its origin and of itself.
struct FrameMotion {
  Vec3 v{};      ///< [m/s]
  Vec3 w{};      ///< [rad/s]
  Vec3 a{};      ///< of the origin [m/s^2]
  Vec3 alpha{};  ///< [rad/s^2]
};

/// Motion of every joint frame for one configuration: frames from forward_kinematics(), qd and qdd
/// of dof() entries; an empty qdd counts as zeros. Base at rest (Featherstone, Rigid Body Dynamics
/// Algorithms, 2008, sec. 4.4, with classical accelerations).
void joint_motions(const RobotModel& model, std::span<const Pose> joint_frames,
                   std::span<const double> qd, std::span<const double> qdd,
                   std::span<FrameMotion> motions);

/// Motion of a frame that is fixed to a joint frame (-1 = base), its origin at `place` [m].
[[nodiscard]] FrameMotion carried_motion(std::int32_t joint, const Vec3& place,
                                         std::span<const Pose> joint_frames,
                                         std::span<const FrameMotion> motions);

/// Geometric Jacobian of a point at `place` (base frame [m]) of the body that `joint` moves: for
/// entry k of qd the six numbers jacobian[6 k ...] (vx vy vz wx wy wz), base axes. 6 * dof numbers.
void point_jacobian(const RobotModel& model, std::int32_t joint, const Vec3& place,
                    std::span<const Pose> joint_frames, std::span<double> jacobian);

/// Time derivative of point_jacobian() for a point that moves with its body; so that its
/// acceleration is jacobian qdd + rate qd.
void point_jacobian_rate(const RobotModel& model, std::int32_t joint, const Vec3& place,
                         std::span<const Pose> joint_frames, std::span<const FrameMotion> motions,
                         std::span<double> rate);

/// Turns columns (v, w) into other axes: rows of `axes_T_base` rotate both parts.
void express_columns(const Pose& axes_T_base, std::span<double> columns);

}  // namespace robomosp::robotics
