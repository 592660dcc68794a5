// SPDX-License-Identifier: Apache-2.0
// The shapes of a solid for collision and contact: primitives and convex pieces where its CSG tree
// has them, else triangles (layer: application). Independent of collision libraries. [any thread]
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/round_outside.h>

namespace robomosp::evaluation {

/// Kinds that an engine accepts beyond those that all accept.
struct TakenShapes {
  bool cones = false, ellipsoids = false;
};
/// From the tags of its provider.
[[nodiscard]] TakenShapes taken_shapes(std::span<const std::string> tags);

/// A piece of a body, which is the union of its pieces.
struct ShapePiece {
  ShapeKind kind = ShapeKind::mesh;
  Vec3 sizes{};                      ///< as of Shape [m]
  std::shared_ptr<const Mesh> mesh;  ///< of mesh and convex; convex: the hull itself, closed
  Pose pose;                         ///< body_T_piece
  /// Of convex: those of the mesh in double precision.
  std::shared_ptr<const std::vector<Vec3>> corners = nullptr;

  /// Of convex: the cone that it is exactly (sizes of ShapeKind::cone); the mesh has polygons
  /// within 0.2 mm of its ends.
  std::optional<Vec3> cone = std::nullopt;

  /// Of convex: the ellipsoid that it is exactly (sizes of ShapeKind::ellipsoid); the mesh is
  /// within 0.5 % of its greatest half axis.
  std::optional<Vec3> ellipsoid = std::nullopt;

  /// Of mesh and convex: its outside if that is round.
  std::shared_ptr<const RoundOutside> outside = nullptr;
  /// Of an imported mesh: its corners about an axis, 0 = not round (MeshRoundness).
  std::size_t sides = 0;

  /// As passed to collision and physics engines; borrows mesh, corners and outside.
  [[nodiscard]] Shape shape(TakenShapes takes = {}) const {
    if (takes.cones && cone) return {ShapeKind::cone, *cone, nullptr, pose, {}};
    if (takes.ellipsoids && ellipsoid) return {ShapeKind::ellipsoid, *ellipsoid, nullptr, pose, {}};
    Shape s{kind, sizes, mesh.get(), pose, {}};
    if (corners) set_corners(s, *corners);
    set_outside(s, outside.get());
    return s;
  }
  /// Points with a hull that contains it, of mesh and convex, in the piece's frame [m].
  [[nodiscard]] std::vector<Vec3> points() const;
};

/// The mesh of a tree, such as from a cache.
using MeshOf = std::function<Result<std::shared_ptr<const Mesh>>(const CsgTree&)>;

/// The exact corners of a tree's solid; none where its engine does not list them.
using CornersOf = std::function<Result<std::vector<Vec3>>(const CsgTree&)>;

/// Boxes, cylinders and spheres are kept; cones and ellipsoids become convex pieces with `cone` or
/// `ellipsoid` set; a scaled primitive becomes the resulting primitive. Unions and patterns become
/// their pieces, also below a difference ((A + B) - C = (A - C) + (B - C)). The rest is convex if
/// the hull of its mesh has about its volume and no triangle lies deeper below the hull than 5e-4
/// of the extent, else the mesh. The round outside is kept with the triangles for solids of
/// revolution with bores, slots and rounded rims, and for imported meshes with corners on one.
[[nodiscard]] Result<std::vector<ShapePiece>> shape_pieces(const CsgTree& tree,
                                                           const MeshOf& mesh_of,
                                                           const CornersOf& corners_of);

}  // namespace robomosp::evaluation
