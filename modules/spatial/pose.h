// SPDX-License-Identifier: Apache-2.0
// Poses: composition, inverse, transforms, Denavit-Hartenberg rows, joint motion; inline, plain
// doubles, no allocation (layer: data processing, spatial).
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include <robomosp/sdk/robot_model.h>
#include <robomosp/sdk/types.h>

#include "spatial/vec.h"

namespace robomosp::spatial {

struct SinCos {
  double sin = 0, cos = 1;
};

/// Sine and cosine that are exactly 0 or +-1 at multiples of a right angle, within 1e-15 rad
/// (growing with the angle as its rounding does). Keeps frames turned by right angles free of
/// 6e-17 residues, which would otherwise show up as forces and torques that are not there.
[[nodiscard]] inline SinCos sin_cos(double angle) {
  constexpr double kRight = std::numbers::pi / 2;
  const double turns = std::nearbyint(angle / kRight);
  if (std::fabs(angle - turns * kRight) <= 1e-15 * std::max(1.0, std::fabs(turns)) &&
      std::fabs(turns) < 1e9) {
    switch (static_cast<long long>(turns) & 3) {
      case 0: return {0, 1};
      case 1: return {1, 0};
      case 2: return {0, -1};
      default: return {-1, 0};
    }
  }
  return {std::sin(angle), std::cos(angle)};
}

/// a_T_c from a_T_b and b_T_c.
[[nodiscard]] inline Pose compose(const Pose& a, const Pose& b) {
  Pose c;
  for (std::size_t i = 0; i < 3; ++i) {
    const double x = a.R[3 * i], y = a.R[3 * i + 1], z = a.R[3 * i + 2];
    c.R[3 * i] = x * b.R[0] + y * b.R[3] + z * b.R[6];
    c.R[3 * i + 1] = x * b.R[1] + y * b.R[4] + z * b.R[7];
    c.R[3 * i + 2] = x * b.R[2] + y * b.R[5] + z * b.R[8];
    c.p[i] = x * b.p[0] + y * b.p[1] + z * b.p[2] + a.p[i];
  }
  return c;
}
/// R v: a direction of frame b in frame a.
[[nodiscard]] constexpr Vec3 rotate(const Pose& t, const Vec3& v) {
  return {t.R[0] * v[0] + t.R[1] * v[1] + t.R[2] * v[2],
          t.R[3] * v[0] + t.R[4] * v[1] + t.R[5] * v[2],
          t.R[6] * v[0] + t.R[7] * v[1] + t.R[8] * v[2]};
}
/// R^T v: a direction of frame a in frame b.
[[nodiscard]] constexpr Vec3 rotate_back(const Pose& t, const Vec3& v) {
  return {t.R[0] * v[0] + t.R[3] * v[1] + t.R[6] * v[2],
          t.R[1] * v[0] + t.R[4] * v[1] + t.R[7] * v[2],
          t.R[2] * v[0] + t.R[5] * v[1] + t.R[8] * v[2]};
}
/// A point of frame b in frame a.
[[nodiscard]] constexpr Vec3 transform(const Pose& t, const Vec3& p) {
  return add(rotate(t, p), t.p);
}
/// b_T_a from a_T_b.
[[nodiscard]] constexpr Pose inverse(const Pose& t) {
  Pose r;
  r.R = {t.R[0], t.R[3], t.R[6], t.R[1], t.R[4], t.R[7], t.R[2], t.R[5], t.R[8]};
  const Vec3 p = rotate_back(t, t.p);
  r.p = {0.0 - p[0], 0.0 - p[1], 0.0 - p[2]};
  return r;
}
/// Axis 0, 1 or 2 of frame b in frame a (a column of R).
[[nodiscard]] constexpr Vec3 axis(const Pose& t, std::size_t i) {
  return {t.R[i], t.R[i + 3], t.R[i + 6]};
}
[[nodiscard]] constexpr Pose translation(const Vec3& p) {
  Pose t;
  t.p = p;
  return t;
}
/// Rotation about the x, y or z axis by `angle` [rad]; exact at right angles.
[[nodiscard]] inline Pose rotation_x(double angle) {
  const SinCos a = sin_cos(angle);
  Pose t;
  t.R = {1, 0, 0, 0, a.cos, 0.0 - a.sin, 0, a.sin, a.cos};
  return t;
}
[[nodiscard]] inline Pose rotation_y(double angle) {
  const SinCos a = sin_cos(angle);
  Pose t;
  t.R = {a.cos, 0, a.sin, 0, 1, 0, 0.0 - a.sin, 0, a.cos};
  return t;
}
[[nodiscard]] inline Pose rotation_z(double angle) {
  const SinCos a = sin_cos(angle);
  Pose t;
  t.R = {a.cos, 0.0 - a.sin, 0, a.sin, a.cos, 0, 0, 0, 1};
  return t;
}

/// Standard Denavit-Hartenberg row: Rz(theta) Tz(d) Tx(a) Rx(alpha) [m, rad].
[[nodiscard]] inline Pose dh_pose(double a, double alpha, double d, double theta) {
  const SinCos t = sin_cos(theta), l = sin_cos(alpha);
  Pose r;
  r.R = {t.cos,
         0.0 - t.sin * l.cos,
         t.sin * l.sin,
         t.sin,
         t.cos * l.cos,
         0.0 - t.cos * l.sin,
         0,
         l.sin,
         l.cos};
  r.p = {a * t.cos, a * t.sin, d};
  return r;
}
/// Modified (Craig) row: Rx(alpha) Tx(a) Rz(theta) Tz(d) [m, rad].
[[nodiscard]] inline Pose mdh_pose(double a, double alpha, double d, double theta) {
  const SinCos t = sin_cos(theta), l = sin_cos(alpha);
  Pose r;
  r.R = {t.cos,         0.0 - t.sin,   0,    t.sin * l.cos, t.cos * l.cos, 0.0 - l.sin,
         t.sin * l.sin, t.cos * l.sin, l.cos};
  r.p = {a, 0.0 - d * l.sin, d * l.cos};
  return r;
}

/// placement * J(q): parent_T_joint of a joint at q [rad or m].
[[nodiscard]] inline Pose joint_pose(const Pose& placement, JointType type, double q) {
  Pose t = placement;
  if (type == JointType::revolute) {
    const SinCos a = sin_cos(q);
    for (std::size_t i = 0; i < 9; i += 3) {
      const double x = t.R[i], y = t.R[i + 1];
      t.R[i] = x * a.cos + y * a.sin;
      t.R[i + 1] = y * a.cos - x * a.sin;
    }
  } else {
    t.p = {t.p[0] + q * t.R[2], t.p[1] + q * t.R[5], t.p[2] + q * t.R[8]};
  }
  return t;
}

/// Rotation by a quaternion w x y z of any length but zero, row-major.
[[nodiscard]] inline std::array<double, 9> quaternion_rotation(const double* q) {
  const double s = 2 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double x = s * q[1], y = s * q[2], z = s * q[3];
  return {1 - y * q[2] - z * q[3], x * q[2] - z * q[0],     x * q[3] + y * q[0],
          x * q[2] + z * q[0],     1 - x * q[1] - z * q[3], y * q[3] - x * q[0],
          x * q[3] - y * q[0],     y * q[3] + x * q[0],     1 - x * q[1] - y * q[2]};
}

/// The joint variable of a joint of one coordinate, in the configuration q of its mechanism.
[[nodiscard]] inline double joint_value(const JointModel& joint, const double* q) {
  const double x = q[joint.q_index];
  return joint.is_coupled() ? joint.coupling.ratio * x + joint.coupling.offset : x;
}

/// parent_T_joint of any joint in the configuration q of its mechanism.
[[nodiscard]] inline Pose joint_pose(const JointModel& joint, const double* q) {
  switch (joint.type) {
    case JointType::revolute:
    case JointType::prismatic:
      return joint_pose(joint.placement, joint.type, joint_value(joint, q));
    case JointType::spherical: {
      Pose moved;
      moved.R = quaternion_rotation(q + joint.q_index);
      return compose(joint.placement, moved);
    }
    case JointType::free: {
      const double* own = q + joint.q_index;
      return compose(joint.placement, {quaternion_rotation(own + 3), {own[0], own[1], own[2]}});
    }
  }
  return joint.placement;
}

/// True when R is a rotation matrix to `tolerance` in every element of R R^T and det > 0, and all
/// numbers are finite.
[[nodiscard]] inline bool is_rigid(const Pose& t, double tolerance = 1e-9) {
  if (!is_finite(t.p)) return false;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      const double e = dot(axis(t, i), axis(t, j)) - (i == j ? 1.0 : 0.0);
      if (!(std::fabs(e) <= tolerance)) return false;
    }
  return dot(cross(axis(t, 0), axis(t, 1)), axis(t, 2)) > 0;
}

}  // namespace robomosp::spatial
