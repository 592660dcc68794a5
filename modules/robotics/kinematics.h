// SPDX-License-Identifier: Apache-2.0
// Forward kinematics, Jacobians and manipulability of a RobotModel, batch first and without
// allocation (layer: data processing, robotics). Frames are given in the base frame. [any thread]
#pragma once

#include <span>

#include <robomosp/sdk/robot_model.h>

#include "robotics/build_model.h"
#include "spatial/pose.h"

namespace robomosp::robotics {

/// base_T_joint of every joint: joint_frames[i * joints + j] for the i-th configuration in q; the
/// size of joint_frames sets the number of samples.
void forward_kinematics(const RobotModel& model, std::span<const double> q,
                        std::span<Pose> joint_frames);

/// A frame given in the frame of joint `joint`, in the robot's base; joint -1 is the base itself.
[[nodiscard]] inline Pose carried(std::int32_t joint, const Pose& local,
                                  std::span<const Pose> frames) {
  return joint < 0 ? local : spatial::compose(frames[static_cast<std::size_t>(joint)], local);
}

/// base_T_tip from the joint frames of one sample.
[[nodiscard]] Pose tip_pose(const RobotModel& model, std::size_t tip,
                            std::span<const Pose> joint_frames);

/// base_T_link of every link of the record from the joint frames of one sample.
void link_poses(std::span<const LinkFrame> links, std::span<const Pose> joint_frames,
                std::span<Pose> base_T_link);

/// Axes that the tip's velocity is expressed in; the reference point is always the tip's origin.
enum class JacobianFrame { base, world, tip };

/// Geometric Jacobian of one sample: for entry k of qd the six numbers jacobian[6 k ...] are the
/// tip's linear [m/s] and angular [rad/s] velocity for unit rate, (vx vy vz wx wy wz). Joints that
/// do not carry the tip get zeros. 6 * dof numbers.
void geometric_jacobian(const RobotModel& model, std::size_t tip,
                        std::span<const Pose> joint_frames, JacobianFrame frame,
                        std::span<double> jacobian);

/// Yoshikawa's measure sqrt(det(J J^T)), for fewer than six joints sqrt(det(J^T J)); 0 when
/// singular. `jacobian` as above, joint after joint.
[[nodiscard]] double manipulability(std::span<const double> jacobian);

}  // namespace robomosp::robotics
