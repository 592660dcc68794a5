// SPDX-License-Identifier: Apache-2.0
// Edges of a solid as commands name them (layer: application, ioci).
#pragma once

#include <vector>

#include <robomosp/sdk/csg_edges.h>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// Indices of edges given by a list: numbers of solid.edges (1 = the first), or places {x, y, z}
/// [m] in the solid's frame, which mean the edge nearest to each; a place as near to two edges is
/// an error. `path` names the list.
[[nodiscard]] Result<std::vector<std::size_t>> read_edges(const std::vector<CsgEdge>& all,
                                                          const List& given, std::string_view path);

}  // namespace robomosp::ioci
