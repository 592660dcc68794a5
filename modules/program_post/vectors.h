// SPDX-License-Identifier: Apache-2.0
// Vectors and rotations of points, as far as passes over programs need them (layer: application,
// program_post).
#pragma once

#include <array>

namespace robomosp::program_post {

using Quaternion = std::array<double, 4>;  ///< w, x, y, z

[[nodiscard]] inline double dot(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
[[nodiscard]] inline std::array<double, 3> cross(const std::array<double, 3>& a,
                                                 const std::array<double, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// The rotation matrix of a unit quaternion, row by row.
[[nodiscard]] inline std::array<double, 9> matrix(const Quaternion& q) {
  const auto [w, x, y, z] = q;
  return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
          2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
          2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
}

}  // namespace robomosp::program_post
