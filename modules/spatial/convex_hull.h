// SPDX-License-Identifier: Apache-2.0
// Convex hulls of points in space (layer: data processing, spatial). [any thread]
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::spatial {

/// The hull's corners and its surface, closed, counter-clockwise from outside.
struct Hull {
  std::vector<Vec3> points;                             ///< corners only [m]
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of points
  double volume = 0;                                    ///< [m^3]
  Vec3 middle{};                                        ///< mean of the corners, inside [m]
};

/// Quickhull (Barber, Dobkin, Huhdanpaa, ACM TOMS 22 (1996) 469). Points within 1e-10 of the
/// largest extent from the surface may be left inside or out. nullopt when the points lie in a
/// plane, or a number is not finite.
[[nodiscard]] std::optional<Hull> convex_hull(std::span<const Vec3> points);

/// The vertices of a mesh in double precision.
[[nodiscard]] std::vector<Vec3> vertices(const Mesh& mesh);

}  // namespace robomosp::spatial
