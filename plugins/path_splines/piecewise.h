// SPDX-License-Identifier: Apache-2.0
// Curves of polynomial pieces, and Bezier curves (layer: plugin).
#pragma once

#include <array>
#include <vector>

#include <robomosp/sdk/curve.h>

#include "basis_spline.h"

namespace robomosp::path_splines {

/// Polynomials of one degree, one for each piece between breaks that rise from 0.
class PiecewiseCurve final : public Curve {
 public:
  /// The pieces of a spline, by its derivatives at every break.
  PiecewiseCurve(const BasisSpline&, std::vector<double> knots, bool is_timed);
  [[nodiscard]] double end() const override { return breaks_.back(); }
  [[nodiscard]] std::vector<double> knots() const override { return knots_; }
  [[nodiscard]] bool is_timed() const override { return is_timed_; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override;

 private:
  std::size_t degree_;
  std::vector<double> breaks_, knots_;
  std::vector<Vec3> coefficients_;  ///< degree + 1 of each piece, lowest first
  bool is_timed_;
};

/// Bernstein form, evaluated by de Casteljau's scheme.
class BezierCurve final : public Curve {
 public:
  BezierCurve(std::vector<Vec3> points, double duration, std::vector<double> knots);
  [[nodiscard]] double end() const override { return end_; }
  [[nodiscard]] std::vector<double> knots() const override { return knots_; }
  [[nodiscard]] bool is_timed() const override { return is_timed_; }
  Result<void> evaluate(std::span<const double> u, std::span<CurveSample> out) const override;

 private:
  std::vector<Vec3> points_;
  double end_;
  bool is_timed_;
  std::vector<double> knots_;
};

}  // namespace robomosp::path_splines
