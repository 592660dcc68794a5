// SPDX-License-Identifier: Apache-2.0
// Points of one coordinate passed without a stop, at given times, with cubics between them (layer:
// data processing, spatial).
#pragma once

#include <algorithm>
#include <cmath>

#include "spatial/jet.h"

namespace robomosp::spatial {

/// The rate at which a point is passed, from the displacements before and after it and their times
/// (> 0): that of the parabola through the three points, but 0 if the coordinate reverses or is at
/// rest, and at most three times the slower of both mean rates, so that no cubic overshoots its
/// ends (F. N. Fritsch, R. E. Carlson, Monotone Piecewise Cubic Interpolation, SIAM Journal on
/// Numerical Analysis 17 (2), 1980).
inline double passing_rate(double way_before, double time_before, double way_after,
                           double time_after) {
  const double a = way_before / time_before, b = way_after / time_after;
  if (!(a * b > 0)) return 0;
  const double most = 3 * std::min(std::fabs(a), std::fabs(b));
  return std::clamp((time_after * a + time_before * b) / (time_before + time_after), -most, most);
}

/// The cubic from 0 over the displacement `way` in `duration` > 0 with rates at both ends, at a
/// time in 0..duration.
inline Jet cubic(double way, double from_rate, double to_rate, double duration, double time) {
  const double h = duration, x = time / h, a = h * from_rate, b = h * to_rate;
  const double c = 3 * way - 2 * a - b, d = a + b - 2 * way;
  return {x * (a + x * (c + x * d)), (a + x * (2 * c + 3 * x * d)) / h,
          (2 * c + 6 * x * d) / (h * h)};
}
/// Its greatest absolute rate.
inline double greatest_rate(double way, double from_rate, double to_rate, double duration) {
  double most = std::max(std::fabs(from_rate), std::fabs(to_rate));
  const double a = cubic(way, from_rate, to_rate, duration, 0).dd,
               b = cubic(way, from_rate, to_rate, duration, duration).dd;
  if (a * b < 0)
    most = std::max(most,
                    std::fabs(cubic(way, from_rate, to_rate, duration, duration * a / (a - b)).d));
  return most;
}

}  // namespace robomosp::spatial
