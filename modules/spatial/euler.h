// SPDX-License-Identifier: Apache-2.0
// The 24 sequences of three angles that represent a rotation, 12 about fixed and 12 about rotating
// axes, and the rates of the representations (layer: data processing, spatial). Matrices are
// row-major. [any thread]
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "spatial/rotation.h"

namespace robomosp::spatial {

/// Three rotations in order about axes 0, 1, 2 (x, y, z), consecutive ones different. With rotating
/// axes R = R_a(1st) R_b(2nd) R_c(3rd), with fixed ones R = R_c(3rd) R_b(2nd) R_a(1st).
struct EulerSequence {
  std::array<std::size_t, 3> axes{0, 1, 2};
  bool turning = false;

  /// First and last axis alike: the sequences of Euler; else those of Tait and Bryan.
  [[nodiscard]] bool is_proper() const { return axes[0] == axes[2]; }
  /// "sxyz" for fixed (static) axes, "rzyx" for rotating ones.
  [[nodiscard]] std::string name() const;
  friend bool operator==(const EulerSequence&, const EulerSequence&) = default;
};

/// All of them: 12 about fixed axes, then the same about rotating ones.
[[nodiscard]] std::span<const EulerSequence, 24> euler_sequences();
/// By name; "rpy" is sxyz, "xyz" and other plain names mean rotating axes.
[[nodiscard]] std::optional<EulerSequence> euler_sequence(std::string_view name);

/// Roll, pitch and yaw: sxyz.
inline constexpr EulerSequence kRollPitchYaw{{0, 1, 2}, false};

struct EulerAngles {
  Vec3 angles{};  ///< outer two in (-pi, pi]; middle in [-pi/2, pi/2], proper ones [0, pi] [rad]
  /// Distance from the singularity: |cos| of the middle angle, |sin| for proper sequences; 0 = R
  /// determines only the sum or difference of the outer two, and one of them is 0.
  double regularity = 1;
  [[nodiscard]] bool is_singular() const { return regularity < 1e-9; }
};

/// Matrix of three angles [rad] in the order of the sequence.
[[nodiscard]] Matrix3 from_euler(const EulerSequence& s, const Vec3& angles);
/// Angles of a rotation; they reproduce R in the singular case, too.
[[nodiscard]] EulerAngles to_euler(const EulerSequence& s, const Matrix3& r);

/// E with w = E * (rates of the angles), w the angular velocity in the outer axes (Siciliano et
/// al., Robotics, 2009, sec. 3.6). Singular if the sequence is.
[[nodiscard]] Matrix3 euler_rates(const EulerSequence& s, const Vec3& angles);
/// Time derivative of E for these rates of the angles [1/s].
[[nodiscard]] Matrix3 euler_rates_rate(const EulerSequence& s, const Vec3& angles,
                                       const Vec3& rates);

/// B with (dw dx dy dz)/dt = B w for a unit quaternion, w in the outer axes; 4 rows of 3.
[[nodiscard]] std::array<double, 12> quaternion_rates(const Quaternion& q);
/// B with (rate of the rotation vector v) = B w, w in the outer axes; |v| < 2 pi.
[[nodiscard]] Matrix3 rotation_vector_rates(const Vec3& v);
/// Time derivative of that B for the rate `rate` of v.
[[nodiscard]] Matrix3 rotation_vector_rates_rate(const Vec3& v, const Vec3& rate);

}  // namespace robomosp::spatial
