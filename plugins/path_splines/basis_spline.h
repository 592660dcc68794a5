// SPDX-License-Identifier: Apache-2.0
// Splines of any degree in the basis of B-splines: through points, or drawn by control points
// (layer: plugin). C. de Boor, A Practical Guide to Splines, Springer 1978.
#pragma once

#include <span>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp::path_splines {

/// What a spline does at an end, beside passing its point: derivatives of given orders.
struct EndCondition {
  bool is_start = true;
  int order = 1;  ///< of the derivative
  Vec3 value{};
};

/// Degree p, knots t_0..t_(m+p+1), m+1 control points.
struct BasisSpline {
  int degree = 3;
  std::vector<double> knots;
  std::vector<Vec3> points;

  [[nodiscard]] double start() const { return knots[static_cast<std::size_t>(degree)]; }
  [[nodiscard]] double end() const { return knots[points.size()]; }
  /// Derivatives 0..orders at u, seen from the piece behind it (before it at the end).
  void derivatives(double u, int orders, std::span<Vec3> out) const;
};

/// Clamped knots: first and last with multiplicity degree + 1, `inner` between them.
[[nodiscard]] std::vector<double> clamped_knots(int degree, double start,
                                                std::span<const double> inner, double end);

/// The spline of `degree` with degree - 1 continuous derivatives that passes points[i] at times[i]
/// (rising) and meets degree - 1 conditions at its ends. Its knots are the times.
[[nodiscard]] BasisSpline interpolate(int degree, std::span<const double> times,
                                      std::span<const Vec3> points,
                                      std::span<const EndCondition> ends);

/// The same without a knot at the degree - 1 inner points that are nearest to the ends (of an even
/// degree one more of them at the start): pieces there are one polynomial. At least degree + 1
/// points.
[[nodiscard]] BasisSpline interpolate_not_a_knot(int degree, std::span<const double> times,
                                                 std::span<const Vec3> points);

/// The closed one of an odd degree, 3 or 5: its first degree - 1 derivatives are the same at both
/// ends. First and last point are at the same position.
[[nodiscard]] BasisSpline interpolate_periodic(int degree, std::span<const double> times,
                                               std::span<const Vec3> points);

}  // namespace robomosp::path_splines
