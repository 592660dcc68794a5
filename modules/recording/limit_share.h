// SPDX-License-Identifier: Apache-2.0
// How near a recorded value is to its limits (layer: application).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace robomosp::recording {

/// Whether limits give a scale: both are finite, the upper one above the lower one, or one is
/// finite and allows 0.
[[nodiscard]] inline bool has_limit_share(double lower, double upper) {
  const bool has_lower = std::isfinite(lower), has_upper = std::isfinite(upper);
  if (has_lower && has_upper) return lower < upper;
  return (has_lower && lower < 0) || (has_upper && upper > 0);
}

/// How near a value is to its limits. Two finite ones: 0 halfway between them, 1 at either, more
/// outside. One: its fraction of that limit, 0 on the other side of zero. NaN where the limits give
/// no scale, and for a value that is NaN.
[[nodiscard]] inline double limit_share(double lower, double upper, double value) {
  if (!has_limit_share(lower, upper) || std::isnan(value))
    return std::numeric_limits<double>::quiet_NaN();
  if (!std::isfinite(lower)) return std::max(0.0, value / upper);
  if (!std::isfinite(upper)) return std::max(0.0, value / lower);
  return std::fabs(value - (lower / 2 + upper / 2)) / (upper / 2 - lower / 2);
}

}  // namespace robomosp::recording
