// SPDX-License-Identifier: Apache-2.0
#include "spatial/rotation.h"

#include <cmath>
#include <numbers>

#include "spatial/pose.h"

namespace robomosp::spatial {
namespace {

// atan2 into (-pi, pi]: a zero of either sign counts as +0, so that half turns give +pi.
double angle_between_axes(double sin, double cos) {
  const double a = std::atan2(sin + 0.0, cos);
  return a <= -std::numbers::pi ? std::numbers::pi : a;
}
double negated(double angle) { return angle >= std::numbers::pi ? angle : 0.0 - angle; }

}  // namespace

Matrix3 from_rpy(const Vec3& angles) {
  return compose(compose(rotation_z(angles[2]), rotation_y(angles[1])), rotation_x(angles[0])).R;
}
Matrix3 from_xyz(const Vec3& angles) {
  return compose(compose(rotation_x(angles[0]), rotation_y(angles[1])), rotation_z(angles[2])).R;
}
Matrix3 from_zyz(const Vec3& angles) {
  return compose(compose(rotation_z(angles[0]), rotation_y(angles[1])), rotation_z(angles[2])).R;
}

// The last angle is read after the first has been turned back: near the singular position each of
// the two is ill-defined but together they still reproduce the matrix.
Vec3 to_rpy(const Matrix3& r) {
  const double c = std::hypot(r[0], r[3]);
  const double yaw = c > 1e-15 ? angle_between_axes(r[3], r[0]) : 0.0;
  const SinCos y = sin_cos(yaw);
  const double roll = angle_between_axes(y.sin * r[2] - y.cos * r[5], y.cos * r[4] - y.sin * r[1]);
  return {roll, std::atan2(0.0 - r[6], c), yaw};
}

Vec3 to_xyz(const Matrix3& r) {
  // (Rx(a) Ry(b) Rz(c))^T = Rz(-c) Ry(-b) Rx(-a)
  const Vec3 t = to_rpy({r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8]});
  return {negated(t[0]), 0.0 - t[1], negated(t[2])};
}

Vec3 to_zyz(const Matrix3& r) {
  const double s = std::hypot(r[2], r[5]);
  const double a = s > 1e-15 ? angle_between_axes(r[5], r[2]) : 0.0;
  const SinCos t = sin_cos(a);
  const double c = angle_between_axes(t.cos * r[3] - t.sin * r[0], t.cos * r[4] - t.sin * r[1]);
  return {a, std::atan2(s, r[8]), c};
}

// Shepperd's choice of the largest component (J. Guidance and Control 1, 1978, p. 223).
Quaternion to_quaternion(const Matrix3& r) {
  const double trace = r[0] + r[4] + r[8];
  Quaternion q;
  if (trace >= r[0] && trace >= r[4] && trace >= r[8]) {
    const double w = std::sqrt(1 + trace);
    q = {w, (r[7] - r[5]) / w, (r[2] - r[6]) / w, (r[3] - r[1]) / w};
  } else if (r[0] >= r[4] && r[0] >= r[8]) {
    const double x = std::sqrt(1 + r[0] - r[4] - r[8]);
    q = {(r[7] - r[5]) / x, x, (r[1] + r[3]) / x, (r[2] + r[6]) / x};
  } else if (r[4] >= r[8]) {
    const double y = std::sqrt(1 - r[0] + r[4] - r[8]);
    q = {(r[2] - r[6]) / y, (r[1] + r[3]) / y, y, (r[5] + r[7]) / y};
  } else {
    const double z = std::sqrt(1 - r[0] - r[4] + r[8]);
    q = {(r[3] - r[1]) / z, (r[2] + r[6]) / z, (r[5] + r[7]) / z, z};
  }
  const double n = std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  const double s = (q.w < 0 ? -1.0 : 1.0) / n;
  return {q.w * s, q.x * s, q.y * s, q.z * s};
}

Matrix3 from_quaternion(const Quaternion& q) {
  const double s = 2 / (q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  const double xx = q.x * q.x * s, yy = q.y * q.y * s, zz = q.z * q.z * s;
  const double xy = q.x * q.y * s, xz = q.x * q.z * s, yz = q.y * q.z * s;
  const double wx = q.w * q.x * s, wy = q.w * q.y * s, wz = q.w * q.z * s;
  return {1 - yy - zz, xy - wz, xz + wy, xy + wz,    1 - xx - zz,
          yz - wx,     xz - wy, yz + wx, 1 - xx - yy};
}

Matrix3 from_axis_angle(const Vec3& axis, double angle) {
  const Vec3 u = unit(axis);
  const SinCos a = sin_cos(angle);
  // 1 - cos without cancellation; sin_cos keeps right angles about a main axis exact.
  const double h = std::sin(angle / 2);
  const double v = a.cos == 0 ? 1.0 : (a.sin == 0 ? 1 - a.cos : 2 * h * h);
  const double x = u[0], y = u[1], z = u[2], s = a.sin;
  return {1 - v * (y * y + z * z), x * y * v - z * s,       x * z * v + y * s,
          x * y * v + z * s,       1 - v * (x * x + z * z), y * z * v - x * s,
          x * z * v - y * s,       y * z * v + x * s,       1 - v * (x * x + y * y)};
}

Vec3 rotation_log(const Matrix3& r) {
  const Quaternion q = to_quaternion(r);
  const Vec3 v{q.x, q.y, q.z};
  const double n = norm(v);
  // Below 1e-8 the quotient 2 atan2(n, w) / n equals 2 to rounding.
  return scale(v, n < 1e-8 ? 2.0 : 2 * std::atan2(n, q.w) / n);
}

Matrix3 rotation_exp(const Vec3& v) {
  const double angle = norm(v);
  if (angle == 0) return {1, 0, 0, 0, 1, 0, 0, 0, 1};
  return from_axis_angle(v, angle);
}

Vec3 rotation_difference(const Matrix3& from, const Matrix3& to) {
  Matrix3 d;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      d[3 * i + j] = to[3 * i] * from[3 * j] + to[3 * i + 1] * from[3 * j + 1] +
                     to[3 * i + 2] * from[3 * j + 2];
  return rotation_log(d);
}

}  // namespace robomosp::spatial
