// SPDX-License-Identifier: Apache-2.0
// Trajectories that follow the edges of solids (layer: application). Internal to modules/ioci.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <robomosp/sdk/csg_edges.h>

#include "ioci/core/command.h"

namespace robomosp::ioci {

/// Before the open transaction of `ctx` is committed: makes the segments of trajectories again
/// whose solids, or whose own paths along edges, it has changed. Where that fails, and where the
/// segments were edited, the trajectory keeps its segments, follows no longer, and a message says
/// why. Costs a look at each changed record while nothing follows.
Result<void> follow_edges(CommandContext& ctx);

/// For each of the edges `wanted` (indices of `before`) the index of the same edge after the solid
/// has changed; nullopt where it is gone. Edges have no names: they are told by their kind, the
/// directions of their faces, where they run and how long they are, and no edge is given twice.
[[nodiscard]] std::vector<std::optional<std::size_t>> same_edges(
    std::span<const CsgEdge> before, std::span<const CsgEdge> after,
    std::span<const std::size_t> wanted);

}  // namespace robomosp::ioci
