// SPDX-License-Identifier: Apache-2.0
// Analytical Jacobians: from the rates of a notation of the orientation to joint rates, and their
// time derivatives (layer: data processing, robotics). [any thread]
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/types.h>

#include "spatial/euler.h"

namespace robomosp::robotics {

/// How the orientation is given: three angles of a sequence, a unit quaternion or a rotation
/// vector.
struct Representation {
  enum class Kind { euler, quaternion, rotation_vector } kind = Kind::euler;
  spatial::EulerSequence sequence = spatial::kRollPitchYaw;
  [[nodiscard]] std::size_t size() const { return kind == Kind::quaternion ? 4 : 3; }
};
/// "rpy", "quaternion", "rotation_vector", "zyz" or a sequence's name such as "rzyx".
[[nodiscard]] std::optional<Representation> representation(std::string_view name);

/// The numbers of the notation for R. 3 or 4 of them.
[[nodiscard]] std::vector<double> orientation_numbers(const Representation& n,
                                                      const spatial::Matrix3& R);

/// What turns an angular velocity (outer axes) into the rates of the notation at R, row-major,
/// size() rows of 3; `rate`, when not null, gets its time derivative for the angular velocity w.
/// Nothing where the notation is singular (regularity below 1e-9).
[[nodiscard]] std::optional<std::vector<double>> representation_rates(const Representation& n,
                                                                      const spatial::Matrix3& R,
                                                                      const Vec3& w,
                                                                      std::vector<double>* rate);

/// Rows (linear as they are, then the notation's) from geometric columns (v, w) and, when both
/// are given, the derivative: A = diag(1, B) J, dA/dt = diag(1, B) dJ/dt + diag(0, dB/dt) J.
/// (3 + size()) x dof, row-major.
[[nodiscard]] std::vector<double> analytical_rows(std::span<const double> columns,
                                                  std::span<const double> B, std::size_t size);

}  // namespace robomosp::robotics
