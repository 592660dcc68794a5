// SPDX-License-Identifier: Apache-2.0
// Builds the primitives of kCsgNodes as Open CASCADE solids (layer: plugin).
#pragma once

#include <mutex>
#include <span>

#include "occt_support.h"

namespace robomosp::csg_occt {

/// Rejects nodes that this engine does not support; check_csg_tree() has accepted the node.
Result<void> check_kind(const CsgNode& node, std::size_t index);
/// True if it has more data than sizes (a profile, geometry from a file): see content.h.
bool has_content(CsgKind kind);
/// A size converted to a count.
std::size_t count_of(double size);
/// One solid in millimetres.
TopoDS_Shape build_primitive(CsgKind kind, const std::array<double, 6>& sizes);
/// Rotations that map the primitive to itself and move its poles and seams, which avoids
/// intersections through them; empty if it has no such symmetry.
std::span<const gp_Trsf> turns_of(CsgKind kind, const std::array<double, 6>& sizes);
/// OCCT's fillet algorithm keeps state in static variables, so only one may run at a time.
std::timed_mutex& fillet_mutex();

}  // namespace robomosp::csg_occt
