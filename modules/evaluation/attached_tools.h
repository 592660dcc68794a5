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

/// The robot as its kinematics sees it: an attached tool is a further tool "torch" where the
/// object's own frame is, and one "torch.tip" at each of its centre points; the one that Robot::tcp
/// names is the robot's tool. `attached` and `tcp` are empty then. Bodies and masses are not in it.
/// `name` is the robot's, for errors: the centre point that is its tool may be gone.
[[nodiscard]] Result<model::Robot> with_tool_frames(const document::Snapshot&,
                                                    const std::string& name, const model::Robot&);

/// The robot whose generated bodies are drawn: they reach to where the tool is mounted, which has a
/// body of its own, and not to its tip.
[[nodiscard]] model::Robot without_tool_stick(const model::Robot&);

}  // namespace robomosp::evaluation
