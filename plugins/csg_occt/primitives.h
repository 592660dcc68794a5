// SPDX-License-Identifier: Apache-2.0
// Builds the primitives of kCsgNodes as Open CASCADE solids (layer: plugin).
#pragma once

#include <mutex>
#include <span>

#include "occt_support.h"

namespace robomosp::csg_occt {

/// Refuses what this engine does not make; check_csg_tree() has passed the node.
Result<void> check_kind(const CsgNode& node, std::size_t index);
/// Whether more than sizes belongs to it (a profile, geometry from a file): see content.h.
bool has_content(CsgKind kind);
/// A size read as a number of things.
std::size_t count_of(double size);
/// One solid in millimetres.
TopoDS_Shape build_primitive(CsgKind kind, const std::array<double, 6>& sizes);
/// Rotations that map the primitive on itself and put its poles and seams elsewhere on the same
/// surface, which cures intersections that run through them; empty when it has no such symmetry.
std::span<const gp_Trsf> turns_of(CsgKind kind, const std::array<double, 6>& sizes);
/// OCCT's fillet algorithm keeps state in static variables: one at a time.
std::timed_mutex& fillet_mutex();

}  // namespace robomosp::csg_occt
