// SPDX-License-Identifier: Apache-2.0
#include "geometry/mesh_mass.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/mesh_checks.h"
#include "spatial/vec.h"

namespace robomosp::geometry {
namespace {

using spatial::add;
using spatial::cross;
using spatial::dot;
using spatial::sub;

Vec3 corner(const Mesh& mesh, std::size_t triangle, std::size_t k) {
  const float* p =
      mesh.positions.data() + 3 * static_cast<std::size_t>(mesh.triangles[3 * triangle + k]);
  return {p[0], p[1], p[2]};
}

}  // namespace

// Signed tetrahedra from a point inside the box to every triangle; taking that point instead of
// the origin keeps the terms small where the solid lies far away. For a tetrahedron with corners
// 0, a, b, c and volume V = det/6: integral of x y = V/20 (sum_i x_i y_i + (sum x)(sum y)).
Result<Moments> moments(const Mesh& mesh, double deviation) {
  const MeshReport report = check(mesh);
  if (!report.is_closed)
    return error(ErrorCode::invalid_argument, report.problem,
                 "Mass properties need a closed mesh.");
  const auto box = *bounds(mesh);
  const Vec3 centre = spatial::scale(add(box[0], box[1]), 0.5);
  Moments m;
  m.exact = false;
  Vec3 first{};
  Sym3 second;
  double shell_second = 0;  // integral of the squared distance from the centre over the surface
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    const Vec3 a = sub(corner(mesh, t, 0), centre), b = sub(corner(mesh, t, 1), centre),
               c = sub(corner(mesh, t, 2), centre);
    const Vec3 n = cross(sub(b, a), sub(c, a));
    const double area = 0.5 * spatial::norm(n);
    m.area += area;
    const double volume = dot(a, cross(b, c)) / 6;
    m.volume += volume;
    const Vec3 s = add(a, add(b, c));
    shell_second += area / 12 * (dot(a, a) + dot(b, b) + dot(c, c) + dot(s, s));
    first = add(first, spatial::scale(s, volume / 4));
    const auto xy = [&](std::size_t i, std::size_t j) {
      return volume / 20 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + s[i] * s[j]);
    };
    second = spatial::add(second, {xy(0, 0), xy(1, 1), xy(2, 2), xy(0, 1), xy(1, 2), xy(0, 2)});
  }
  if (!(m.volume > 0))
    return error(ErrorCode::invalid_argument,
                 "the mesh encloses no volume, or its triangles face inwards",
                 "Orient its triangles counter-clockwise as seen from outside.");
  double farthest = 0;
  for (const Vec3& corner_of_box : box)
    for (const double x : corner_of_box) farthest = std::max(farthest, std::abs(x));
  // What lies between the mesh and the surface is a shell no thicker than this.
  const double gap = deviation + farthest * double{std::numeric_limits<float>::epsilon()};
  m.relative_error =
      std::max(gap * m.area / m.volume, gap * shell_second / (second.xx + second.yy + second.zz));
  m.first = add(first, spatial::scale(centre, m.volume));
  const auto shifted = [&](double about_centre, std::size_t i, std::size_t j) {
    return about_centre + centre[i] * first[j] + centre[j] * first[i] +
           m.volume * centre[i] * centre[j];
  };
  m.second = {shifted(second.xx, 0, 0), shifted(second.yy, 1, 1), shifted(second.zz, 2, 2),
              shifted(second.xy, 0, 1), shifted(second.yz, 1, 2), shifted(second.xz, 0, 2)};
  return m;
}

}  // namespace robomosp::geometry
