// SPDX-License-Identifier: Apache-2.0
// Closed loops of a mechanism: how far they are open, the Jacobian of that, and closing them by
// moving some of the joints (layer: data processing, robotics). [any thread]
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// Number of rows of the residual: one per fixed direction of each loop, in order of LoopDirection,
/// loop by loop.
[[nodiscard]] std::size_t loop_rows(const RobotModel& model);

/// Residual of all loops [m, rad], zero if they are closed: the displacement from the origin of
/// frame a to that of frame b in the axes of a, and the rotation vector of frame b in frame a.
/// `joint_frames` of one sample (forward_kinematics); loop_rows() numbers.
void loop_residual(const RobotModel& model, std::span<const Pose> joint_frames,
                   std::span<double> residual);

/// Derivative of loop_residual with respect to the velocities: J_c, loop_rows() x dof(), row-major;
/// the residual changes at the rate J_c qd. For closed loops that fix all rotations, it is the
/// velocity of frame b relative to frame a in the axes of a.
void loop_jacobian(const RobotModel& model, std::span<const Pose> joint_frames,
                   std::span<double> jacobian);

/// Moves a configuration by velocities times 1 s: angles and displacements add up, quaternions
/// rotate about the moving axes and stay normalised. q: coordinate_count() numbers, step: dof().
void move_configuration(const RobotModel& model, std::span<const double> step, std::span<double> q);

/// Options for closing a mechanism.
struct ClosureOptions {
  double tolerance = 1e-12;  ///< greatest residual of a closed mechanism [m, rad]
  int most_iterations = 60;  ///< of Newton's method, per intermediate step
  /// Greatest change of a held joint between two intermediate closed configurations [rad or m].
  double step = 0.1;
};

/// Result of closing a mechanism.
struct Closure {
  std::vector<double> q;       ///< closed, or the nearest configuration found
  double residual = 0;         ///< greatest element of the residual [m or rad]
  std::size_t worst_loop = 0;  ///< the loop with that element
  int iterations = 0;
  bool is_closed = false;
  /// A joint that violates its limits, -1 = none: its index in RobotModel::joints.
  std::int32_t outside = -1;
};

/// Finds a closed configuration near `start` with the held joints at their values in `target`.
///
/// Held joints move from their values in `start` to those in `target` in small steps; after each,
/// the others follow by Newton's method with the pseudo-inverse of J_c (the least motion that
/// closes the loops to first order; redundant loops are harmless), with steps halved if the
/// residual would grow, so that the branch of `start` is kept. From a singular start (a stretched
/// or folded mechanism) that Newton's method cannot leave, small fixed displacements are tried.
/// `start`, `target`: coordinate_count() numbers, quaternions of any length but zero; `held`: one
/// flag per velocity (dof()). Without loops it returns the target itself. Newton-Raphson position
/// analysis as in P. E. Nikravesh, Computer-Aided Analysis of Mechanical Systems (1988), section
/// 3.2, with the pseudo-inverse for redundant constraints.
[[nodiscard]] Closure close_loops(const RobotModel& model, std::span<const double> start,
                                  std::span<const double> target, const std::vector<bool>& held,
                                  const ClosureOptions& options = {});

/// Flags of the velocities of joints with a motor: the joints held by default. If no joint is
/// passive, none is held.
[[nodiscard]] std::vector<bool> actuated_velocities(const RobotModel& model);

/// The joint furthest outside its limits by more than `slack` [rad or m], -1 = none.
[[nodiscard]] std::int32_t joint_outside_limits(const RobotModel& model, std::span<const double> q,
                                                double slack = 1e-9);

}  // namespace robomosp::robotics
