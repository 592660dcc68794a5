// SPDX-License-Identifier: Apache-2.0
// Jets: numbers that carry their first and second derivative along (layer: data processing,
// spatial).
#pragma once

#include <array>
#include <cmath>

namespace robomosp::spatial {

/// f, f', f''.
struct Jet {
  double v = 0, d = 0, dd = 0;

  friend Jet operator+(const Jet& a, const Jet& b) { return {a.v + b.v, a.d + b.d, a.dd + b.dd}; }
  friend Jet operator-(const Jet& a, const Jet& b) { return {a.v - b.v, a.d - b.d, a.dd - b.dd}; }
  friend Jet operator*(const Jet& a, const Jet& b) {
    return {a.v * b.v, a.d * b.v + a.v * b.d, a.dd * b.v + 2 * a.d * b.d + a.v * b.dd};
  }
  friend Jet operator*(const Jet& a, double b) { return {a.v * b, a.d * b, a.dd * b}; }
};
/// f(a) by f, f' and f'' at a.v.
inline Jet chain(const Jet& a, double f, double f1, double f2) {
  return {f, f1 * a.d, f2 * a.d * a.d + f1 * a.dd};
}
inline Jet sqrt(const Jet& a) {
  const double r = std::sqrt(a.v);
  return chain(a, r, 0.5 / r, -0.25 / (r * a.v));
}
inline Jet inverse(const Jet& a) {
  const double r = 1 / a.v;
  return chain(a, r, -r * r, 2 * r * r * r);
}

using JetVector = std::array<Jet, 3>;
inline Jet dot(const JetVector& a, const JetVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline JetVector cross(const JetVector& a, const JetVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline JetVector scale(const JetVector& a, const Jet& s) { return {a[0] * s, a[1] * s, a[2] * s}; }
inline JetVector unit(const JetVector& a) { return scale(a, inverse(sqrt(dot(a, a)))); }

/// w, x, y, z.
using JetQuaternion = std::array<Jet, 4>;
/// The product of quaternions of jets or of plain numbers.
template <class T>
std::array<T, 4> multiply(const std::array<T, 4>& a, const std::array<T, 4>& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
template <class T>
std::array<T, 4> conjugate(const std::array<T, 4>& a) {
  return {a[0], a[1] * -1.0, a[2] * -1.0, a[3] * -1.0};
}
/// The unit quaternion of half the rotation vector: exp(v) turns by 2 |v|.
inline JetQuaternion exp(const JetVector& v) {
  const Jet x2 = dot(v, v);
  Jet c, s;  // cos |v| and sin |v| / |v|, both functions of x2 = |v|^2
  if (x2.v < 1e-4) {
    const double y = x2.v;
    c = chain(x2, 1 - y / 2 * (1 - y / 12 * (1 - y / 30)), -0.5 + y / 12 - y * y / 240,
              1.0 / 12 - y / 120);
    s = chain(x2, 1 - y / 6 * (1 - y / 20 * (1 - y / 42)), -1.0 / 6 + y / 60 - y * y / 1680,
              1.0 / 60 - y / 840);
  } else {
    const double x = std::sqrt(x2.v), y = x2.v, cos = std::cos(x), sinc = std::sin(x) / x;
    // d/dy with y = x^2: c' = -sinc/2, sinc' = (cos - sinc) / (2 y).
    const double sinc1 = (cos - sinc) / (2 * y);
    c = chain(x2, cos, -sinc / 2, -sinc1 / 2);
    s = chain(x2, sinc, sinc1, (-sinc / 2 - sinc1) / (2 * y) - (cos - sinc) / (2 * y * y));
  }
  const JetVector u = scale(v, s);
  return {c, u[0], u[1], u[2]};
}
/// The inverse of exp for w >= 0; turns of less than half a turn.
inline JetVector log(const JetQuaternion& q) {
  const JetVector u{q[1], q[2], q[3]};
  const Jet s2 = dot(u, u);
  // |v| / sin |v| as a function of s2 = sin^2 |v|.
  const double y = s2.v;
  Jet f;
  if (y < 1e-4) {
    f = chain(s2, 1 + y / 6 + 3 * y * y / 40, 1.0 / 6 + 3 * y / 20 + 15 * y * y / 112,
              3.0 / 20 + 15 * y / 56);
  } else {
    const double s = std::sqrt(y), w = q[0].v, x = std::atan2(s, w), g = x / s;
    // dx/dy = 1 / (2 s w); g' = (1/w - g) / (2 y).
    const double g1 = (1 / w - g) / (2 * y);
    f = chain(s2, g, g1, (1 / (2 * w * w * w) - g1) / (2 * y) - (1 / w - g) / (2 * y * y));
  }
  return scale(u, f);
}

/// Angular velocity and acceleration in the outer frame's axes.
struct TurnRates {
  std::array<double, 3> velocity{}, acceleration{};
};
/// Of the turn that a unit quaternion is: the vector parts of 2 q' q* and 2 q'' q*.
inline TurnRates turn_rates(const JetQuaternion& q) {
  using Plain = std::array<double, 4>;
  const Plain inverse{q[0].v, -q[1].v, -q[2].v, -q[3].v};
  const Plain turn = multiply(Plain{q[0].d, q[1].d, q[2].d, q[3].d}, inverse),
              bend = multiply(Plain{q[0].dd, q[1].dd, q[2].dd, q[3].dd}, inverse);
  return {{2 * turn[1], 2 * turn[2], 2 * turn[3]}, {2 * bend[1], 2 * bend[2], 2 * bend[3]}};
}
/// Of R = exp(phi) R0.
inline TurnRates turn_rates(const JetVector& phi) { return turn_rates(exp(scale(phi, Jet{0.5}))); }

}  // namespace robomosp::spatial
