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

/// Called before the open transaction of `ctx` is committed: recomputes the segments of
/// trajectories that follow solids, or paths along edges, changed by it. If that fails, or if the
/// segments were edited, the trajectory keeps its segments, stops following, and a message gives
/// the reason. Costs one check per changed record if no trajectory follows edges.
Result<void> follow_edges(CommandContext& ctx);

/// For each edge of `wanted` (indices of `before`), the index of the same edge after the change of
/// the solid; nullopt if it no longer exists. Edges have no names: they are matched by their kind,
/// the directions of their faces, their position and length, and no edge is matched twice.
[[nodiscard]] std::vector<std::optional<std::size_t>> same_edges(
    std::span<const CsgEdge> before, std::span<const CsgEdge> after,
    std::span<const std::size_t> wanted);

}  // namespace robomosp::ioci
