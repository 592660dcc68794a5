// SPDX-License-Identifier: Apache-2.0
// Segments of trajectories along the edges of a solid (layer: application). Internal to
// modules/ioci.
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include <robomosp/sdk/csg_edges.h>

#include "ioci/core/commands.h"
#include "model/records.h"

namespace robomosp::ioci {

/// The edges of the solid of a path, in the order of solid.edges. ErrorCode of the engine.
[[nodiscard]] Result<std::shared_ptr<const std::vector<CsgEdge>>> edges_along(
    const CommandContext&, const document::Snapshot& records, const model::EdgePath&);
/// The segments of a path; `all` are the edges of its solid. An error where edges do not follow one
/// another, or where the tool has no direction.
[[nodiscard]] Result<std::vector<model::TrajectorySegment>> segments_along(
    const CommandContext&, const std::vector<CsgEdge>& all, const model::EdgePath&);
/// Removes the expressions of a field and of all below it.
void drop_expressions(model::Trajectory&, std::string_view under);

}  // namespace robomosp::ioci
