// SPDX-License-Identifier: Apache-2.0
// The solid that a closed mesh bounds: its pieces and whether a point is inside (layer: plugin,
// collision_fcl). Surfaces alone do not tell that one body is within another.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::collision_fcl {

struct MeshSolid {
  std::vector<Vec3> points;  ///< those at one place are one
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Vec3> one_of_each_piece;  ///< a corner of each connected piece
};

[[nodiscard]] MeshSolid mesh_solid(const Mesh& mesh);

/// Whether every edge is run once in each direction, as often as there are sheets.
[[nodiscard]] bool is_closed(const MeshSolid& solid);
/// By rays to far away, whose crossings are counted; a ray that passes next to an edge is not
/// counted on, and where all do so, the winding number decides.
[[nodiscard]] bool contains(const MeshSolid& solid, const Vec3& point);

}  // namespace robomosp::collision_fcl
