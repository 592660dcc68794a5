// SPDX-License-Identifier: Apache-2.0
// Solids of revolution recognised by their triangles, such as imported wheels and rollers (layer:
// application, evaluation). [any thread]
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/round_outside.h>

namespace robomosp::evaluation {

/// Radius and z [m] of the circles of the hull of points that turn about z of a frame: those of the
/// greatest radii, from below to above, at most 24.
[[nodiscard]] std::vector<std::array<double, 2>> turned_profile(std::span<const Vec3> points,
                                                                const Pose& frame);

/// The outside of a mesh.
struct MeshRoundness {
  /// The surface of revolution or sphere on which the corners of its hull lie; null = none.
  std::shared_ptr<const RoundOutside> outside;
  /// Number of corners about the axis, in the circle with the fewest; 0 = it is not round, 8 to 23
  /// = a polygon that may be meant as round.
  std::size_t sides = 0;
};
/// Fewest sides of a regular prism that counts as a cylinder: its faces then lie less than 1 % of
/// the radius inside.
inline constexpr std::size_t kFewestRoundSides = 24;
/// A mesh is round if every circle of the hull's outline about some axis has corners all around it,
/// within 1e-3 of the radius, with gaps no larger than in a regular polygon of kFewestRoundSides. A
/// sphere: triangles with corners on it, up to rounding, make up two fifths of its surface.
/// Candidate axes are the principal ones of the hull and the normals of its largest faces.
[[nodiscard]] MeshRoundness mesh_roundness(const Mesh& mesh);

}  // namespace robomosp::evaluation
