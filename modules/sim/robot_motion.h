// SPDX-License-Identifier: Apache-2.0
// Motion of a robot's joints along a trajectory: Cartesian segments by inverse kinematics, joint
// segments directly (layer: application, sim).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "kernel/registry.h"
#include "model/records.h"
#include "motion/cartesian_path.h"
#include "motion/weave.h"
#include "robotics/maker_axes.h"

namespace robomosp::sim {

struct RobotMotionTask {
  std::shared_ptr<const RobotModel> model;
  model::ProviderChoice ik;
  std::vector<double> start;  ///< initial joint values, or the seed of the first pose
  bool is_at_start = false;   ///< `start` is the initial configuration: an approach is added to a
                              ///< path that begins elsewhere
  /// Joints begin at the first configuration of a first segment of several joint vectors, not at
  /// `start`.
  bool begins_on_path = false;
  const model::Trajectory* trajectory = nullptr;
  std::string name;        ///< of the trajectory, for messages
  std::string where;       ///< likewise: world, robot and trajectory
  Pose base_T_trajectory;  ///< in the robot's base frame; in the world if the base moves
  /// Motion of the base in the world, at a time of the motion; null = fixed.
  std::function<Result<PathSample>(double t)> base;
  double step = 0.01;  ///< between samples [s]
  double lead = 0;     ///< the samples are earlier by this time, 0 <= lead < step [s]
  IkTolerance tolerance{};
  IkObjective objective = IkObjective::none;
  const ClearanceField* clearance = nullptr;
  motion::FindTrajectory stored;
  std::optional<motion::Weave> weave;  ///< added to its Cartesian paths
  /// Axes of the robot's maker, for errors and notes; null = unknown.
  std::shared_ptr<const robotics::MakerAxes> axes;
};

/// Samples at 0, step, 2 step, ... minus the lead, and at the very end; tables row-major, dof
/// entries per row.
struct RobotMotion {
  std::vector<double> times, q, qd, qdd;
  std::vector<double> position_error, rotation_error;  ///< remaining errors of the inverse
                                                       ///< kinematics
  std::vector<double> approach;    ///< 1 in rows of added approaches; empty = there are none
  std::vector<std::string> notes;  ///< such as added moves, a sentence each
};

/// A sample of a path in the frame in which the path is placed.
[[nodiscard]] PathSample in_base(const PathSample& s, const Pose& base_T_path);
/// The motion `s` relative to a base with the motion `base`, both in the same axes; result in axes
/// of the base.
[[nodiscard]] PathSample seen_from(const PathSample& base, const PathSample& s);

/// Consecutive Cartesian segments are one path (motion::Path) and one branch of the inverse
/// kinematics. A joint segment starts at the current joint values; its points in space are solved
/// for the configuration nearest to the previous one. If a Cartesian path, or a first segment of
/// several joint vectors, does not begin at the current configuration, an approach is inserted: a
/// synchronous quintic move within the joints' limits. Limits that the robot lacks are those of the
/// segment, or assumed, with a note. A sample out of reach is an error with its time and number.
Result<RobotMotion> robot_motion(const Registry&, const RobotMotionTask&, Progress&);

}  // namespace robomosp::sim
