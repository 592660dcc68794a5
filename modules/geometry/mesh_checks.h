// SPDX-License-Identifier: Apache-2.0
// Whether a triangle mesh bounds a solid, and its box (layer: data processing, geometry). [any
// thread]
#pragma once

#include <array>
#include <optional>
#include <string>

#include <robomosp/sdk/types.h>

namespace robomosp::geometry {

/// What a check of a mesh found. Vertices at exactly the same position count as one, so that
/// normals may differ along edges.
struct MeshReport {
  bool is_closed = false;      ///< every edge is used as often in one direction as in the other
  std::size_t open_edges = 0;  ///< edges with a triangle on one side only
  std::size_t bad_edges = 0;   ///< edges used unequally, or twice by the same triangle
  std::size_t degenerate = 0;  ///< triangles with two corners at one position
  std::size_t pieces = 0;      ///< parts that are not connected by an edge
  std::string problem;         ///< a sentence, empty when closed
};

/// Checks indices, numbers and edges. Indices out of range and numbers that are not finite leave
/// the mesh not closed, with the problem reported.
[[nodiscard]] MeshReport check(const Mesh& mesh);

/// Axis-aligned box {min, max} of the vertices [m]; nullopt without vertices.
[[nodiscard]] std::optional<std::array<Vec3, 2>> bounds(const Mesh& mesh);

}  // namespace robomosp::geometry
