// SPDX-License-Identifier: Apache-2.0
// Where things hang on a robot: links and tools by name (layer: data processing, robotics).
#pragma once

#include <optional>
#include <string>

#include "robotics/build_model.h"

namespace robomosp::robotics {

/// The frame of a link or tool of a robot, fixed to a joint of its model; "" is the robot's tool.
[[nodiscard]] std::optional<LinkFrame> find_grip(const model::Robot&, const RobotModel&,
                                                 const std::string& link_or_tool);
/// The flange that a tool is mounted on: the robot's own `tool` on its last link, also where an
/// attached tool is the robot's tool instead.
[[nodiscard]] LinkFrame flange_frame(const model::Robot&);
/// find_grip(); a name that nothing has is an error that lists those there are.
[[nodiscard]] Result<LinkFrame> grip_frame(const model::Robot&, const RobotModel&,
                                           const std::string& link_or_tool);

}  // namespace robomosp::robotics
