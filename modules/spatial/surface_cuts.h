// SPDX-License-Identifier: Apache-2.0
// Where the triangles of a surface cut each other (layer: data processing, spatial). [any thread]
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::spatial {

struct SurfaceCut {
  std::array<std::uint32_t, 2> triangles{};  ///< the one with the greater number first
  Vec3 at{};                                 ///< a point of both [m]
};

/// Pairs of triangles, one of them not before number `first`, where a side of one passes through
/// the inside of the other; triangles that only touch, or lie in one plane, are none. Corners with
/// equal indices are one. At most `most` pairs. `points`: 3 numbers a corner [m], finite;
/// `triangles`: 3 indices each, in range.
[[nodiscard]] std::vector<SurfaceCut> surface_cuts(std::span<const double> points,
                                                   std::span<const std::uint32_t> triangles,
                                                   std::size_t first, std::size_t most);

}  // namespace robomosp::spatial
