// SPDX-License-Identifier: GPL-3.0-or-later
#include "inside.h"

#include <algorithm>
#include <cmath>

#include "signs.h"

namespace robomosp::csg_cgal {
namespace {

/// Counts the crossings of the segment from p to q, outside, with the solid's surface; nothing when
/// it meets an edge or a corner, or begins on the surface.
class Crossings {
 public:
  Crossings(const ExactSolid& solid, const Point& p, const Vec3& rounded_p, double slack)
      : solid_(solid), p_(p), rounded_p_(rounded_p), slack_(slack + solid.impl().slack) {}

  [[nodiscard]] std::optional<bool> is_odd(const Vec3& q) const {
    Box3 way;
    way.add(rounded_p_);
    way.add(q);
    for (std::size_t i = 0; i < 3; ++i) {
      way.low[i] -= slack_;
      way.high[i] += slack_;
    }
    const Point far = exact_point(q);
    bool is_clear = true, odd = false;
    solid_.tree().meeting(way, [&](std::uint32_t t) {
      if (!is_clear) return;
      const int n = crossing(t, q, far);
      if (n < 0) is_clear = false;
      if (n > 0) odd = !odd;
    });
    if (!is_clear) return std::nullopt;
    return odd;
  }

 private:
  /// 1 = it crosses the triangle's inside, 0 = it does not meet it, -1 = neither.
  [[nodiscard]] int crossing(std::uint32_t t, const Vec3& q, const Point& far) const {
    const auto c = solid_.mesh().corners(t);
    const int near_side = sure_side(c[0], c[1], c[2], rounded_p_, slack_);
    const int far_side = sure_side(c[0], c[1], c[2], q, slack_);
    if (near_side != 0 && near_side == far_side) return 0;
    std::array<int, 3> turns{};
    for (std::size_t k = 0; k < 3; ++k)
      turns[k] = sure_side(rounded_p_, q, c[k], c[(k + 1) % 3], slack_);
    if (std::find(turns.begin(), turns.end(), 1) != turns.end() &&
        std::find(turns.begin(), turns.end(), -1) != turns.end())
      return 0;
    // Close: exactly.
    std::array<Point, 3> e;
    for (std::size_t k = 0; k < 3; ++k) e[k] = solid_.impl().exact(solid_.mesh().triangles[t][k]);
    const auto own = CGAL::orientation(e[0], e[1], e[2], p_);
    const auto its = CGAL::orientation(e[0], e[1], e[2], far);
    if (own != CGAL::ZERO && own == its) return 0;
    std::array<CGAL::Sign, 3> signs;
    for (std::size_t k = 0; k < 3; ++k) signs[k] = CGAL::orientation(p_, far, e[k], e[(k + 1) % 3]);
    const bool has_plus = std::find(signs.begin(), signs.end(), CGAL::POSITIVE) != signs.end();
    const bool has_minus = std::find(signs.begin(), signs.end(), CGAL::NEGATIVE) != signs.end();
    if (has_plus && has_minus) return 0;
    const bool is_on_edge = std::find(signs.begin(), signs.end(), CGAL::ZERO) != signs.end();
    return own == CGAL::ZERO || its == CGAL::ZERO || is_on_edge ? -1 : 1;
  }

  const ExactSolid& solid_;
  const Point& p_;
  Vec3 rounded_p_;
  double slack_;
};

}  // namespace

std::optional<bool> is_inside(const ExactSolid& solid, const std::array<Point, 3>& triangle,
                              const std::array<Vec3, 3>& rounded, double slack) {
  const Box3& box = solid.box();
  const double margin = slack + solid.impl().slack;
  for (const Vec3& p : rounded)
    for (std::size_t i = 0; i < 3; ++i)
      if (p[i] < box.low[i] - margin || p[i] > box.high[i] + margin) return false;
  const double reach = 2 * box.diagonal();
  // Almost along an axis, so that the box round the segment is thin.
  const auto target = [&](const Vec3& from, std::size_t n) {
    const std::size_t axis = n % 3;
    const double way = n % 2 == 0 ? 1 : -1;
    Vec3 q = from;
    q[axis] += way * reach;
    q[(axis + 1) % 3] += 1e-3 * reach * (0.37 + 0.11 * static_cast<double>(n));
    q[(axis + 2) % 3] -= 1e-3 * reach * (0.23 + 0.07 * static_cast<double>(n));
    return q;
  };
  const auto try_from = [&](const Point& p, const Vec3& p_rounded,
                            double p_slack) -> std::optional<bool> {
    const Crossings crossings(solid, p, p_rounded, p_slack);
    for (std::size_t n = 0; n < 6; ++n)
      if (const auto odd = crossings.is_odd(target(p_rounded, n))) return odd;
    return std::nullopt;
  };
  for (std::size_t k = 0; k < 3; ++k)
    if (const auto known = try_from(triangle[k], rounded[k], slack)) return known;
  const Point middle = CGAL::centroid(triangle[0], triangle[1], triangle[2]);
  double middle_slack = slack;
  const Vec3 at = csg_cgal::rounded(middle, middle_slack);
  return try_from(middle, at, middle_slack);
}

}  // namespace robomosp::csg_cgal
