// SPDX-License-Identifier: Apache-2.0
// Checks and builds the primitives of kCsgNodes as Open CASCADE solids (layer: plugin).
#pragma once

#include "occt_support.h"

namespace robomosp::csg_occt {

/// Lengths outside this range [m] drown in the kernel's tolerance of 1e-10 m or in rounding.
inline constexpr double kSmallestLength = 1e-8, kGreatestLength = 1e4;

/// Number of sizes the primitive has; 0 for an operation.
std::size_t primitive_size_count(CsgKind kind);
std::string_view primitive_name(CsgKind kind);
/// Every size in range and the primitive not self-intersecting.
Result<void> check_primitive(const CsgNode& node, std::size_t index);
/// One solid in millimetres. `turned` puts the poles and seams of spheres and tori elsewhere on
/// the same surface, which cures intersections that run through them.
TopoDS_Shape build_primitive(CsgKind kind, const std::array<double, 6>& sizes, bool turned);
bool can_turn(CsgKind kind);

}  // namespace robomosp::csg_occt
