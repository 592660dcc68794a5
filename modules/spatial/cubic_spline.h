// SPDX-License-Identifier: Apache-2.0
// Cubic splines of several coordinates through values at knots (layer: data processing, spatial).
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace robomosp::spatial {

/// A cubic polynomial between two knots `h` apart, from values and rates at both: the coefficients
/// of the powers of the distance from the first.
inline std::array<double, 4> cubic_piece(double x0, double x1, double v0, double v1, double h) {
  const double d = (x1 - x0) / h;
  return {x0, v0, (3 * d - 2 * v0 - v1) / h, (v0 + v1 - 2 * d) / (h * h)};
}

/// Rates at the knots of the spline through rows of `width` values each, `step[i]` > 0 between rows
/// i and i + 1, with a continuous second derivative (L. Biagiotti, C. Melchiorri, Trajectory
/// Planning for Automatic Machines and Robots, 2008, section 4.4). Natural, with zero second
/// derivative, at an end without given rates. Two rows or more.
inline std::vector<double> cubic_spline_rates(std::size_t width, std::span<const double> values,
                                              std::span<const double> step,
                                              std::span<const double> start = {},
                                              std::span<const double> end = {}) {
  const std::size_t last = step.size();
  std::vector<double> rates(values.size()), upper(last + 1, 0.0);
  const auto slope = [&](std::size_t i, std::size_t j) {
    return (values[(i + 1) * width + j] - values[i * width + j]) / step[i];
  };
  // Elimination without pivoting: the matrix is diagonally dominant.
  for (std::size_t i = 0; i <= last; ++i) {
    const double before = i > 0 ? 1 / step[i - 1] : 0, after = i < last ? 1 / step[i] : 0;
    const std::span<const double> given = i == 0      ? start
                                          : i == last ? end
                                                      : std::span<const double>();
    const double low = given.empty() ? before : 0, high = given.empty() ? after : 0;
    const double pivot =
        (given.empty() ? 2 * (before + after) : 1) - (i > 0 ? low * upper[i - 1] : 0);
    upper[i] = high / pivot;
    for (std::size_t j = 0; j < width; ++j) {
      double side = 0;
      if (!given.empty()) side = given[j];
      else
        side = 3 * ((i > 0 ? slope(i - 1, j) * before : 0) + (i < last ? slope(i, j) * after : 0));
      if (i > 0) side -= low * rates[(i - 1) * width + j];
      rates[i * width + j] = side / pivot;
    }
  }
  for (std::size_t i = last; i-- > 0;)
    for (std::size_t j = 0; j < width; ++j)
      rates[i * width + j] -= upper[i] * rates[(i + 1) * width + j];
  return rates;
}

}  // namespace robomosp::spatial
