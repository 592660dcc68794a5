// SPDX-License-Identifier: Apache-2.0
// Checks and builds the primitives of kCsgNodes as Open CASCADE solids (layer: plugin).
#pragma once

#include <mutex>
#include <span>

#include "occt_support.h"

namespace robomosp::csg_occt {

/// Lengths outside this range [m] drown in the kernel's tolerance of 1e-10 m or in rounding.
inline constexpr double kSmallestLength = 1e-8, kGreatestLength = 1e4;

/// Number of sizes the primitive has; 0 for an operation.
std::size_t primitive_size_count(CsgKind kind);
std::string_view primitive_name(CsgKind kind);
/// Every size of a primitive or modifier in range and the primitive not self-intersecting.
Result<void> check_primitive(const CsgNode& node, std::size_t index);
/// Whether more than sizes belongs to it (a profile, geometry from a file): see content.h.
bool has_content(CsgKind kind);
/// Union, difference, intersection.
bool is_operation(CsgKind kind);
/// Works on one child: mirror, patterns, fillet, chamfer.
bool is_modifier(CsgKind kind);
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
