// SPDX-License-Identifier: Apache-2.0
// Plain value types that cross the plugin boundary (layer: contract, std only).
// Units are SI and radians, frames are right-handed, z points up. Nothing here owns an Eigen type.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace robomosp {

/// Three numbers: a position [m], a direction [-], or a vector of the quantity its name says.
using Vec3 = std::array<double, 3>;

/// Rigid placement a_T_b: maps coordinates of frame b to frame a, p_a = R p_b + p.
struct Pose {
  std::array<double, 9> R{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< rotation matrix, row-major, det = +1
  Vec3 p{0, 0, 0};                                     ///< origin of b in a [m]
};

/// Symmetric 3x3 matrix given by its *elements* (an inertia tensor's off-diagonal elements are
/// minus the products of inertia).
struct Sym3 {
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, xz = 0;
};

/// Mass, centre of mass and inertia about the centre of mass, all in one stated frame.
struct MassProperties {
  double mass = 0;  ///< [kg]
  Vec3 com{};       ///< centre of mass [m]
  Sym3 inertia;     ///< about the centre of mass, axes of the stated frame [kg m^2]
};

/// Red, green, blue in linear 0..1 and opacity (1 = opaque).
struct Colour {
  float r = 0.8F, g = 0.8F, b = 0.8F, a = 1.0F;
};

/// Reserved space in the elements of arrays and spans, which cannot grow at their end: what is
/// added to such a struct later lies here, and zero means "not given". Plugins leave it alone.
struct Room {
  std::array<std::uint64_t, 8> words{};
};

/// Triangles with normals for display, collision and export. Positions in metres.
struct Mesh {
  /// One face of the solid: a run of triangles. `id` stays the same while the face does.
  struct Face {
    std::uint32_t first_triangle = 0, triangle_count = 0;
    std::uint64_t id = 0;
  };
  std::vector<float> positions;          ///< 3 per vertex [m]
  std::vector<float> normals;            ///< 3 per vertex, unit length; same length as positions
  std::vector<std::uint32_t> triangles;  ///< 3 vertex indices each, counter-clockwise from outside
  std::vector<Face> faces;               ///< may be empty (mesh without known faces)
  std::vector<float> edge_points;  ///< 3 per point: the feature edges, polyline after polyline
  std::vector<std::uint32_t> edge_sizes;  ///< number of points of each polyline in edge_points

  [[nodiscard]] std::size_t vertex_count() const { return positions.size() / 3; }
  [[nodiscard]] std::size_t triangle_count() const { return triangles.size() / 3; }
};

}  // namespace robomosp
