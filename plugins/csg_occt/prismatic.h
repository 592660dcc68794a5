// SPDX-License-Identifier: Apache-2.0
// The shortcut for prisms along one direction: their unions, differences and intersections are
// worked out in the plane, slab by slab, and the boundary is built from that (layer: plugin).
#pragma once

#include <optional>
#include <vector>

#include "evaluate.h"

namespace robomosp::csg_occt {

struct PrismaticOutcome {
  std::vector<Solid> solids;  ///< in the term's frame [mm]
  std::vector<Note> notes;
};

/// Nothing when some operand is no prism, the directions differ, the outcome is empty or is not a
/// plain closed surface (solids that touch along an edge), or positions are too close to
/// degenerate: then the general way has to decide. `looked_at` is the number of terms this took.
std::optional<PrismaticOutcome> build_prismatic(const Plan& plan, std::size_t term,
                                                FaceMemory& faces, const Progress& progress,
                                                std::size_t& looked_at);

}  // namespace robomosp::csg_occt
