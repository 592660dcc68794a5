// SPDX-License-Identifier: Apache-2.0
// Rotations in the notations users write: angles, quaternions, axis and angle, and the rotation
// vector that solvers use (layer: data processing, spatial). Matrices are row-major. [any thread]
#pragma once

#include <array>

#include <robomosp/sdk/types.h>

namespace robomosp::spatial {

using Matrix3 = std::array<double, 9>;

/// Unit quaternion, scalar first; q and -q are the same rotation.
struct Quaternion {
  double w = 1, x = 0, y = 0, z = 0;
};

/// R = Rz(yaw) Ry(pitch) Rx(roll); angles are (roll, pitch, yaw) [rad].
[[nodiscard]] Matrix3 from_rpy(const Vec3& angles);
/// R = Rx(a) Ry(b) Rz(c) [rad].
[[nodiscard]] Matrix3 from_xyz(const Vec3& angles);
/// R = Rz(a) Ry(b) Rz(c) [rad].
[[nodiscard]] Matrix3 from_zyz(const Vec3& angles);

/// Inverses of the three above: outer angles in (-pi, pi], the middle one in [-pi/2, pi/2] (zyz:
/// [0, pi]). Where only the sum of the outer two is defined, the one applied last is 0 for rpy and
/// zyz (yaw, a), the one applied first for xyz (c); the matrix is reproduced in every case.
[[nodiscard]] Vec3 to_rpy(const Matrix3& r);
[[nodiscard]] Vec3 to_xyz(const Matrix3& r);
[[nodiscard]] Vec3 to_zyz(const Matrix3& r);

/// Quaternion with w >= 0 of a rotation matrix; accurate for every angle.
[[nodiscard]] Quaternion to_quaternion(const Matrix3& r);
/// Matrix of a quaternion of any length but zero.
[[nodiscard]] Matrix3 from_quaternion(const Quaternion& q);
/// Rotation by `angle` [rad] about `axis` of any length but zero.
[[nodiscard]] Matrix3 from_axis_angle(const Vec3& axis, double angle);

/// Rotation vector: axis times angle, angle in [0, pi]; accurate near 0 and near pi.
[[nodiscard]] Vec3 rotation_log(const Matrix3& r);
/// Matrix of a rotation vector.
[[nodiscard]] Matrix3 rotation_exp(const Vec3& v);
/// The rotation vector in the outer frame's axes that takes `from` to `to`: to = exp(v) from.
[[nodiscard]] Vec3 rotation_difference(const Matrix3& from, const Matrix3& to);

}  // namespace robomosp::spatial
