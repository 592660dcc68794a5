// SPDX-License-Identifier: Apache-2.0
// The solid bounded by a mesh, approximate for an open one: its pieces, and a point-in-solid test
// (layer: plugin, collision_fcl). Surfaces alone do not show that one body is inside another.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::collision_fcl {

struct MeshSolid {
  std::vector<Vec3> points;  ///< coincident ones are merged
  std::vector<std::array<std::uint32_t, 3>> triangles;
  bool is_closed = false;
  std::vector<Vec3> one_of_each_piece;  ///< a corner of each connected piece
};

[[nodiscard]] MeshSolid mesh_solid(const Mesh& mesh);

/// Uses rays to infinity with signed counts of crossings, so that space enclosed twice is inside; a
/// ray that passes near an edge is ignored. If all do, or the mesh is open, the winding number
/// decides, which is fractional near holes: above one half is inside.
[[nodiscard]] bool contains(const MeshSolid& solid, const Vec3& point);

}  // namespace robomosp::collision_fcl
