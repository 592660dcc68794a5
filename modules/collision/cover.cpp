// SPDX-License-Identifier: Apache-2.0
#include "collision/cover.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision {
namespace {

using evaluation::ShapePiece;
using spatial::Box;

/// Spheres in which a piece is divided at most.
constexpr std::size_t kMostSpheres = 48;

std::size_t parts_along(double length, double edge) {
  return static_cast<std::size_t>(std::max(1.0, std::ceil(length / edge * (1 - 1e-9))));
}

void add_sphere(const Pose& body_T_piece, const Vec3& at, double radius, BodyCover& out) {
  const Vec3 p = spatial::transform(body_T_piece, at);
  out.spheres.push_back({{p[0], p[1], p[2]}, radius});
}

/// Around a segment of `length` along z and all within `radius` of it; a cylinder of that radius
/// has no round ends, and is within the same spheres.
void add_row(const ShapePiece& p, double radius, double length, BodyCover& out) {
  const std::size_t n = std::min(kMostSpheres, parts_along(length, std::max(radius, 1e-9)));
  const double part = length / static_cast<double>(n);
  for (std::size_t i = 0; i < n; ++i)
    add_sphere(p.pose, {0, 0, part * (static_cast<double>(i) + 0.5) - 0.5 * length},
               std::hypot(radius, 0.5 * part), out);
}

/// The cells of a box, each within a sphere; cells are cubes where there are not too many of them.
void add_cells(const ShapePiece& p, const Box& box, BodyCover& out) {
  double edge = 2 * *std::max_element(box.half.begin(), box.half.end());
  for (const double h : box.half)
    if (h > 0) edge = std::min(edge, 2 * h);
  std::array<std::size_t, 3> n{1, 1, 1};
  for (bool fits = !(edge > 0); !fits && edge < 1e300; edge *= 1.2) {
    double cells = 1;
    for (const double h : box.half) cells *= std::max(1.0, std::ceil(2 * h / edge * (1 - 1e-9)));
    fits = cells <= static_cast<double>(kMostSpheres);
    if (fits)
      for (std::size_t k = 0; k < 3; ++k) n[k] = parts_along(2 * box.half[k], edge);
  }
  Vec3 half{};
  for (std::size_t k = 0; k < 3; ++k) half[k] = box.half[k] / static_cast<double>(n[k]);
  const double radius = spatial::norm(half);
  for (std::size_t x = 0; x < n[0]; ++x)
    for (std::size_t y = 0; y < n[1]; ++y)
      for (std::size_t z = 0; z < n[2]; ++z) {
        const std::array<std::size_t, 3> cell{x, y, z};
        Vec3 at = box.centre;
        for (std::size_t k = 0; k < 3; ++k)
          at[k] += half[k] * (2 * static_cast<double>(cell[k]) + 1) - box.half[k];
        add_sphere(p.pose, at, radius, out);
      }
}

BodyCover::Still still_of(const ShapePiece& p, const Box& box) {
  BodyCover::Still out{};
  Pose at = p.pose;
  out.is_exact = !p.cone && !p.ellipsoid &&
                 (p.kind == ShapeKind::box || p.kind == ShapeKind::sphere ||
                  p.kind == ShapeKind::cylinder || p.kind == ShapeKind::capsule);
  if (!out.is_exact || p.kind == ShapeKind::box) {
    at.p = spatial::transform(p.pose, box.centre);
    std::copy(box.half.begin(), box.half.end(), out.shape.half);
  } else if (p.kind == ShapeKind::cylinder) {
    out.shape.is_cylinder = true;
    out.shape.half[0] = out.shape.half[1] = p.sizes[0];
    out.shape.half[2] = p.sizes[1] / 2;
  } else {
    out.shape.margin = p.sizes[0];
    if (p.kind == ShapeKind::capsule) out.shape.half[2] = p.sizes[1] / 2;
  }
  std::copy(at.R.begin(), at.R.end(), out.shape.R);
  std::copy(at.p.begin(), at.p.end(), out.shape.p);
  return out;
}

}  // namespace

Box box_in_piece(const ShapePiece& p) {
  if (p.cone) {
    const double r = std::max((*p.cone)[0], (*p.cone)[1]);
    return {{}, {r, r, (*p.cone)[2] / 2}};
  }
  if (p.ellipsoid) return {{}, *p.ellipsoid};
  switch (p.kind) {
    case ShapeKind::box: return {{}, spatial::scale(p.sizes, 0.5)};
    case ShapeKind::sphere: return {{}, {p.sizes[0], p.sizes[0], p.sizes[0]}};
    case ShapeKind::cylinder: return {{}, {p.sizes[0], p.sizes[0], p.sizes[1] / 2}};
    case ShapeKind::capsule: return {{}, {p.sizes[0], p.sizes[0], p.sizes[0] + p.sizes[1] / 2}};
    case ShapeKind::cone:
    case ShapeKind::ellipsoid:
    case ShapeKind::mesh:
    case ShapeKind::convex: break;
  }
  return spatial::box_around(p.points());
}

BodyCover cover_of(std::span<const ShapePiece> pieces) {
  BodyCover out;
  for (const ShapePiece& p : pieces) {
    const Box box = box_in_piece(p);
    out.shapes.push_back(still_of(p, box));
    const bool is_listed = p.cone || p.ellipsoid;
    if (!is_listed && p.kind == ShapeKind::sphere) {
      add_sphere(p.pose, {}, p.sizes[0], out);
      continue;
    }
    out.are_exact = false;
    if (!is_listed && (p.kind == ShapeKind::cylinder || p.kind == ShapeKind::capsule))
      add_row(p, p.sizes[0], p.sizes[1], out);
    else add_cells(p, box, out);
  }
  return out;
}

SearchSphere sphere_around(std::span<const SearchSphere> spheres) {
  SearchSphere out{};
  if (spheres.empty()) return out;
  Box box;
  for (std::size_t i = 0; i < spheres.size(); ++i) {
    const SearchSphere& s = spheres[i];
    const Box own{{s.centre[0], s.centre[1], s.centre[2]}, {s.radius, s.radius, s.radius}};
    box = i == 0 ? own : spatial::around(box, own);
  }
  std::copy(box.centre.begin(), box.centre.end(), out.centre);
  for (const SearchSphere& s : spheres)
    out.radius =
        std::max(out.radius,
                 s.radius + spatial::distance(box.centre, {s.centre[0], s.centre[1], s.centre[2]}));
  return out;
}

}  // namespace robomosp::collision
