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

/// What a mesh is from outside.
struct MeshRoundness {
  /// The surface of revolution or sphere on which the corners of its hull lie; null = none.
  std::shared_ptr<const RoundOutside> outside;
  /// Corners about the axis, in the circle with the fewest; 0 = it is not round, 8 to 23 = it may
  /// be meant round, and is a polygon.
  std::size_t sides = 0;
};
/// Sides from which on a regular prism counts as a cylinder: its faces then lie less than 1 % of
/// the radius within.
inline constexpr std::size_t kFewestRoundSides = 24;
/// Round where every circle of the hull's outline about some axis has corners all around, 1e-3 of
/// the radius beside it at most, none farther from the next than in a regular polygon of
/// kFewestRoundSides. A sphere: two fifths of its surface are triangles whose corners are on it up
/// to rounding. Axes that are looked at: the principal ones of the hull and the normals of its
/// largest faces.
[[nodiscard]] MeshRoundness mesh_roundness(const Mesh& mesh);

}  // namespace robomosp::evaluation
