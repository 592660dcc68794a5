// SPDX-License-Identifier: Apache-2.0
// Subproblems of closed-form inverse kinematics: rotations about given axes that align directions
// (Paden 1986, Kahan; Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation,
// 1994, section 3.2; Elias and Wen, IK-Geo, 2022); inline, no allocation (layer: data processing,
// spatial).
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::spatial {

/// v rotated about the unit axis h (Rodrigues).
[[nodiscard]] inline Vec3 turned(const Vec3& h, const SinCos& t, const Vec3& v) {
  const Vec3 side = cross(h, v);
  const double along = dot(h, v) * (1 - t.cos);
  return {t.cos * v[0] + t.sin * side[0] + along * h[0],
          t.cos * v[1] + t.sin * side[1] + along * h[1],
          t.cos * v[2] + t.sin * side[2] + along * h[2]};
}

/// Subproblem 1: the rotation about h that aligns the component of v normal to h with that of w.
/// `size` receives the product of the lengths of these components: 0 = any rotation is a solution.
[[nodiscard]] inline SinCos turn_between(const Vec3& h, const Vec3& v, const Vec3& w,
                                         double* size = nullptr) {
  const double s = dot(h, cross(v, w)), c = dot(v, w) - dot(h, v) * dot(h, w);
  const double n = std::hypot(s, c);
  if (size) *size = n;
  return n > 0 ? SinCos{s / n, c / n} : SinCos{};
}

/// Solves a cos t + b sin t = c, the core of subproblems 3 and 4. Without a solution, both results
/// are the nearest angle, and `gap` is the residual, in the unit of a, b and c.
struct CosineAnswer {
  std::array<SinCos, 2> turn;
  double gap = 0;   ///< |c| - sqrt(a^2 + b^2) where positive
  double root = 0;  ///< sqrt(a^2 + b^2 - c^2): 0 if both solutions coincide
};
[[nodiscard]] inline CosineAnswer solve_cosine(double a, double b, double c) {
  CosineAnswer out;
  const double n = std::hypot(a, b);
  if (!(n > 0)) {
    out.gap = std::fabs(c);
    return out;
  }
  out.gap = std::max(0.0, std::fabs(c) - n);
  const double k = std::clamp(c / n, -1.0, 1.0), r = std::sqrt((1 - k) * (1 + k));
  out.root = n * r;
  const double ca = a / n, sa = b / n;
  out.turn[0] = {sa * k + ca * r, ca * k - sa * r};
  out.turn[1] = {sa * k - ca * r, ca * k + sa * r};
  return out;
}

/// The real roots of a2 cos 2t + b2 sin 2t + a1 cos t + b1 sin t + a0, at most 4, from the four
/// roots of the polynomial in exp(i t) (Durand-Kerner) and Newton's method. A pair that has just
/// left the real axis is returned as its point of least distance.
struct TrigonometricRoots {
  std::array<double, 4> t{};
  int count = 0;
};
[[nodiscard]] inline TrigonometricRoots trigonometric_roots(double a2, double b2, double a1,
                                                            double b1, double a0) {
  using C = std::complex<double>;
  constexpr double kOffCircle = 1e-5;
  TrigonometricRoots out;
  const double scale = std::fabs(a2) + std::fabs(b2) + std::fabs(a1) + std::fabs(b1);
  const auto keep = [&](double t) {
    for (int i = 0; i < 4; ++i) {
      const double c = std::cos(t), s = std::sin(t), c2 = c * c - s * s, s2 = 2 * s * c;
      const double f = a2 * c2 + b2 * s2 + a1 * c + b1 * s + a0;
      const double d = 2 * (b2 * c2 - a2 * s2) + b1 * c - a1 * s;
      if (std::fabs(d) < 1e-9 * scale) break;
      const double step = f / d;
      if (std::fabs(step) > 1e-2) break;
      t -= step;
      if (std::fabs(step) < 1e-16) break;
    }
    out.t[static_cast<std::size_t>(out.count++)] = t;
  };
  if (std::hypot(a2, b2) <= 1e-13 * scale) {
    const CosineAnswer simple = solve_cosine(a1, b1, -a0);
    if (simple.gap <= 1e-9 * scale)
      for (const SinCos& x : simple.turn) keep(std::atan2(x.sin, x.cos));
    return out;
  }
  // conj(c2) + conj(c1) z + c0 z^2 + c1 z^3 + c2 z^4, divided by c2.
  const C c2{a2 / 2, -b2 / 2}, c1{a1 / 2, -b1 / 2};
  const auto times = [](C x, C y) {  // without the library's handling of infinities
    return C{x.real() * y.real() - x.imag() * y.imag(), x.real() * y.imag() + x.imag() * y.real()};
  };
  const auto over = [&](C x, C y) {
    const double n = y.real() * y.real() + y.imag() * y.imag();
    return times(x, C{y.real() / n, -y.imag() / n});
  };
  const C p3 = over(c1, c2), p2 = over(C{a0, 0}, c2), p1 = over(std::conj(c1), c2),
          p0 = over(std::conj(c2), c2);
  std::array<C, 4> z{C{0.9, 0.3}, C{-0.4, 0.95}, C{-0.8, -0.6}, C{0.5, -1.1}};
  for (int i = 0; i < 200; ++i) {
    double moved = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      C f = z[k] + p3;
      f = times(f, z[k]) + p2;
      f = times(f, z[k]) + p1;
      f = times(f, z[k]) + p0;
      C d{1, 0};
      for (std::size_t m = 0; m < 4; ++m)
        if (m != k) d = times(d, z[k] - z[m]);
      if (d == C{}) d = C{1e-30, 0};
      const C step = over(f, d);
      z[k] -= step;
      moved = std::max(moved, std::fabs(step.real()) + std::fabs(step.imag()));
    }
    if (moved < 1e-13) break;
  }
  for (const C& root : z)
    if (std::fabs(std::abs(root) - 1) < kOffCircle) keep(std::arg(root));
  return out;
}

}  // namespace robomosp::spatial
