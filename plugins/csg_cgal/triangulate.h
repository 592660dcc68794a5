// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles of a region of the plane with holes and islands (layer: plugin).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace robomosp::csg_cgal {

using Point2 = std::array<double, 2>;

struct Region {
  std::vector<std::vector<Point2>> loops;  ///< outer ones counter-clockwise, holes clockwise
  /// Three corners each, counted through all loops, counter-clockwise.
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Orients the loops by nesting and triangulates between them without new points; nothing when
/// loops cross or touch, or a corner is there twice.
std::optional<Region> triangulate(std::vector<std::vector<Point2>> loops);

}  // namespace robomosp::csg_cgal
