// SPDX-License-Identifier: Apache-2.0
// The shortcut for prisms along one direction: their unions, differences and intersections are
// computed in the plane, slab by slab, and the boundary is built from the result (layer: plugin).
#pragma once

#include <optional>
#include <vector>

#include "evaluate.h"

namespace robomosp::csg_occt {

struct PrismaticOutcome {
  std::vector<Solid> solids;  ///< in the term's frame [mm]
  std::vector<Note> notes;
};

/// Nothing if some operand is not a prism, the directions differ, the result is empty or not a
/// simple closed surface (solids that touch along an edge), or positions are nearly degenerate:
/// then the general method must decide. `looked_at` is the number of terms examined.
std::optional<PrismaticOutcome> build_prismatic(const Plan& plan, std::size_t term,
                                                FaceMemory& faces, const Progress& progress,
                                                std::size_t& looked_at);

}  // namespace robomosp::csg_occt
