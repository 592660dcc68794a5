// SPDX-License-Identifier: Apache-2.0
// Inputs of a run of a robot along a trajectory of a world, looked up by name (layer: application,
// sim). Internal to modules/sim.
#pragma once

#include <memory>
#include <string>

#include "sim/base_motion.h"
#include "sim/robot_motion.h"
#include "sim/simulate.h"

namespace robomosp::sim {

struct RunSetup {
  std::string title;
  model::ProviderChoice inverse_dynamics;
  std::shared_ptr<const RobotModel> model;
  Pose world_T_base;                     ///< placement of the robot
  std::shared_ptr<const BasePath> base;  ///< motion of its mounting; null = fixed
  std::string base_trajectory;
  Vec3 gravity{};  ///< [m/s^2], world axes
  RobotMotionTask task;
};

/// A robot with loops or joints of several coordinates is an error.
[[nodiscard]] Result<RunSetup> prepare_run(const Simulator&, const Run&, Progress&);

/// An error if the base moves, which `what` ("checks of paths") do not support.
[[nodiscard]] Result<void> only_standing(const RunSetup&, const std::string& what);

/// Columns of time, joints and tool, with the joints' limits.
[[nodiscard]] Result<recording::Recording> kinematic_recording(const Run&, const RunSetup&,
                                                               const RobotMotion&);

}  // namespace robomosp::sim
