// SPDX-License-Identifier: Apache-2.0
#include "piecewise.h"

#include <algorithm>

#include "spatial/vec.h"

namespace robomosp::path_splines {

using spatial::add;
using spatial::scale;
using spatial::sub;

PiecewiseCurve::PiecewiseCurve(const BasisSpline& spline, std::vector<double> knots, bool is_timed)
    : degree_(static_cast<std::size_t>(spline.degree)),
      knots_(std::move(knots)),
      is_timed_(is_timed) {
  const double start = spline.start();
  std::vector<Vec3> d(degree_ + 1);
  for (std::size_t k = degree_; k < spline.points.size(); ++k) {
    if (!(spline.knots[k + 1] > spline.knots[k])) continue;
    breaks_.push_back(spline.knots[k] - start);
    spline.derivatives(spline.knots[k], spline.degree, d);
    double factorial = 1;
    for (std::size_t i = 0; i <= degree_; ++i) {
      if (i > 1) factorial *= static_cast<double>(i);
      coefficients_.push_back(scale(d[i], 1 / factorial));
    }
  }
  breaks_.push_back(spline.end() - start);
}

Result<void> PiecewiseCurve::evaluate(std::span<const double> u, std::span<CurveSample> out) const {
  std::size_t piece = 0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    if (u[i] < breaks_[piece] || u[i] >= breaks_[piece + 1]) {
      const auto next = std::upper_bound(breaks_.begin() + 1, breaks_.end() - 1, u[i]);
      piece = static_cast<std::size_t>(next - breaks_.begin()) - 1;
    }
    const double x = u[i] - breaks_[piece];
    const Vec3* c = coefficients_.data() + piece * (degree_ + 1);
    // Horner with derivatives: f, f', f''/2, f'''/6.
    CurveSample s;
    for (std::size_t a = 0; a < 3; ++a) {
      double f0 = 0, f1 = 0, f2 = 0, f3 = 0;
      for (std::size_t k = degree_ + 1; k-- > 0;) {
        f3 = f3 * x + f2;
        f2 = f2 * x + f1;
        f1 = f1 * x + f0;
        f0 = f0 * x + c[k][a];
      }
      s.p[a] = f0, s.d1[a] = f1, s.d2[a] = 2 * f2, s.d3[a] = 6 * f3;
    }
    out[i] = s;
  }
  return {};
}

BezierCurve::BezierCurve(std::vector<Vec3> points, double duration, std::vector<double> knots)
    : points_(std::move(points)),
      end_(duration > 0 ? duration : 1),
      is_timed_(duration > 0),
      knots_(std::move(knots)) {
  for (double& k : knots_) k *= end_;
}

Result<void> BezierCurve::evaluate(std::span<const double> u, std::span<CurveSample> out) const {
  const std::size_t n = points_.size() - 1;
  std::vector<Vec3> b;
  for (std::size_t i = 0; i < u.size(); ++i) {
    const double x = u[i] / end_;
    b = points_;
    CurveSample s;
    for (std::size_t left = n;; --left) {  // left + 1 points are left
      const auto m = static_cast<double>(n);
      if (left == 3) {
        const Vec3 third = sub(sub(b[3], scale(sub(b[2], b[1]), 3)), b[0]);
        s.d3 = scale(third, m * (m - 1) * (m - 2) / (end_ * end_ * end_));
      }
      if (left == 2)
        s.d2 = scale(add(sub(b[2], scale(b[1], 2)), b[0]), m * (m - 1) / (end_ * end_));
      if (left == 1) s.d1 = scale(sub(b[1], b[0]), m / end_);
      if (left == 0) break;
      for (std::size_t k = 0; k < left; ++k) b[k] = add(scale(b[k], 1 - x), scale(b[k + 1], x));
    }
    s.p = b[0];
    out[i] = s;
  }
  return {};
}

}  // namespace robomosp::path_splines
