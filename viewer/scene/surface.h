// SPDX-License-Identifier: GPL-3.0-or-later
// Surface: a mesh made ready to draw, whatever its source left out, and rays against meshes
// (layer: GUI, std only).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::viewer {

/// Edges sharper than this are drawn as lines and split the shading [rad].
inline constexpr double kCreaseAngle = 0.56;

/// Triangles and edge segments with every index in range and every number finite.
struct Surface {
  std::vector<float> positions;          ///< 3 per vertex [m]
  std::vector<float> normals;            ///< 3 per vertex, unit length
  std::vector<std::uint32_t> triangles;  ///< 3 indices each
  std::vector<float> segments;           ///< 6 per edge segment: both ends [m]
  Vec3 low{}, high{};                    ///< bounding box [m]; both 0 if there are no triangles
};

/// Makes a mesh drawable: drops triangles with bad indices or numbers, computes normals that break
/// at creases if the mesh has none, and finds the creases if the mesh names no feature edges.
[[nodiscard]] Surface surface_of(const Mesh& mesh);

/// Distance along the ray (unit direction, mesh coordinates) to the first triangle; nothing if the
/// ray misses. Both sides of a triangle count. [m]
[[nodiscard]] std::optional<double> first_hit(const Surface& surface, const Vec3& origin,
                                              const Vec3& direction);

}  // namespace robomosp::viewer
