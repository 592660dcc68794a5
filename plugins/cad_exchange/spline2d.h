// SPDX-License-Identifier: Apache-2.0
// The spline of profiles: cubic, C2, natural ends, parameters by chord length (layer: plugin).
#pragma once

#include <array>
#include <span>
#include <vector>

namespace robomosp::cad_exchange {

using Point2 = std::array<double, 2>;

/// Through two points and more; neighbours must differ.
class NaturalSpline {
 public:
  explicit NaturalSpline(std::span<const Point2> points);
  [[nodiscard]] Point2 at(double t) const;  ///< t from 0 to length()
  [[nodiscard]] double length() const { return t_.back(); }
  [[nodiscard]] const std::vector<double>& parameters() const { return t_; }
  /// The same curve as cubic Bezier pieces: 3 n + 1 points for n pieces.
  [[nodiscard]] std::vector<Point2> bezier() const;

 private:
  std::vector<Point2> p_, m_;  // points, second derivatives
  std::vector<double> t_;
};

/// A B-spline, rational where weights are given.
struct BSpline {
  int degree = 3;
  std::vector<double> knots;  ///< points.size() + degree + 1, not falling
  std::vector<Point2> points;
  std::vector<double> weights;  ///< empty or one a point, > 0

  [[nodiscard]] bool is_sound() const;
  [[nodiscard]] Point2 at(double t) const;
  [[nodiscard]] double first() const { return knots[static_cast<std::size_t>(degree)]; }
  [[nodiscard]] double last() const { return knots[points.size()]; }
  /// Its ends and the parameters between where it may have a corner.
  [[nodiscard]] std::vector<double> corners() const;
};

/// Points through which a NaturalSpline follows the B-spline between two parameters without a
/// corner between; `error` becomes the greatest distance found between the two.
[[nodiscard]] std::vector<Point2> follow(const BSpline&, double from, double to, double tolerance,
                                         double& error);

}  // namespace robomosp::cad_exchange
