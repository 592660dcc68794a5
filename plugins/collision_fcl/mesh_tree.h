// SPDX-License-Identifier: Apache-2.0
// Triangles in a tree of boxes: distances of two meshes, and of a mesh and a convex shape
// (layer: plugin, collision_fcl).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "convex.h"
#include "spatial/box.h"

namespace robomosp::collision_fcl {

/// What is farther than this [m] need not be looked at, when something is `least` away: within the
/// tolerance of it, and no nearer than half.
[[nodiscard]] inline double enough(double least, double tolerance) {
  return tolerance > 0 ? std::max(least - tolerance, 0.5 * least) : least;
}

class MeshTree {
 public:
  /// Neither may be empty; the tree keeps copies.
  MeshTree(std::span<const Vec3> points, std::span<const std::array<std::uint32_t, 3>> triangles);

  /// The surface's nearest point to the core, in the core's frame: on_a of the core, on_b of the
  /// mesh; `beyond` when it is farther than `interest` [m], `overlap` as soon as a triangle meets
  /// the core. Exact as separation() is; with a `tolerance` [m] the distance may be too small by up
  /// to it, but not by more than half, and is never too great, and the points are at most that much
  /// farther apart; of what is beyond the interest it is then a bound, too. [any thread]
  [[nodiscard]] Apart separation(const Core& core, const Pose& core_T_mesh, double interest,
                                 double tolerance = 0) const;
  /// The same of two surfaces; points in the frame of this one, on_a on it. [any thread]
  [[nodiscard]] Apart separation(const MeshTree& other, const Pose& this_T_other, double interest,
                                 double tolerance = 0) const;

 private:
  struct Node {
    spatial::Box box;                    ///< along the axes of the mesh
    Pose tight;                          ///< mesh_T_box of a box along the surface itself
    Vec3 half{};                         ///< of that one
    double radius = 0;                   ///< of the ball around it
    std::uint32_t first = 0, count = 0;  ///< of triangles; 0 = a fork: `first` and the next node
  };
  /// `turned` of each triangle: the box around it along the tight box.
  static void make_tight(Node& node, std::span<const std::uint32_t> triangles,
                         std::span<const std::array<Vec3, 3>> corners,
                         std::span<spatial::Box> turned);

  std::vector<std::array<Vec3, 3>> corners_;
  std::vector<Node> nodes_;
};

}  // namespace robomosp::collision_fcl
