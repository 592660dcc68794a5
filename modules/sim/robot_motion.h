// SPDX-License-Identifier: Apache-2.0
// How a robot's joints move along a trajectory, its Cartesian segments by inverse kinematics, its
// joint segments as they are (layer: application, sim).
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
  std::vector<double> start;  ///< where the joints are, or the seed of the first pose
  bool is_at_start = false;   ///< the joints are there: a path elsewhere gets a move before it
  /// Joints begin where a first segment of several joint vectors begins, not at `start`.
  bool begins_on_path = false;
  const model::Trajectory* trajectory = nullptr;
  std::string name;        ///< of the trajectory, for messages
  std::string where;       ///< likewise: world, robot and trajectory
  Pose base_T_trajectory;  ///< of the robot's base frame; of the world while the base moves
  /// How the base moves in the world, at a time of the motion; null = it stands.
  std::function<Result<PathSample>(double t)> base;
  double step = 0.01;  ///< between samples [s]
  double lead = 0;     ///< the samples come this much earlier, 0 <= lead < step [s]
  IkTolerance tolerance{};
  IkObjective objective = IkObjective::none;
  const ClearanceField* clearance = nullptr;
  motion::FindTrajectory stored;
  std::optional<motion::Weave> weave;  ///< laid over its paths in space
  /// Of the robot's maker, for errors and notes; null = not known.
  std::shared_ptr<const robotics::MakerAxes> axes;
};

/// Samples at 0, step, 2 step, ... less the lead, and the very end; tables row-major, dof entries a
/// row.
struct RobotMotion {
  std::vector<double> times, q, qd, qdd;
  std::vector<double> position_error, rotation_error;  ///< left by the inverse kinematics
  std::vector<double> approach;    ///< 1 in rows of moves that were put in; empty = there are none
  std::vector<std::string> notes;  ///< such as moves put in, a sentence each
};

/// A sample of a path in the frame that the path is placed in.
[[nodiscard]] PathSample in_base(const PathSample& s, const Pose& base_T_path);
/// What moves as `s` as seen from a base that moves as `base`, both in the same axes; axes of the
/// base.
[[nodiscard]] PathSample seen_from(const PathSample& base, const PathSample& s);

/// Cartesian segments that follow each other are one path (motion::Path) and one branch of the
/// inverse kinematics. A joint segment starts where the joints are; its points in space are solved
/// for the configuration nearest to the one before. Where a Cartesian path, or a first segment of
/// several joint vectors, does not begin at the joints' configuration, an approach is put between:
/// a synchronous move of fifth degree within the joints' limits. Limits that the robot lacks are
/// those of the segment, or assumed and noted. A sample out of reach is an error that says its
/// time and number.
Result<RobotMotion> robot_motion(const Registry&, const RobotMotionTask&, Progress&);

}  // namespace robomosp::sim
