// SPDX-License-Identifier: Apache-2.0
// CurveWalk: a curve parametrised by its arc length (layer: data processing, motion).
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/curve.h>
#include <robomosp/sdk/result.h>

namespace robomosp::motion {

/// Evaluates a curve at the fraction w of its arc length: |dp/dw| = length() everywhere. Immutable.
/// [any thread]
///
/// The parameter u as a function of arc length s is a quintic Hermite spline through exact values
/// of u, du/ds = 1/|d1| and d2u/ds2 = -(d1.d2)/|d1|^4, refined until its arc length, measured by
/// Gauss-Legendre quadrature, is within kLengthTolerance of the whole. Positions lie on the curve
/// exactly; only their spacing has that error.
class CurveWalk {
 public:
  static constexpr double kLengthTolerance = 1e-12;

  /// A curve with a vanishing tangent is an error that gives the position.
  static Result<CurveWalk> build(std::shared_ptr<const Curve>);
  /// By the parameter itself, w = u/end: for timed and even curves.
  static Result<CurveWalk> by_parameter(std::shared_ptr<const Curve>);

  [[nodiscard]] double length() const { return length_; }  ///< [m]
  /// Fraction of the length at every control point.
  [[nodiscard]] Result<std::vector<double>> knot_shares() const;
  /// out[i] at w[i] (held within 0..1), derivatives with respect to w.
  Result<void> evaluate(std::span<const double> w, std::span<CurveSample> out) const;

 private:
  /// u over one interval of s: u0 + polynomial in x = (s - s0) / h.
  struct Piece {
    double s0 = 0, h = 0;
    std::array<double, 6> c{};  ///< coefficients of the parameter in powers of x
  };
  [[nodiscard]] double parameter(double s, std::size_t& hint) const;
  Result<void> refine(double u0, double u1, int depth);

  std::shared_ptr<const Curve> curve_;
  double length_ = 0;
  std::vector<Piece> pieces_;  ///< none: by the parameter itself
};

}  // namespace robomosp::motion
