// SPDX-License-Identifier: Apache-2.0
// Interface robomosp.csg/1: CSG trees to exact solids, display meshes and moments
// (layer: contract, std only). Lengths in metres throughout; an engine may use other units inside.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

namespace robomosp {

/// Operations (take any number of children) and primitives (take none).
enum class CsgKind : std::int32_t {
  union_ = 0,        ///< all children together
  difference = 1,    ///< the first child minus all others
  intersection = 2,  ///< what all children share
  box = 16,
  cylinder = 17,
  cone = 18,
  sphere = 19,
  torus = 20,
  frustum = 21,
};

/// Names and meaning of a primitive's sizes, in order. Every size is a length [m].
/// box, cylinder, cone and frustum stand on z = 0 centred on the z axis; sphere and torus are
/// centred on the origin, the torus' axis is z.
struct CsgPrimitiveInfo {
  CsgKind kind;
  std::string_view name;
  std::array<std::string_view, 6> sizes;  ///< "" after the last
  std::string_view doc;
};
inline constexpr std::array<CsgPrimitiveInfo, 6> kCsgPrimitives{{
    {CsgKind::box,
     "box",
     {"x", "y", "z", "fillet", "", ""},
     "Rectangular block x by y by z; fillet rounds all twelve edges (0 = sharp)."},
    {CsgKind::cylinder,
     "cylinder",
     {"radius", "height", "fillet", "", "", ""},
     "Circular cylinder along z; fillet rounds both rims (0 = sharp)."},
    {CsgKind::cone,
     "cone",
     {"base_radius", "top_radius", "height", "", "", ""},
     "Cone or truncated cone along z; one of the radii may be 0."},
    {CsgKind::sphere, "sphere", {"radius", "", "", "", "", ""}, "Sphere about the origin."},
    {CsgKind::torus,
     "torus",
     {"ring_radius", "tube_radius", "", "", "", ""},
     "Ring about z; ring_radius is measured to the tube's centre."},
    {CsgKind::frustum,
     "frustum",
     {"base_x", "base_y", "top_x", "top_y", "height", ""},
     "Rectangle base_x by base_y at z = 0 joined to rectangle top_x by top_y at z = height; "
     "a top of 0 by 0 makes a pyramid."},
}};

/// One node of a flat tree. Nodes come parents first (pre-order); children keep their order.
struct CsgNode {
  CsgKind kind = CsgKind::box;
  std::int32_t parent = -1;       ///< index of the parent node, -1 for the root (node 0)
  Pose placement;                 ///< parent_T_node
  std::array<double, 6> sizes{};  ///< by kCsgPrimitives; unused for operations
  std::string name;               ///< for messages
};

struct CsgTree {
  std::vector<CsgNode> nodes;
};

/// Display mesh quality.
struct MeshQuality {
  double chord = 1e-4;  ///< greatest distance of a chord from the surface [m]
  double angle = 0.35;  ///< greatest angle between neighbouring normals [rad]
};

/// Density-free volume integrals about the frame's origin.
struct Moments {
  double volume = 0;  ///< [m^3]
  double area = 0;    ///< surface area [m^2]
  Vec3 first{};       ///< integral of x, y, z dV [m^4]
  Sym3 second;        ///< integral of x*x, y*y, z*z, x*y, y*z, x*z dV [m^5]
  bool exact = true;  ///< from the analytic surface, to rounding; false = from an approximation
  double relative_error = 0;  ///< estimate when not exact
};

/// An evaluated solid, made and understood by one engine only. Immutable. [any thread]
class CsgShape {
 public:
  virtual ~CsgShape() = default;
  /// Axis-aligned box {min, max} around the solid [m].
  [[nodiscard]] virtual std::array<Vec3, 2> bounds() const = 0;
  /// Remarks for the user: repairs made, pieces, what is only approximate.
  [[nodiscard]] virtual std::span<const std::string> notes() const = 0;
};

/// A shape at a place, for partition().
struct PlacedShape {
  std::shared_ptr<const CsgShape> shape;
  Pose placement;
};

/// Interface robomosp.csg/1. [any thread]
class CsgEngine {
 public:
  using Interface = CsgEngine;
  static constexpr const char* kInterfaceId = "robomosp.csg/1";
  virtual ~CsgEngine() = default;

  /// Evaluates the tree to a verified solid. A size that is not positive (or, where the table
  /// allows it, zero) and an empty result are errors that name the node. Never returns a solid
  /// that failed its check.
  virtual Result<std::shared_ptr<const CsgShape>> evaluate(const CsgTree& tree,
                                                           Progress&) const = 0;
  /// Closed triangle mesh with feature edges.
  virtual Result<Mesh> mesh(const CsgShape&, const MeshQuality&, Progress&) const = 0;
  /// Volume integrals about the origin of the tree's frame.
  virtual Result<Moments> moments(const CsgShape&, Progress&) const = 0;
  /// Moments of each part without the volume already claimed by an earlier part (one common frame,
  /// axes of the placements' parent): overlap counts once. `overlap` is the volume shared.
  struct Partition {
    std::vector<Moments> parts;
    double overlap = 0;  ///< [m^3]
  };
  virtual Result<Partition> partition(std::span<const PlacedShape> parts, Progress&) const = 0;
};

}  // namespace robomosp
