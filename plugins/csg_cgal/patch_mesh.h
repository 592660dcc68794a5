// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles with their face of a primitive, and the surface approximated by that face (layer:
// plugin).
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "support.h"

namespace robomosp::csg_cgal {

/// The surface a patch of triangles lies on or approximates.
struct Patch {
  enum class Kind : std::uint8_t { plane, cylinder, cone, sphere, torus, free };
  Kind kind = Kind::free;
  std::uint64_t id = 0;   ///< stays the same while the face does
  Vec3 point{};           ///< on the plane, on the axis (cone: its tip), or the centre
  Vec3 axis{};            ///< of cylinder, cone and torus; the normal of a plane; unit length
  double radius = 0;      ///< of cylinder, sphere; of a torus' ring
  double tube = 0;        ///< of a torus; of a cone: tangent of the angle between axis and side
  double deviation = 0;   ///< triangles lie within this distance of the surface [m]
  double area_error = 0;  ///< relative error of the patch's area
  /// For a free patch made from another one by stretching: the map of offsets from the surface
  /// along the normal, and the greatest offset before [m].
  std::array<double, 9> stretch{1, 0, 0, 0, 1, 0, 0, 0, 1};
  double unstretched = 0;

  /// A normal of the surface near p, of either direction; zero if there is none.
  [[nodiscard]] Vec3 normal(const Vec3& p) const;
  /// Greatest distance of triangles with the unit normal n inside or outside of the surface [m].
  [[nodiscard]] double depth(const Vec3& n) const;
  /// Distance of p from the surface [m]; 0 for a free one.
  [[nodiscard]] double distance(const Vec3& p) const;
};
[[nodiscard]] Patch moved(Patch patch, const Affine& motion);

using Triangle = std::array<std::uint32_t, 3>;

struct PatchMesh {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;      ///< counter-clockwise from outside
  std::vector<std::uint32_t> patch_of;  ///< one a triangle
  std::vector<Patch> patches;

  [[nodiscard]] std::array<Vec3, 3> corners(std::size_t t) const {
    return {points[triangles[t][0]], points[triangles[t][1]], points[triangles[t][2]]};
  }
  /// Twice the area, along the outward normal.
  [[nodiscard]] Vec3 area_vector(std::size_t t) const {
    const auto [a, b, c] = corners(t);
    return cross(b - a, c - a);
  }
};

struct Box3 {
  Vec3 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
           std::numeric_limits<double>::infinity()};
  Vec3 high{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
            -std::numeric_limits<double>::infinity()};
  void add(const Vec3& p);
  void add(const Box3& b);
  [[nodiscard]] bool meets(const Box3& b) const;  ///< also if they only touch
  [[nodiscard]] double diagonal() const;
};
[[nodiscard]] Box3 box_of(const PatchMesh& mesh);
/// Signed volume of the polyhedron.
[[nodiscard]] double volume_of(const PatchMesh& mesh);
/// Integrals over the polyhedron, with a bound of the error that its patches make.
[[nodiscard]] Moments moments_of(const PatchMesh& mesh);
/// For each side k of each triangle, from its corner k on, the adjacent triangle. Nothing if a side
/// is not shared by exactly two triangles that run along it in opposite directions.
[[nodiscard]] std::optional<std::vector<Triangle>> neighbours_of(
    std::span<const Triangle> triangles, std::size_t corners);
/// For every triangle the number of its connected part; parts are connected by edges.
[[nodiscard]] std::vector<std::uint32_t> parts_of(std::span<const Triangle> neighbours);

}  // namespace robomosp::csg_cgal
