// SPDX-License-Identifier: GPL-3.0-or-later
#include "self_cuts.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>

#include "signs.h"

namespace robomosp::csg_cgal {
namespace {

using Plain = CGAL::Exact_predicates_inexact_constructions_kernel;
using Pair = std::array<std::uint32_t, 2>;

/// Part of the sum of the products that rounding adds to m . (p - q), at most.
constexpr double kDotError = 1e-15;
constexpr std::size_t kParts = 64;

Plain::Point_3 plain(const Vec3& p) { return {p[0], p[1], p[2]}; }

/// The sign of m . (p - q), or 0 where it is not certain.
int sure_sign(const Vec3& m, const Vec3& p, const Vec3& q) {
  double sum = 0, size = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double x = m[i] * (p[i] - q[i]);
    sum += x;
    size += std::abs(x);
  }
  return sum > kDotError * size ? 1 : sum < -kDotError * size ? -1 : 0;
}

bool same_side(const std::array<Vec3, 3>& t, const Vec3& p, const Vec3& q) {
  const int side = sure_side(t[0], t[1], t[2], p, 0);
  return side != 0 && side == sure_side(t[0], t[1], t[2], q, 0);
}

/// Triangles from u to v and to apexes p and q: apart but for that side unless folded flat.
bool cut_at_side(const Vec3& u, const Vec3& v, const Vec3& p, const Vec3& q) {
  if (sure_side(u, v, p, q, 0) != 0) return false;
  // Two half planes about the side that are more than a right angle apart.
  const Vec3 way = v - u, to_p = p - u, to_q = q - u;
  if (dot(cross(way, to_p), cross(way, to_q)) <
      -kDeterminantError * dot(way, way) * norm(to_p) * norm(to_q))
    return false;
  const auto a = plain(u), b = plain(v), c = plain(p), d = plain(q);
  return CGAL::coplanar(a, b, c, d) && CGAL::coplanar_orientation(a, b, c, d) == CGAL::POSITIVE;
}

/// Triangles v a b and v c d.
bool cut_at_corner(const Vec3& v, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  if (same_side({v, a, b}, c, d) || same_side({v, c, d}, a, b)) return false;
  // A plane through v between them.
  const Vec3 m = unit(unit(a - v) + unit(b - v)) - unit(unit(c - v) + unit(d - v));
  if (sure_sign(m, a, v) > 0 && sure_sign(m, b, v) > 0 && sure_sign(m, c, v) < 0 &&
      sure_sign(m, d, v) < 0)
    return false;
  const Plain::Point_3 V = plain(v), A = plain(a), B = plain(b), C = plain(c), D = plain(d);
  return CGAL::do_intersect(Plain::Triangle_3(V, A, B), Plain::Segment_3(C, D)) ||
         CGAL::do_intersect(Plain::Triangle_3(V, C, D), Plain::Segment_3(A, B));
}

bool cut_apart(const std::array<Vec3, 3>& t, const std::array<Vec3, 3>& u) {
  const auto clear = [](const std::array<Vec3, 3>& x, const std::array<Vec3, 3>& y) {
    const int side = sure_side(x[0], x[1], x[2], y[0], 0);
    return side != 0 && side == sure_side(x[0], x[1], x[2], y[1], 0) &&
           side == sure_side(x[0], x[1], x[2], y[2], 0);
  };
  if (clear(t, u) || clear(u, t)) return false;
  // A direction along which they lie one after the other.
  const auto apart_along = [&](const Vec3& m) {
    for (const auto& [x, y] : {std::pair{&t, &u}, std::pair{&u, &t}}) {
      bool is_so = true;
      for (const Vec3& p : *x)
        for (const Vec3& q : *y) is_so = is_so && sure_sign(m, p, q) > 0;
      if (is_so) return true;
    }
    return false;
  };
  const Vec3 n = cross(t[1] - t[0], t[2] - t[0]), w = cross(u[1] - u[0], u[2] - u[0]);
  for (std::size_t k = 0; k < 3; ++k)
    if (apart_along(cross(n, t[(k + 1) % 3] - t[k])) ||
        apart_along(cross(w, u[(k + 1) % 3] - u[k])))
      return false;
  return CGAL::do_intersect(Plain::Triangle_3(plain(t[0]), plain(t[1]), plain(t[2])),
                            Plain::Triangle_3(plain(u[0]), plain(u[1]), plain(u[2])));
}

bool cut(const PatchMesh& mesh, std::uint32_t t, std::uint32_t u) {
  const Triangle &a = mesh.triangles[t], &b = mesh.triangles[u];
  std::array<std::size_t, 3> in_a{}, in_b{};
  std::size_t shared = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      if (a[i] == b[j]) {
        in_a[shared] = i;
        in_b[shared++] = j;
      }
  const auto p = mesh.corners(t), q = mesh.corners(u);
  switch (shared) {
    case 0: return cut_apart(p, q);
    case 1:
      return cut_at_corner(p[in_a[0]], p[(in_a[0] + 1) % 3], p[(in_a[0] + 2) % 3],
                           q[(in_b[0] + 1) % 3], q[(in_b[0] + 2) % 3]);
    case 2:
      return cut_at_side(p[in_a[0]], p[in_a[1]], p[3 - in_a[0] - in_a[1]],
                         q[3 - in_b[0] - in_b[1]]);
    default: return true;  // back to back
  }
}

}  // namespace

std::optional<Pair> self_cut(const PatchMesh& mesh, const BoxTree& tree, const Host& host) {
  // The least pair of each share, so that threads make no difference.
  std::array<std::optional<Pair>, kParts> found;
  std::array<std::exception_ptr, kParts> thrown;
  host.spread(kParts, host.cores(), [&](std::size_t part) {
    auto& least = found[part];
    try {
      tree.pairs_within(part, kParts, [&](std::uint32_t t, std::uint32_t u) {
        const Pair pair{std::min(t, u), std::max(t, u)};
        if ((!least || pair < *least) && cut(mesh, t, u)) least = pair;
      });
    } catch (...) {
      thrown[part] = std::current_exception();
    }
  });
  for (const std::exception_ptr& t : thrown)
    if (t) std::rethrow_exception(t);
  std::optional<Pair> least;
  for (const auto& f : found)
    if (f && (!least || *f < *least)) least = f;
  return least;
}

}  // namespace robomosp::csg_cgal
