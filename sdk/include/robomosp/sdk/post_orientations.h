// SPDX-License-Identifier: Apache-2.0
// Help for posts: orientations as controllers write them, and sides of a wrist (layer: contract
// helper, inline only, not part of the ABI).
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include <robomosp/sdk/post.h>
#include <robomosp/sdk/post_numbers.h>

namespace robomosp::post {

/// How a controller writes an orientation. Angles in degrees.
enum class Orientation {
  zyx,              ///< Rz(1st) Ry(2nd) Rx(3rd): KUKA A B C, Nachi
  fixed_xyz,        ///< Rz(3rd) Ry(2nd) Rx(1st): FANUC W P R, Motoman, Mitsubishi
  xyz,              ///< Rx(1st) Ry(2nd) Rz(3rd): Staubli, Epson
  zyz,              ///< Rz(1st) Ry(2nd) Rz(3rd): Kawasaki O A T, Comau, Adept
  quaternion,       ///< scalar first, scalar >= 0: ABB
  rotation_vector,  ///< axis times angle [rad]: UR
};

/// Unit quaternion, scalar first and not negative, of a rotation matrix (row by row).
[[nodiscard]] inline std::array<double, 4> quaternion(const std::array<double, 9>& r) {
  // Shepperd's choice of the largest component, so that none is divided by a small one.
  const double t[4] = {r[0] + r[4] + r[8], r[0] - r[4] - r[8], r[4] - r[0] - r[8],
                       r[8] - r[0] - r[4]};
  const auto i = static_cast<std::size_t>(std::max_element(t, t + 4) - t);
  const double s = 2 * std::sqrt(std::max(0.0, 1 + t[i]));
  std::array<double, 4> q{};
  if (i == 0) q = {s / 4, (r[7] - r[5]) / s, (r[2] - r[6]) / s, (r[3] - r[1]) / s};
  if (i == 1) q = {(r[7] - r[5]) / s, s / 4, (r[1] + r[3]) / s, (r[2] + r[6]) / s};
  if (i == 2) q = {(r[2] - r[6]) / s, (r[1] + r[3]) / s, s / 4, (r[5] + r[7]) / s};
  if (i == 3) q = {(r[3] - r[1]) / s, (r[2] + r[6]) / s, (r[5] + r[7]) / s, s / 4};
  double n = 0;
  for (const double x : q) n += x * x;
  n = std::sqrt(n) * (q[0] < 0 ? -1.0 : 1.0);
  for (double& x : q) x = x / n + 0.0;
  return q;
}
/// Numbers of an orientation; the fourth counts for quaternions only. Where only the sum of two
/// angles is known, the one that is applied first is 0.
[[nodiscard]] inline std::array<double, 4> orientation(const std::array<double, 9>& r,
                                                       Orientation how) {
  constexpr double kSingular = 1e-9;
  const auto zyx = [&]() -> std::array<double, 3> {
    const double c = std::hypot(r[0], r[3]);
    const double b = std::atan2(-r[6], c);
    if (c < kSingular) return {std::atan2(-r[1], r[4]), b, 0};
    return {std::atan2(r[3], r[0]), b, std::atan2(r[7], r[8])};
  };
  switch (how) {
    case Orientation::zyx: {
      const auto a = zyx();
      return {a[0] * kDegree, a[1] * kDegree, a[2] * kDegree, 0};
    }
    case Orientation::fixed_xyz: {
      const auto a = zyx();
      return {a[2] * kDegree, a[1] * kDegree, a[0] * kDegree, 0};
    }
    case Orientation::xyz: {
      const double c = std::hypot(r[0], r[1]);
      const double b = std::atan2(r[2], c);
      if (c < kSingular) return {std::atan2(r[7], r[4]) * kDegree, b * kDegree, 0, 0};
      return {std::atan2(-r[5], r[8]) * kDegree, b * kDegree, std::atan2(-r[1], r[0]) * kDegree, 0};
    }
    case Orientation::zyz: {
      const double s = std::hypot(r[2], r[5]);
      const double b = std::atan2(s, r[8]);
      if (s < kSingular) {
        // Rz(a) Ry(0 or pi): all of the turn about z is given to the first angle.
        const double a = r[8] > 0 ? std::atan2(r[3], r[0]) : std::atan2(-r[3], -r[0]);
        return {a * kDegree, b * kDegree, 0, 0};
      }
      return {std::atan2(r[5], r[2]) * kDegree, b * kDegree, std::atan2(r[7], -r[6]) * kDegree, 0};
    }
    case Orientation::quaternion: return quaternion(r);
    case Orientation::rotation_vector: {
      const auto q = quaternion(r);
      const double n = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
      const double k = n < 1e-15 ? 2.0 : 2 * std::atan2(n, q[0]) / n;
      return {q[1] * k, q[2] * k, q[3] * k, 0};
    }
  }
  return {};
}
/// Position in mm and orientation of a pose.
struct Placed {
  std::array<double, 3> mm{};
  std::array<double, 4> ori{};
};
[[nodiscard]] inline Placed placed(const Pose& p, Orientation how) {
  return {{p.p[0] * 1000, p.p[1] * 1000, p.p[2] * 1000}, orientation(p.R, how)};
}
/// a * b.
[[nodiscard]] inline Pose product(const Pose& a, const Pose& b) {
  Pose out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.p[i] = a.p[i];
    for (std::size_t k = 0; k < 3; ++k) out.p[i] += a.R[3 * i + k] * b.p[k];
    for (std::size_t j = 0; j < 3; ++j) {
      out.R[3 * i + j] = 0;
      for (std::size_t k = 0; k < 3; ++k) out.R[3 * i + j] += a.R[3 * i + k] * b.R[3 * k + j];
    }
  }
  return out;
}
[[nodiscard]] inline Pose inverse(const Pose& a) {
  Pose out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.p[i] = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      out.R[3 * i + k] = a.R[3 * k + i];
      out.p[i] -= a.R[3 * k + i] * a.p[k];
    }
  }
  return out;
}

/// Whether two placements are one for a controller: 1 micrometre, 1e-5 degrees.
[[nodiscard]] inline bool same_place(const Pose& a, const Pose& b) {
  for (std::size_t i = 0; i < 3; ++i)
    if (!(std::fabs(a.p[i] - b.p[i]) < 1e-6)) return false;
  for (std::size_t i = 0; i < 9; ++i)
    if (!(std::fabs(a.R[i] - b.R[i]) < 1e-7)) return false;
  return true;
}

/// Whether the wrist is behind the lower arm, as axis 3 counts it (KUKA, ABB, Staubli): PostStatus
/// says whether the elbow is up, and with the shoulder behind the other sign of axis 3 puts it up.
[[nodiscard]] constexpr bool wrist_behind_lower_arm(std::uint32_t status) {
  return ((status & kPostElbowOther) != 0) != ((status & kPostShoulderBehind) != 0);
}

}  // namespace robomosp::post
