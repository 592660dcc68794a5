// SPDX-License-Identifier: Apache-2.0
// Arithmetic on Vec3 and Sym3 with plain doubles, inline (layer: data processing, spatial).
#pragma once

#include <cmath>

#include <robomosp/sdk/types.h>

namespace robomosp::spatial {

[[nodiscard]] constexpr Vec3 add(const Vec3& a, const Vec3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] constexpr Vec3 sub(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] constexpr Vec3 scale(const Vec3& a, double s) {
  return {a[0] * s, a[1] * s, a[2] * s};
}
[[nodiscard]] constexpr double dot(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] constexpr Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
[[nodiscard]] inline double distance(const Vec3& a, const Vec3& b) { return norm(sub(a, b)); }
/// a / |a|; zero stays zero.
[[nodiscard]] inline Vec3 unit(const Vec3& a) {
  const double n = norm(a);
  return n > 0 ? scale(a, 1 / n) : a;
}
[[nodiscard]] inline bool is_finite(const Vec3& a) {
  return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}
[[nodiscard]] inline bool is_finite(const Sym3& s) {
  return std::isfinite(s.xx) && std::isfinite(s.yy) && std::isfinite(s.zz) && std::isfinite(s.xy) &&
         std::isfinite(s.yz) && std::isfinite(s.xz);
}

[[nodiscard]] constexpr Sym3 add(const Sym3& a, const Sym3& b) {
  return {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.yz + b.yz, a.xz + b.xz};
}
[[nodiscard]] constexpr Sym3 scale(const Sym3& a, double s) {
  return {a.xx * s, a.yy * s, a.zz * s, a.xy * s, a.yz * s, a.xz * s};
}
[[nodiscard]] constexpr Vec3 multiply(const Sym3& m, const Vec3& v) {
  return {m.xx * v[0] + m.xy * v[1] + m.xz * v[2], m.xy * v[0] + m.yy * v[1] + m.yz * v[2],
          m.xz * v[0] + m.yz * v[1] + m.zz * v[2]};
}

}  // namespace robomosp::spatial
