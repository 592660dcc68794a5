// SPDX-License-Identifier: GPL-3.0-or-later
// The little vector algebra that the camera, picking and playback share (layer: GUI, std only).
#pragma once

#include <cmath>

#include <robomosp/sdk/types.h>

namespace robomosp::viewer {

[[nodiscard]] inline Vec3 operator+(const Vec3& a, const Vec3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
[[nodiscard]] inline Vec3 operator-(const Vec3& a, const Vec3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
[[nodiscard]] inline Vec3 operator*(double s, const Vec3& a) {
  return {s * a[0], s * a[1], s * a[2]};
}
[[nodiscard]] inline double dot(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double norm(const Vec3& a) { return std::sqrt(dot(a, a)); }
[[nodiscard]] inline bool is_finite(const Vec3& a) {
  return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

/// Coordinates in a of the point p given in b.
[[nodiscard]] inline Vec3 transform(const Pose& a_T_b, const Vec3& p) {
  const auto& R = a_T_b.R;
  return {R[0] * p[0] + R[1] * p[1] + R[2] * p[2] + a_T_b.p[0],
          R[3] * p[0] + R[4] * p[1] + R[5] * p[2] + a_T_b.p[1],
          R[6] * p[0] + R[7] * p[1] + R[8] * p[2] + a_T_b.p[2]};
}

/// Coordinates in a of the direction d given in b.
[[nodiscard]] inline Vec3 rotate(const Pose& a_T_b, const Vec3& d) {
  return transform(Pose{a_T_b.R, {0, 0, 0}}, d);
}

/// Coordinates in b of the direction d given in a.
[[nodiscard]] inline Vec3 rotate_back(const Pose& a_T_b, const Vec3& d) {
  const auto& R = a_T_b.R;
  return {R[0] * d[0] + R[3] * d[1] + R[6] * d[2], R[1] * d[0] + R[4] * d[1] + R[7] * d[2],
          R[2] * d[0] + R[5] * d[1] + R[8] * d[2]};
}

/// True if every element is a finite number.
[[nodiscard]] inline bool is_finite(const Pose& pose) {
  for (const double x : pose.R)
    if (!std::isfinite(x)) return false;
  return is_finite(pose.p);
}

}  // namespace robomosp::viewer
