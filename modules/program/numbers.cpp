// SPDX-License-Identifier: Apache-2.0
// Geometry of programs: degrees, unit quaternions with the scalar first.
#include <cmath>

#include "program/state.h"
#include "spatial/rotation.h"

namespace robomosp::program {

void compose_orientations(const double* a, const double* b, double* out) {
  const double r[4] = {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                       a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                       a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
                       a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
  for (int k = 0; k < 4; ++k) out[k] = r[k];
}

void rotate_position(const double* q, const double* v, double* out) {
  // v + 2 w (u x v) + 2 u x (u x v)
  const double t[3] = {2 * (q[2] * v[2] - q[3] * v[1]), 2 * (q[3] * v[0] - q[1] * v[2]),
                       2 * (q[1] * v[1] - q[2] * v[0])};
  const double r[3] = {v[0] + q[0] * t[0] + q[2] * t[2] - q[3] * t[1],
                       v[1] + q[0] * t[1] + q[3] * t[0] - q[1] * t[2],
                       v[2] + q[0] * t[2] + q[1] * t[1] - q[2] * t[0]};
  for (int k = 0; k < 3; ++k) out[k] = r[k];
}

PlainPose compose_poses(const PlainPose& a, const PlainPose& b) {
  PlainPose out;
  rotate_position(a.quaternion.data(), b.position.data(), out.position.data());
  for (std::size_t k = 0; k < 3; ++k) out.position[k] += a.position[k];
  compose_orientations(a.quaternion.data(), b.quaternion.data(), out.quaternion.data());
  return out;
}

PlainPose inverse_pose(const PlainPose& p) {
  PlainPose out;
  out.quaternion = {p.quaternion[0], 0.0 - p.quaternion[1], 0.0 - p.quaternion[2],
                    0.0 - p.quaternion[3]};
  rotate_position(out.quaternion.data(), p.position.data(), out.position.data());
  for (double& v : out.position) v = 0.0 - v;
  return out;
}

void axis_rotation(int axis, double degrees, double* q) {
  const double half = std::fmod(degrees, 720.0) / 2;
  const double c = cosine_of_degrees(half);
  double s = sine_of_degrees(half);
  // A quarter turn has one number twice, whatever sine and cosine are rounded to.
  if (std::fmod(half, 90.0) == 45.0 || std::fmod(half, 90.0) == -45.0) s = std::copysign(c, s);
  q[0] = c;
  q[1] = q[2] = q[3] = 0;
  q[1 + axis] = s;
}

void three_rotations(const int* axes, const double* degrees, double* q) {
  double next[4];
  axis_rotation(axes[0], degrees[0], q);
  for (int k = 1; k < 3; ++k) {
    axis_rotation(axes[k], degrees[k], next);
    compose_orientations(q, next, q);
  }
}

bool columns_to_quaternion(const double* n, const double* o, const double* a, double* q) {
  constexpr double kMost = 1e-4;  // columns are typed with a few digits
  const auto dot = [](const double* x, const double* y) {
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
  };
  const double across[3] = {n[1] * o[2] - n[2] * o[1], n[2] * o[0] - n[0] * o[2],
                            n[0] * o[1] - n[1] * o[0]};
  if (!(std::fabs(dot(n, n) - 1) < kMost && std::fabs(dot(o, o) - 1) < kMost &&
        std::fabs(dot(a, a) - 1) < kMost && std::fabs(dot(n, o)) < kMost &&
        std::fabs(dot(across, a) - 1) < kMost))
    return false;
  const spatial::Quaternion r =
      spatial::to_quaternion({n[0], o[0], a[0], n[1], o[1], a[1], n[2], o[2], a[2]});
  const double length = std::sqrt(r.w * r.w + r.x * r.x + r.y * r.y + r.z * r.z);
  q[0] = r.w / length;
  q[1] = r.x / length;
  q[2] = r.y / length;
  q[3] = r.z / length;
  return true;
}

void quaternion_to_matrix(const double* q, double* m) {
  const spatial::Matrix3 r = spatial::from_quaternion({q[0], q[1], q[2], q[3]});
  for (std::size_t k = 0; k < 9; ++k) m[k] = r[k];
}

bool angles_of(std::string_view mode, const double* q, double (&out)[4], unsigned& has) {
  spatial::Matrix3 m = spatial::from_quaternion({q[0], q[1], q[2], q[3]});
  out[0] = out[1] = out[2] = out[3] = 0;
  has = 7;
  if (mode == "RS" || mode == "ZYX") {
    const Vec3 a = spatial::to_rpy(m);
    for (std::size_t k = 0; k < 3; ++k) out[k] = a[k];
  } else if (mode == "XYZ") {
    const Vec3 a = spatial::to_xyz(m);
    for (std::size_t k = 0; k < 3; ++k) out[k] = a[k];
  } else if (mode == "YXZ") {
    // Ry(y) Rx(x) Rz(z): its middle row is cos x sin z, cos x cos z, -sin x.
    const double c = std::hypot(m[3], m[4]);
    out[0] = std::atan2(-m[5], c);
    if (c > 1e-12) {
      out[1] = std::atan2(m[2], m[8]);
      out[2] = std::atan2(m[3], m[4]);
    } else {
      out[1] = std::atan2(-m[6], m[0]);
    }
  } else if (mode == "ZYZ2") {
    const Vec3 a = spatial::to_zyz(m);
    out[2] = a[0];
    out[1] = a[1];
    out[3] = a[2];
    has = 14;
  } else {
    return false;
  }
  for (double& x : out) {
    x *= kDegreesPerRadian;
    if (x < 0) x += 360;
    if (x >= 360) x = 0;
  }
  return true;
}

}  // namespace robomosp::program
