// SPDX-License-Identifier: GPL-3.0-or-later
// Surface: a mesh completed for drawing, and rays against meshes (layer: GUI, std only).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::viewer {

/// Edges sharper than this are drawn as lines and split the shading [rad].
inline constexpr double kCreaseAngle = 0.56;

/// Triangles and edge segments with every index in range and every number finite.
struct Surface {
  std::vector<float> positions;          ///< 3 per vertex [m]
  std::vector<float> normals;            ///< 3 per vertex, unit length
  std::vector<std::uint32_t> triangles;  ///< 3 indices each
  std::vector<float> segments;           ///< 6 per edge segment: both ends [m]
  std::vector<float> along;              ///< 2 per edge segment: distance from the start of its
                                         ///< line [m]
  std::vector<std::uint32_t> face_of;    ///< per triangle: number of its face; empty = unknown
  Vec3 low{}, high{};                    ///< bounding box [m]; both 0 if there are no triangles
  bool is_closed = false;  ///< every edge has a triangle on either side, and all triangles face
                           ///< outwards
};

/// Makes a mesh drawable: drops triangles with bad indices or numbers, computes normals that break
/// at creases if the mesh has none, and finds the creases if the mesh names no feature edges.
[[nodiscard]] Surface surface_of(const Mesh& mesh);

/// For each vertex the number of the first vertex at the same position, up to rounding: seams are
/// often computed twice.
[[nodiscard]] std::vector<std::uint32_t> welded(const Surface& surface);

/// An edge of the surface between two triangles, or at the border of one.
struct MeshEdge {
  std::uint32_t a = 0, b = 0;         ///< vertices; a unique one for each position
  std::uint32_t left = 0, right = 0;  ///< triangles; equal at a border
};
/// All edges with one or two triangles, for finding contours.
[[nodiscard]] std::vector<MeshEdge> edges_of(const Surface& surface);

/// Line segments, with the distance along their line.
struct Segments {
  std::vector<float> ends;   ///< 6 per segment [m]
  std::vector<float> along;  ///< 2 per segment [m]
};
/// The contour as seen from `eye` (mesh coordinates; is_point = false: from the direction `eye`):
/// the edges between a triangle that faces the eye and one that does not, joined to lines.
[[nodiscard]] Segments contour_of(const Surface& surface, const std::vector<MeshEdge>& edges,
                                  const Vec3& eye, bool is_point);

/// Edges between smoothly joined faces without a feature edge, such as a fillet and its neighbour.
[[nodiscard]] Segments tangent_edges_of(const Surface& surface, const std::vector<MeshEdge>& edges);

/// The section of a closed surface by a plane.
struct Cut {
  std::vector<float> positions;          ///< 3 per vertex, in the world [m]
  std::vector<std::uint32_t> triangles;  ///< 3 indices each: the cut face
  Segments outline;                      ///< its border
};
/// The cut face of the surface placed at `pose` and the plane through `point` with the unit vector
/// `normal`, all in the world: points with a nonzero winding number belong to it, so holes stay
/// open. Gaps of a surface that is not closed are not filled. [m]
[[nodiscard]] Cut cut_of(const Surface& surface, const Pose& pose, const Vec3& point,
                         const Vec3& normal);

/// Distance along the ray (unit direction, mesh coordinates) to the first triangle; nothing if the
/// ray misses. Both sides of a triangle count. [m]
[[nodiscard]] std::optional<double> first_hit(const Surface& surface, const Vec3& origin,
                                              const Vec3& direction);

}  // namespace robomosp::viewer
