// SPDX-License-Identifier: Apache-2.0
// Robots with the tools that are attached to them (layer: application, evaluation). [any thread]
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "document/document.h"

namespace robomosp::evaluation {

/// The tool centre points of a solid or object: none of a solid.
[[nodiscard]] const std::vector<model::ToolCentrePoint>& tool_centre_points(
    const document::Snapshot&, AnyId solid_or_object);

/// The robot as its kinematics sees it: an attached tool adds a tool "torch" at the object's own
/// frame, and one "torch.tip" at each of its centre points; the one named by Robot::tcp becomes the
/// robot's tool. `attached` and `tcp` are empty in the result, and bodies and masses are left out.
/// `name` is the robot's, for errors: the centre point named by tcp may no longer exist.
[[nodiscard]] Result<model::Robot> with_tool_frames(const document::Snapshot&,
                                                    const std::string& name, const model::Robot&);

/// The robot for drawing its generated bodies: they end where the tool is mounted, since the tool
/// has its own body, and not at its tip.
[[nodiscard]] model::Robot without_tool_stick(const model::Robot&);

}  // namespace robomosp::evaluation
