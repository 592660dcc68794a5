// SPDX-License-Identifier: Apache-2.0
// Triangles in a tree of boxes, against convex shapes that FCL knows only as polygons: cones and
// ellipsoids (layer: plugin, collision_fcl).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "convex.h"
#include "spatial/box.h"

namespace robomosp::collision_fcl {

class MeshTree {
 public:
  /// Neither may be empty; the tree keeps copies.
  MeshTree(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// The surface's nearest point to the core, in the core's frame: on_a of the core, on_b of the
  /// mesh; `beyond` when it is farther than `interest` [m], `overlap` as soon as a triangle meets
  /// the core. Exact as separation() is. [any thread]
  [[nodiscard]] Apart separation(const Core& core, const Pose& core_T_mesh, double interest) const;

 private:
  struct Node {
    spatial::Box box;
    std::uint32_t first = 0, count = 0;  ///< of triangles; 0 = a fork: `first` and the next node
  };

  std::vector<std::array<Vec3, 3>> corners_;
  std::vector<Node> nodes_;
};

}  // namespace robomosp::collision_fcl
