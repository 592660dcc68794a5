// SPDX-License-Identifier: Apache-2.0
// Frames of links and tools of a robot by name (layer: data processing, robotics).
#pragma once

#include <optional>
#include <string>

#include "robotics/build_model.h"

namespace robomosp::robotics {

/// The frame of a link or tool of a robot, fixed to a joint of its model; "" is the robot's tool.
[[nodiscard]] std::optional<LinkFrame> find_grip(const model::Robot&, const RobotModel&,
                                                 const std::string& link_or_tool);
/// The flange on which a tool is mounted: the robot's `tool` on its last link, also if an attached
/// tool is the robot's tool instead.
[[nodiscard]] LinkFrame flange_frame(const model::Robot&);
/// find_grip(); an unknown name is an error that lists the existing ones.
[[nodiscard]] Result<LinkFrame> grip_frame(const model::Robot&, const RobotModel&,
                                           const std::string& link_or_tool);

}  // namespace robomosp::robotics
