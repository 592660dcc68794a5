// SPDX-License-Identifier: GPL-3.0-or-later
// Side of a plane in double precision with an error bound, for tests that may be undecided near it
// (layer: plugin).
#pragma once

#include <algorithm>
#include <cmath>

#include "support.h"

namespace robomosp::csg_cgal {

/// Greatest rounding error of a determinant, relative to the product of the greatest lengths along
/// the axes; 5.1e-15 by Shewchuk's count of the operations.
inline constexpr double kDeterminantError = 1e-14;

/// The sign of (b - a) x (c - a) . (p - a), or 0 if it is uncertain. Corners have errors of up to
/// `slack` along each axis [m].
inline int sure_side(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p, double slack) {
  const Vec3 u = b - a, v = c - a, w = p - a;
  const double d = dot(cross(u, v), w);
  double product = 1, longest = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double m = std::max({std::abs(u[i]), std::abs(v[i]), std::abs(w[i])});
    product *= m;
    longest = std::max(longest, m);
  }
  // Nine entries, each wrong by two slacks, times two others of at most `longest`, twice.
  const double moved = longest + 2 * slack;
  const double error = kDeterminantError * product + (slack > 0 ? 36 * slack * moved * moved : 0);
  return d > error ? 1 : d < -error ? -1 : 0;
}

}  // namespace robomosp::csg_cgal
