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

/// Rows of the residual: one a fixed direction of each loop, in order of LoopDirection, loop after
/// loop.
[[nodiscard]] std::size_t loop_rows(const RobotModel& model);

/// Residual of all loops [m, rad], zero where they are closed: in the axes of frame a the way from
/// its origin to that of frame b, and the rotation vector of frame b in frame a. `joint_frames` of
/// one sample (forward_kinematics); loop_rows() numbers.
void loop_residual(const RobotModel& model, std::span<const Pose> joint_frames,
                   std::span<double> residual);

/// Derivative of loop_residual by the velocities: J_c, loop_rows() x dof(), row-major, so that the
/// residual changes at the rate J_c qd. Where loops are closed and fix all turns it is the velocity
/// of frame b against frame a in the axes of a.
void loop_jacobian(const RobotModel& model, std::span<const Pose> joint_frames,
                   std::span<double> jacobian);

/// Moves a configuration by velocities times 1 s: angles and ways add up, quaternions turn about
/// the moving axes and stay of length 1. q: coordinate_count() numbers, step: dof().
void move_configuration(const RobotModel& model, std::span<const double> step, std::span<double> q);

/// How a mechanism is closed.
struct ClosureOptions {
  double tolerance = 1e-12;  ///< greatest residual of a closed mechanism [m, rad]
  int most_iterations = 60;  ///< of Newton's method, for every step on the way
  /// Greatest change of a held joint between two closed configurations on the way [rad or m].
  double step = 0.1;
};

/// What became of closing a mechanism.
struct Closure {
  std::vector<double> q;       ///< closed, or the nearest to it that was found
  double residual = 0;         ///< greatest element of the residual [m or rad]
  std::size_t worst_loop = 0;  ///< the loop it belongs to
  int iterations = 0;
  bool is_closed = false;
  /// A joint that had to leave its limits, -1 = none: its index in RobotModel::joints.
  std::int32_t outside = -1;
};

/// Finds a closed configuration near `start` in which the held joints stand as in `target`.
///
/// Held joints go from their values in `start` to those in `target` in small steps; after each the
/// others follow by Newton's method with the pseudo-inverse of J_c (the least motion that closes
/// the loops to first order; redundant loops do no harm) and halved steps where the residual would
/// grow, so that the branch of `start` is kept. From a singular start (a stretched or folded
/// mechanism) that Newton's method cannot leave, small fixed displacements are tried.
/// `start`, `target`: coordinate_count() numbers, quaternions of any length but zero; `held`: one
/// flag a velocity (dof()). Without loops the target itself is the answer.
/// Newton-Raphson position analysis as in P. E. Nikravesh, Computer-Aided Analysis of Mechanical
/// Systems (1988), section 3.2, with the pseudo-inverse for redundant constraints.
[[nodiscard]] Closure close_loops(const RobotModel& model, std::span<const double> start,
                                  std::span<const double> target, const std::vector<bool>& held,
                                  const ClosureOptions& options = {});

/// Flags of the velocities of joints that have a motor: what is held when nothing else is said.
/// Where no joint is passive none is held.
[[nodiscard]] std::vector<bool> actuated_velocities(const RobotModel& model);

/// The joint that stands furthest outside its limits by more than `slack` [rad or m], -1 = none.
[[nodiscard]] std::int32_t joint_outside_limits(const RobotModel& model, std::span<const double> q,
                                                double slack = 1e-9);

}  // namespace robomosp::robotics
