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

/// Operations take any number of children, modifiers one, primitives none.
enum class CsgKind : std::int32_t {
  union_ = 0,        ///< all children together
  difference = 1,    ///< the first child minus all others
  intersection = 2,  ///< what all children share
  mirror = 3,
  linear_pattern = 4,
  circular_pattern = 5,
  fillet = 6,
  chamfer = 7,
  scale = 8,
  box = 16,
  cylinder = 17,
  cone = 18,
  sphere = 19,
  torus = 20,
  frustum = 21,
  wedge = 22,
  pyramid = 23,
  prism = 24,
  revolution = 25,
  imported = 26,
  custom = 27,  ///< expanded by the host (robomosp.primitive/1); no engine ever sees it
  ellipsoid = 28,
};

enum class CsgChildren : std::int32_t { none, one, any };

/// What a size may be.
enum class CsgRange : std::int32_t {
  positive,      ///< > 0
  not_negative,  ///< >= 0
  any,           ///< any finite number
  count,         ///< a whole number from 1 to 10,000
};

/// One size of a node.
struct CsgSize {
  std::string_view name;  ///< "" after the last
  std::string_view unit;  ///< "m", "rad" or "" (a plain number)
  CsgRange range = CsgRange::positive;
  bool required = true;
  double default_value = 0;  ///< when not required
};

/// Name and meaning of a kind of node and of its sizes, in order.
struct CsgNodeInfo {
  CsgKind kind = CsgKind::union_;
  std::string_view name;
  CsgChildren children = CsgChildren::none;
  std::array<CsgSize, 6> sizes{};
  std::string_view doc;
};

inline constexpr double kCsgFullTurn = 6.283185307179586;

/// box, cylinder, cone, frustum, wedge, pyramid and prism begin at z = 0; all but the prism are
/// centred on the z axis; sphere, ellipsoid and torus are centred on the origin, the torus' axis is
/// z.
inline constexpr std::array<CsgNodeInfo, 22> kCsgNodes{{
    {CsgKind::union_, "union", CsgChildren::any, {}, "All children together."},
    {CsgKind::difference, "difference", CsgChildren::any, {}, "The first child minus all others."},
    {CsgKind::intersection,
     "intersection",
     CsgChildren::any,
     {},
     "The common volume of all children."},
    {CsgKind::mirror,
     "mirror",
     CsgChildren::one,
     {{{"normal_x", "", CsgRange::any, false, 1},
       {"normal_y", "", CsgRange::any, false, 0},
       {"normal_z", "", CsgRange::any, false, 0},
       {"offset", "m", CsgRange::any, false, 0},
       {"keep", "", CsgRange::not_negative, false, 1}}},
     "The child mirrored at the plane with the given normal, offset along it from the node's "
     "origin; together with the child itself, or without it if keep is 0."},
    {CsgKind::linear_pattern,
     "linear_pattern",
     CsgChildren::one,
     {{{"count", "", CsgRange::count},
       {"dx", "m", CsgRange::any, false, 0},
       {"dy", "m", CsgRange::any, false, 0},
       {"dz", "m", CsgRange::any, false, 0}}},
     "count copies of the child, each moved by (dx, dy, dz) from the one before."},
    {CsgKind::circular_pattern,
     "circular_pattern",
     CsgChildren::one,
     {{{"count", "", CsgRange::count}, {"angle", "rad", CsgRange::any, false, kCsgFullTurn}}},
     "count copies of the child about the node's z axis, spread over the angle: a full turn has "
     "equal gaps all round, a smaller angle has copies at both ends."},
    {CsgKind::fillet,
     "fillet",
     CsgChildren::one,
     {{{"radius", "m"}}},
     "The child with the selected edges rounded."},
    {CsgKind::chamfer,
     "chamfer",
     CsgChildren::one,
     {{{"distance", "m"}}},
     "The child with the selected edges bevelled, the same distance on both faces."},
    {CsgKind::scale,
     "scale",
     CsgChildren::one,
     {{{"x", "", CsgRange::positive, false, 1},
       {"y", "", CsgRange::positive, false, 1},
       {"z", "", CsgRange::positive, false, 1}}},
     "The child stretched along the node's axes, from its origin, by factors from 0.001 to 1000."},
    {CsgKind::box,
     "box",
     CsgChildren::none,
     {{{"x", "m"}, {"y", "m"}, {"z", "m"}, {"fillet", "m", CsgRange::not_negative, false, 0}}},
     "Rectangular block x by y by z; fillet rounds all twelve edges (0 = sharp)."},
    {CsgKind::cylinder,
     "cylinder",
     CsgChildren::none,
     {{{"radius", "m"}, {"height", "m"}, {"fillet", "m", CsgRange::not_negative, false, 0}}},
     "Circular cylinder along z; fillet rounds both rims (0 = sharp)."},
    {CsgKind::cone,
     "cone",
     CsgChildren::none,
     {{{"base_radius", "m", CsgRange::not_negative},
       {"top_radius", "m", CsgRange::not_negative},
       {"height", "m"}}},
     "Cone or truncated cone along z; one of the radii may be 0."},
    {CsgKind::sphere, "sphere", CsgChildren::none, {{{"radius", "m"}}}, "Sphere about the origin."},
    {CsgKind::ellipsoid,
     "ellipsoid",
     CsgChildren::none,
     {{{"x", "m"}, {"y", "m"}, {"z", "m"}}},
     "Ellipsoid about the origin; x, y and z are its half axes."},
    {CsgKind::torus,
     "torus",
     CsgChildren::none,
     {{{"ring_radius", "m"}, {"tube_radius", "m"}}},
     "Ring about z; ring_radius is measured to the tube's centre."},
    {CsgKind::frustum,
     "frustum",
     CsgChildren::none,
     {{{"base_x", "m"},
       {"base_y", "m"},
       {"top_x", "m", CsgRange::not_negative},
       {"top_y", "m", CsgRange::not_negative},
       {"height", "m"}}},
     "Rectangle base_x by base_y at z = 0 joined to rectangle top_x by top_y at z = height; "
     "a top of 0 by 0 makes a pyramid, a top with one side 0 a ridge."},
    {CsgKind::wedge,
     "wedge",
     CsgChildren::none,
     {{{"x", "m"}, {"y", "m"}, {"z", "m"}, {"top_x", "m", CsgRange::not_negative, false, 0}}},
     "Block x by y by z with an inclined side towards +x, so that its top is top_x long (0 = a "
     "sharp edge); the base is centred on the z axis."},
    {CsgKind::pyramid,
     "pyramid",
     CsgChildren::none,
     {{{"sides", "", CsgRange::count},
       {"radius", "m"},
       {"top_radius", "m", CsgRange::not_negative, false, 0},
       {"height", "m"}}},
     "Regular pyramid with 3 or more sides; radius reaches to the corners, the first of which is "
     "on the x axis; a top_radius cuts its tip off, one equal to radius makes a regular prism."},
    {CsgKind::prism,
     "prism",
     CsgChildren::none,
     {{{"height", "m"}}},
     "The profile in the plane z = 0, extruded along z."},
    {CsgKind::revolution,
     "revolution",
     CsgChildren::none,
     {{{"angle", "rad", CsgRange::positive, false, kCsgFullTurn}}},
     "The profile, its x to the right and its y along z, in the half plane x >= 0 of the xz "
     "plane, revolved about z by the angle."},
    {CsgKind::imported,
     "imported",
     CsgChildren::none,
     {{{"scale", "", CsgRange::positive, false, 1}}},
     "A solid that came from a file: exact (B-rep) or a triangle mesh."},
    {CsgKind::custom,
     "custom",
     CsgChildren::none,
     {},
     "A primitive made by a plugin (robomosp.primitive/1) from its own parameters."},
}};

/// The row of a kind. [any thread]
[[nodiscard]] constexpr const CsgNodeInfo& csg_info(CsgKind kind) {
  for (const CsgNodeInfo& row : kCsgNodes)
    if (row.kind == kind) return row;
  return kCsgNodes[0];
}
/// The row of a name such as "box", or nullptr. [any thread]
[[nodiscard]] constexpr const CsgNodeInfo* csg_info(std::string_view name) {
  for (const CsgNodeInfo& row : kCsgNodes)
    if (row.name == name) return &row;
  return nullptr;
}
/// Number of sizes a kind has. [any thread]
[[nodiscard]] constexpr std::size_t csg_size_count(CsgKind kind) {
  const CsgNodeInfo& row = csg_info(kind);
  std::size_t n = 0;
  while (n < row.sizes.size() && !row.sizes[n].name.empty()) ++n;
  return n;
}

/// A piece of a profile's outline; it begins where the one before ended.
struct CsgCurve {
  enum class Kind : std::int32_t {
    line,    ///< points: end
    arc,     ///< points: a point in between, end
    spline,  ///< points: those it passes through, the last is its end (cubic, C2, natural ends,
             ///< parameters by chord length)
    circle,  ///< alone in its loop; points: centre, {radius, 0}
  };
  Kind kind = Kind::line;
  std::vector<std::array<double, 2>> points;  ///< [m]
  bool operator==(const CsgCurve&) const = default;
};

/// A closed outline; a straight line closes it when its last point is not its start.
struct CsgLoop {
  std::array<double, 2> start{};  ///< [m]; unused for a circle
  std::vector<CsgCurve> curves;
  bool operator==(const CsgLoop&) const = default;
};

/// A region of the plane: a loop within another is a hole in it, one within a hole an island. Loops
/// must not cross or touch.
struct CsgProfile {
  std::vector<CsgLoop> loops;
  bool operator==(const CsgProfile&) const = default;
};

/// What an `imported` node holds. Immutable, shared.
struct CsgGeometry {
  enum class Form : std::int32_t {
    brep,  ///< `brep`: text of Open CASCADE's BREP format, in millimetres
    mesh,  ///< `points` and `triangles`: counter-clockwise from outside, closed where it was so or
           ///< could be closed; operations that need a closed one refuse others
  };
  Form form = Form::brep;
  std::string brep;
  std::vector<double> points;             ///< 3 per vertex [m]
  std::vector<std::uint32_t> triangles;   ///< 3 vertex indices each
  std::array<std::uint64_t, 2> digest{};  ///< of the content; equal content, equal digest
  std::string source;                     ///< where it came from, for people
  /// Of a mesh that approximates a curved solid: its triangles are within this distance of it [m];
  /// 0 = the mesh is the solid.
  double deviation = 0;
};

/// One node of a flat tree. Nodes come parents first (pre-order); children keep their order.
struct CsgNode {
  CsgKind kind = CsgKind::box;
  std::int32_t parent = -1;       ///< index of the parent node, -1 for the root (node 0)
  Pose placement;                 ///< parent_T_node
  std::array<double, 6> sizes{};  ///< by kCsgNodes [m, rad or 1]; unused for operations
  std::string name;               ///< for messages
  std::shared_ptr<const CsgProfile> profile{};    ///< of a prism or revolution
  std::shared_ptr<const CsgGeometry> geometry{};  ///< of an imported node
  /// Edges that a fillet or chamfer works on, in the child's frame: `all`, or conditions joined by
  /// ` and `: `parallel x|y|z`, `straight`, `round`, `convex`, `concave`, `top`, `bottom`, `left`,
  /// `right`, `front`, `back` (edges that lie wholly at the greatest or least z, x, y),
  /// `near (x, y, z)` (the one edge next to a point, in metres). Empty means all.
  std::string select{};
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
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }
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

/// A face, edge or corner of a solid on which other parts can be placed.
struct CsgFeature {
  enum class Kind : std::int32_t {
    plane,     ///< point: centroid of the face, direction: outward normal
    cylinder,  ///< point: on the axis amid the face, direction: axis
    cone,      ///< the same
    sphere,    ///< point: centre
    torus,     ///< point: centre, direction: axis, radius: of the ring
    line,      ///< a straight edge; point: its middle, direction: along it
    circle,    ///< a round edge; point: centre, direction: axis
    corner,    ///< a vertex
    other,     ///< any other face; point: about its middle
  };
  Kind kind = Kind::other;
  Vec3 point{};         ///< [m]
  Vec3 direction{};     ///< unit length; zero if it has none
  double radius = 0;    ///< [m]; 0 if it has none
  double size = 0;      ///< area of a face [m^2], length of an edge [m], 0 of a corner
  bool inward = false;  ///< cylinder, cone, sphere: a hole's wall, its normal points to the axis
};

/// Interface robomosp.csg/1. An engine with a provider tagged "brep" is exact and refuses
/// imported meshes (ErrorCode::unsupported); one with the tag "mesh" takes them and works on
/// triangles throughout. [any thread]
class CsgEngine {
 public:
  using Interface = CsgEngine;
  static constexpr const char* kInterfaceId = "robomosp.csg/1";
  virtual ~CsgEngine() = default;
  /// What later versions of the SDK add, by its id (plugin.h); nullptr = not known.
  [[nodiscard]] virtual const void* extension(const char* /*id*/) const { return nullptr; }

  /// Evaluates the tree to a verified solid. A size that is not positive (or, where the table
  /// allows it, zero) and an empty result are errors that name the node. An operation within others
  /// that is empty is nothing to them, as an empty set is, with a note at it. Never returns a solid
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

  /// Faces, then edges, then corners, in an order that is the same for the same tree.
  virtual Result<std::vector<CsgFeature>> features(const CsgShape&, Progress&) const {
    return error(ErrorCode::unsupported, "this CSG engine does not list features");
  }
  /// What the plane z = 0 of `plane` (solid_T_plane) cuts out of the solid, in the plane's x and y;
  /// lines, arcs and circles are exact, other curves are splines within `chord` [m].
  virtual Result<CsgProfile> section(const CsgShape&, const Pose& /*plane*/, double /*chord*/,
                                     Progress&) const {
    return error(ErrorCode::unsupported, "this CSG engine does not compute sections");
  }
  /// The solid as CsgGeometry in its own frame: exact (brep), or the triangles of an engine with
  /// the tag "mesh", closed as all that it evaluates to. `digest` is left 0.
  virtual Result<CsgGeometry> geometry(const CsgShape&, Progress&) const {
    return error(ErrorCode::unsupported, "this CSG engine does not export geometry");
  }
};

}  // namespace robomosp
