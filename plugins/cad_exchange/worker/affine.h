// SPDX-License-Identifier: Apache-2.0
// Affine maps as files place their parts with, and what of them is a rigid motion (layer: plugin).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include <robomosp/sdk/types.h>

namespace robomosp::cad_exchange {

/// Columns of a placement that are further from a rotation than this are baked into the points.
inline constexpr double kRigid = 1e-6;

/// p = m * q + t
struct Affine {
  std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
  Vec3 t{};
};

inline Vec3 apply(const Affine& a, const Vec3& p) {
  Vec3 out = a.t;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) out[i] += a.m[3 * i + j] * p[j];
  return out;
}

inline Affine operator*(const Affine& a, const Affine& b) {
  Affine out;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      out.m[3 * i + j] = 0;
      for (std::size_t k = 0; k < 3; ++k) out.m[3 * i + j] += a.m[3 * i + k] * b.m[3 * k + j];
    }
  out.t = apply(a, b.t);
  return out;
}

inline double determinant(const std::array<double, 9>& m) {
  return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
         m[2] * (m[3] * m[7] - m[4] * m[6]);
}

/// The rotation nearest to the directions of the columns (Gram-Schmidt), right-handed.
inline Pose rigid_part(const Affine& a) {
  Pose out;
  out.p = a.t;
  std::array<Vec3, 3> c{};
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i) c[j][i] = a.m[3 * i + j];
  const auto dot = [](const Vec3& x, const Vec3& y) {
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  };
  const auto normalise = [&](Vec3& v) {
    const double n = std::sqrt(dot(v, v));
    if (!(n > 0) || !std::isfinite(n)) return false;
    for (double& x : v) x /= n;
    return true;
  };
  if (!normalise(c[0])) return out;
  const double along = dot(c[1], c[0]);
  for (std::size_t i = 0; i < 3; ++i) c[1][i] -= along * c[0][i];
  if (!normalise(c[1])) return out;
  c[2] = {c[0][1] * c[1][2] - c[0][2] * c[1][1], c[0][2] * c[1][0] - c[0][0] * c[1][2],
          c[0][0] * c[1][1] - c[0][1] * c[1][0]};
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i) out.R[3 * i + j] = c[j][i];
  return out;
}

/// inverse(t) * a
inline Affine inverse_times(const Pose& t, const Affine& a) {
  Affine inv;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) inv.m[3 * i + j] = t.R[3 * j + i];
  Affine shifted = a;
  for (std::size_t i = 0; i < 3; ++i) shifted.t[i] -= t.p[i];
  return inv * shifted;
}

inline Affine as_affine(const Pose& t) { return {t.R, t.p}; }

inline Affine scaled(double s) { return {{s, 0, 0, 0, s, 0, 0, 0, s}, {}}; }

}  // namespace robomosp::cad_exchange
