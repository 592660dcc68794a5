// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh as it is shown, in numbers of 32 bits, and the polylines of its sharp edges (layer:
// plugin).
#pragma once

#include <span>

#include "patch_mesh.h"

namespace robomosp::csg_cgal {

/// The mesh as it is after rounding to float: corners at one place are one, triangles that shrank
/// to a line or point are gone, those that now lie back to back too.
struct Rounded {
  PatchMesh mesh;
  bool is_same = true;  ///< triangles and corners are those of the given mesh
};

[[nodiscard]] Rounded rounded(const PatchMesh& in);

/// A side of triangles with the two that share it; four where solids touch.
struct Side {
  std::uint32_t low, high;
  std::uint32_t first = ~0U, second = ~0U;
  bool is_crowded = false;
};
[[nodiscard]] std::vector<Side> sides_of(const PatchMesh& mesh);

/// A chain of sharp sides between the same two faces. Closed when its ends are one corner.
struct Chain {
  std::vector<std::uint32_t> corners;
  std::array<std::uint32_t, 2> patches{};
};

/// `neighbours` of the triangles, or none where they are not known.
[[nodiscard]] std::vector<Chain> chains_of(const PatchMesh& mesh,
                                           std::span<const Triangle> neighbours);

/// Normal of a triangle's surface at a point, on the triangle's side of it; the triangle's own
/// where the surface is not known.
[[nodiscard]] Vec3 normal_at(const PatchMesh& mesh, std::uint32_t t, const Vec3& p);
[[nodiscard]] double angle_between(const Vec3& a, const Vec3& b);

}  // namespace robomosp::csg_cgal
