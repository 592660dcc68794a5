// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.collision/1: contact and distance between bodies at many configurations
// (layer: contract, std only).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <robomosp/sdk/params.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

enum class ShapeKind : std::int32_t {
  mesh = 0,      ///< triangles, counter-clockwise from outside; those of a file need not close
  box = 1,       ///< sizes: x, y, z; centred
  sphere = 2,    ///< sizes: radius
  cylinder = 3,  ///< sizes: radius, length along z; centred
  capsule = 4,   ///< sizes: radius, length of the straight part along z; centred
  convex = 5,    ///< the convex hull of the mesh's vertices, or of corners_of() if it has any
  /// sizes: radius at the lower end, at the upper end, length along z; centred. One radius may be
  /// 0. Only for engines with the tag "cones"; others get a hull.
  cone = 6,
  /// sizes: half axes x, y, z; centred. Only for engines with the tag "ellipsoids"; others get a
  /// hull.
  ellipsoid = 7,
};

/// One shape of a body. A body is the union of its shapes.
struct Shape {
  ShapeKind kind = ShapeKind::mesh;
  Vec3 sizes{};                ///< [m]
  const Mesh* mesh = nullptr;  ///< of mesh and convex [m]
  Pose pose;                   ///< body_T_shape
  Room room{};                 ///< set_corners()
};
/// The corners of a convex shape in double precision [m], which its mesh has rounded; borrowed.
inline void set_corners(Shape& s, std::span<const Vec3> corners) {
  s.room.words[0] = reinterpret_cast<std::uintptr_t>(corners.data());
  s.room.words[1] = corners.size();
}
/// Those that were set; none = the mesh's vertices are what there is.
[[nodiscard]] inline std::span<const Vec3> corners_of(const Shape& s) {
  return {reinterpret_cast<const Vec3*>(static_cast<std::uintptr_t>(s.room.words[0])),
          static_cast<std::size_t>(s.room.words[1])};
}
struct ShapedBody {
  std::vector<Shape> shapes;  ///< none = it touches nothing
};

/// A pair of bodies to be checked, by index into CollisionScene's bodies.
struct CollisionPair {
  std::int32_t a = 0, b = 0;
};

/// Answer for one pair at one sample.
struct PairDistance {
  /// [m]; <= 0 when the bodies touch, overlap or one contains the other: minus a depth where both
  /// shapes are convex, else 0
  double distance = 0;
  Vec3 on_a{}, on_b{};  ///< nearest points in the world; equal when distance <= 0 and no depth
};

/// Bodies bound to an engine. Immutable. [any thread]
class CollisionScene {
 public:
  virtual ~CollisionScene() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// poses: samples * bodies (body-fastest, world_T_body); out: samples * pairs (pair-fastest).
  /// Pairs farther apart than `interest` [m] may be answered with distance = interest.
  virtual Result<void> distances(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                                 double interest, std::span<PairDistance> out, Progress&) const = 0;
  /// out: samples * pairs, 1 where the bodies touch, overlap or one contains the other. Faster than
  /// distances.
  virtual Result<void> collisions(std::span<const Pose> poses, std::span<const CollisionPair> pairs,
                                  std::span<std::uint8_t> out, Progress&) const = 0;
};

/// Interface robomosp.collision/1. [any thread]
class CollisionEngine {
 public:
  using Interface = CollisionEngine;
  static constexpr const char* kInterfaceId = "robomosp.collision/1";
  virtual ~CollisionEngine() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
  /// Prepares bodies for queries; the meshes may be freed afterwards.
  virtual Result<std::unique_ptr<CollisionScene>> build(std::span<const ShapedBody> bodies,
                                                        const Params&, Progress&) const = 0;
};

}  // namespace robomosp
