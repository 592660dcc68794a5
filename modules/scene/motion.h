// SPDX-License-Identifier: Apache-2.0
// Motion: where the members of a world are in a run or a recording, instead of where the world has
// them (layer: application, scene). [any thread]
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

#include "document/document.h"
#include "recording/recording.h"

namespace robomosp::scene {

/// By the members' names. What a robot holds goes with it unless it has its own pose here; members
/// without an entry are placed as in the world.
struct Motion {
  std::map<std::string, std::vector<double>> q;  ///< of robots [rad, m or 1]
  std::map<std::string, Pose> objects;           ///< world_T_object
};
using MotionPtr = std::shared_ptr<const Motion>;

/// What a recording says of a world at a time [s]: robots along columns q1, ... (others than the
/// recording's own along `<name>.q1`, ...), objects along `<name>.x .y .z .qw .qx .qy .qz`. Between
/// two rows joint values and positions are linear, rotations along the shortest arc; before the
/// first row and after the last nothing moves. A recording with other joints than the robot, or
/// of a robot that is not there, is an error.
[[nodiscard]] Result<Motion> motion_at(const document::Snapshot&, WorldId,
                                       const recording::Recording&, double time);
/// The same of a robot without a world, under its name: along columns q1, ...
[[nodiscard]] Result<Motion> motion_at(const document::Snapshot&, RobotId,
                                       const recording::Recording&, double time);

}  // namespace robomosp::scene
