// SPDX-License-Identifier: Apache-2.0
// Edges of a solid found again after it changed (layer: data processing, geometry). [any thread]
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <robomosp/sdk/csg_edges.h>

namespace robomosp::geometry {

/// For each edge of `wanted` (indices of `before`), the index of the same edge after the change of
/// the solid; nullopt if it no longer exists. Edges have no names: they are matched by their kind,
/// the directions of their faces, their position and length, and no edge is matched twice.
[[nodiscard]] std::vector<std::optional<std::size_t>> same_edges(
    std::span<const CsgEdge> before, std::span<const CsgEdge> after,
    std::span<const std::size_t> wanted);

}  // namespace robomosp::geometry
