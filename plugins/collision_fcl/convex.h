// SPDX-License-Identifier: Apache-2.0
// Convex shapes as a core with a margin; distances by closed forms if available, else by GJK
// (layer: plugin, collision_fcl).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <robomosp/sdk/collision.h>

#include "spatial/convex_hull.h"

namespace robomosp::collision_fcl {

/// A hull with the neighbours of its corners, for climbing to the extreme one.
struct HullData {
  spatial::Hull hull;
  std::vector<std::uint32_t> first, neighbours;  ///< of corner i: neighbours[first[i]..first[i+1]]
};
[[nodiscard]] HullData hull_data(spatial::Hull hull);

/// All points within `margin` of the core. Sphere: a point; capsule: a segment; others: margin 0.
struct Core {
  enum class Kind : std::int32_t { point, segment, box, cylinder, cone, ellipsoid, hull, triangle };
  Kind kind = Kind::point;
  /// box: half sizes; segment, cylinder, cone: [2] half length; cylinder: [0] radius; cone: [0]
  /// radius at the lower end, [1] at the upper one; ellipsoid: half axes
  Vec3 half{};
  double margin = 0;
  std::shared_ptr<const HullData> hull;
  std::array<Vec3, 3> corners{};  ///< of a triangle, used for meshes only
};

/// Relation of two shapes; points in the frame of the first.
struct Apart {
  enum class State : std::int32_t {
    apart,    ///< `distance` and points are valid; < 0 if only the margins overlap
    beyond,   ///< farther than `interest`
    overlap,  ///< the cores overlap or touch: `distance` is valid only if `is_exact`
  };
  State state = State::apart;
  double distance = 0;
  Vec3 on_a{}, on_b{};
  bool is_exact = true;
};

/// `a_T_b`: frame of b in that of a. Distances may be cut off at `interest` [m].
[[nodiscard]] Apart separation(const Core& a, const Core& b, const Pose& a_T_b, double interest);

/// Distance and nearest points in the world if a closed form exists: between spheres and capsules,
/// and for spheres outside boxes and cylinders; else false.
[[nodiscard]] bool closed_distance(const Core& a, const Pose& world_T_a, const Core& b,
                                   const Pose& world_T_b, PairDistance& out);

/// True when a point in the core's frame is in the shape, margin included.
[[nodiscard]] bool contains(const Core& core, const Vec3& point);

/// Farthest point of the core (without margin) in a direction of its frame.
[[nodiscard]] Vec3 support(const Core& core, const Vec3& direction, std::uint32_t& hint);

}  // namespace robomosp::collision_fcl
