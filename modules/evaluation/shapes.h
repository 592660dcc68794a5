// SPDX-License-Identifier: Apache-2.0
// The shapes of a solid for collision and contact: primitives and convex pieces where its CSG tree
// has them, else triangles (layer: application). Knows no collision library. [any thread]
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include <robomosp/sdk/collision.h>
#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>

namespace robomosp::evaluation {

/// A piece of a body, which is the union of its pieces.
struct ShapePiece {
  ShapeKind kind = ShapeKind::mesh;
  Vec3 sizes{};                      ///< as of Shape [m]
  std::shared_ptr<const Mesh> mesh;  ///< of mesh and convex; convex: the hull itself, closed
  Pose pose;                         ///< body_T_piece

  /// As collision and physics engines take it; borrows the mesh.
  [[nodiscard]] Shape shape() const { return {kind, sizes, mesh.get(), pose}; }
};

/// The mesh of a tree, such as from a cache.
using MeshOf = std::function<Result<std::shared_ptr<const Mesh>>(const CsgTree&)>;

/// Boxes, cylinders and spheres stay what they are; unions and patterns become their pieces, also
/// below a difference ((A + B) - C = (A - C) + (B - C)); what is left is convex
/// where the hull of its mesh has about its volume and no triangle lies deeper below the hull than
/// 5e-4 of the extent, else the mesh.
[[nodiscard]] Result<std::vector<ShapePiece>> shape_pieces(const CsgTree& tree,
                                                           const MeshOf& mesh_of);

}  // namespace robomosp::evaluation
