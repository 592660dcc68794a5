// SPDX-License-Identifier: Apache-2.0
// A robot where a world shows it: which world, at which joint values (layer: application, ioci
// only).
#pragma once

#include <vector>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

struct ShownRobot {
  WorldId world;
  std::size_t member = 0;  ///< of World::robots
  std::vector<double> q;   ///< as placed, else of the pose "home", else zeros
};

/// The optional argument `world` of commands of a robot.
[[nodiscard]] ParamSpec shown_world();
/// The world of the argument `world`, else the only one that has the robot `id`.
[[nodiscard]] Result<ShownRobot> shown_robot(const CommandContext& ctx, const Map& args);
/// Says, in messages, that joint values to be shown are beyond limits or leave loops open. They are
/// shown all the same, as one moves joints one after the other.
void note_shown_joints(CommandContext& ctx, RobotId robot, std::span<const double> q);

/// Shows the robot at `q` from now on; the answer is q.
[[nodiscard]] Result<Value> put_joints(CommandContext& ctx, const ShownRobot& shown,
                                       std::vector<double> q);
/// The argument `q` where it is given, else the values at which a world shows the robot.
[[nodiscard]] Result<std::vector<double>> given_or_shown(const CommandContext& ctx, const Map& args,
                                                         const RobotModel& m);

}  // namespace robomosp::ioci
