// SPDX-License-Identifier: Apache-2.0
// The solid that a mesh bounds, an open one about: its pieces and whether a point is inside (layer:
// plugin, collision_fcl). Surfaces alone do not tell that one body is within another.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::collision_fcl {

struct MeshSolid {
  std::vector<Vec3> points;  ///< those at one place are one
  std::vector<std::array<std::uint32_t, 3>> triangles;
  bool is_closed = false;
  std::vector<Vec3> one_of_each_piece;  ///< a corner of each connected piece
};

[[nodiscard]] MeshSolid mesh_solid(const Mesh& mesh);

/// By rays to far away, whose crossings are counted with their sign, so that what is enclosed twice
/// is inside; a ray that passes next to an edge is not counted on. Where all do so, and where the
/// mesh is open, the winding number decides, which is a fraction near holes: above a half is
/// inside.
[[nodiscard]] bool contains(const MeshSolid& solid, const Vec3& point);

}  // namespace robomosp::collision_fcl
