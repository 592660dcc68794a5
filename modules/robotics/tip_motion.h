// SPDX-License-Identifier: Apache-2.0
// Motions of a tip in one configuration: in a tree the columns of its geometric Jacobian, with
// closed loops those that keep them closed, as functions of the motor rates (layer: data
// processing, robotics). [any thread]
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// First-order motions of a mechanism and of one of its tips. With J the geometric Jacobian of the
/// tree, the columns of Z an orthonormal basis of the joint rates that keep the loops closed (J_c Z
/// = 0, loop_jacobian), and Z_a its rows of the motors, the tip's twist for motor rates t is
/// J Z Z_a^+ t. (C. Gosselin and J. Angeles, "Singularity analysis of closed-loop kinematic
/// chains", IEEE Trans. Robotics and Automation 6(3), 1990; with all joints' constraints at once as
/// in F. C. Park and J. W. Kim, "Singularity analysis of closed kinematic chains", J. Mech. Design
/// 121, 1999.)
struct TipMotion {
  /// The tip's twist (vx vy vz wx wy wz) in the base frame for unit rate of each motor.
  std::vector<double> jacobian;
  /// Entries of qd of the columns: those of the motors; of all joints if none is passive or there
  /// is no loop.
  std::vector<std::size_t> motors;
  /// Orthonormal joint rates that keep the loops closed, dof() each, and the tip's twist for each.
  std::vector<std::vector<double>> feasible;
  std::vector<double> feasible_twists;
  /// Unit joint rates that keep the loops closed with the motors at rest, dof() each, and the tip's
  /// twist for each: the motors cannot resist them.
  std::vector<std::vector<double>> loose;
  std::vector<double> self_motion_twists;
  double hold = 1;  ///< least rate of the motors for unit joint rates, 0 = some are not held
};

/// `joint_frames` of one sample (forward_kinematics), loops closed. A direction counts as lost by
/// the loops or by the motors below `threshold` times the greatest.
[[nodiscard]] TipMotion tip_motion(const RobotModel& model, std::size_t tip,
                                   std::span<const Pose> joint_frames, double threshold = 1e-9);

/// A closed configuration at a distance of about `size` [rad or m] from a closed one, in a
/// direction determined by `seed`; quaternions are normalised. If the loops cannot be kept closed
/// over that distance, it moves as far as possible.
[[nodiscard]] std::vector<double> configuration_beside(const RobotModel& model,
                                                       std::span<const double> q, double size,
                                                       unsigned seed);

/// Greatest element of the loops' residual [m or rad]; 0 without loops.
[[nodiscard]] double open_by(const RobotModel& model, std::span<const Pose> joint_frames);

}  // namespace robomosp::robotics
