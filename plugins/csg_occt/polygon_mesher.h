// SPDX-License-Identifier: Apache-2.0
// Triangles between the corners of plane polygons with holes, by one sweep (layer: plugin, std
// only). The order of growth is n log n.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace robomosp::csg_occt {

struct PolygonCorner {
  double x = 0, y = 0;  ///< the sweep goes along y
};

/// Triangles, counterclockwise, of corner numbers. `next[i]` follows corner i with the inside on
/// the left. When each side of the region has a corner in every stretch of y of some length, no
/// triangle is higher than that. Nothing when sides cross or touch.
std::optional<std::vector<std::array<std::uint32_t, 3>>> triangulate_polygon(
    const std::vector<PolygonCorner>& corners, const std::vector<std::uint32_t>& next);

}  // namespace robomosp::csg_occt
