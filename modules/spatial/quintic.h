// SPDX-License-Identifier: Apache-2.0
// The polynomial of fifth degree between two states of motion, and the one from rest to rest
// (layer: data processing, spatial).
#pragma once

#include <array>

#include "spatial/jet.h"

namespace robomosp::spatial {

/// One coordinate with value, rate and acceleration given at both ends (L. Biagiotti, C.
/// Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section 2.1.3).
class Quintic {
 public:
  Quintic() = default;
  /// Derivatives of `start` and `end` with respect to time; `duration` > 0 [s].
  Quintic(const Jet& start, const Jet& end, double duration) : duration_(duration) {
    const double T = duration, d = start.d * T, e = start.dd * T * T / 2;
    const double dx = end.v - (start.v + d + e), dv = end.d * T - (d + 2 * e),
                 da = end.dd * T * T - 2 * e;
    c_ = {
        start.v, d, e, 10 * dx - 4 * dv + da / 2, -15 * dx + 7 * dv - da, 6 * dx - 3 * dv + da / 2};
  }
  /// Value and derivatives with respect to time, at a share of the duration in 0..1.
  [[nodiscard]] Jet at(double share) const {
    const double x = share, T = duration_;
    const auto& c = c_;
    return {
        c[0] + x * (c[1] + x * (c[2] + x * (c[3] + x * (c[4] + x * c[5])))),
        (c[1] + x * (2 * c[2] + x * (3 * c[3] + x * (4 * c[4] + x * 5 * c[5])))) / T,
        (2 * c[2] + x * (6 * c[3] + x * (12 * c[4] + x * 20 * c[5]))) / (T * T),
    };
  }
  [[nodiscard]] double jerk(double share) const {
    const double x = share, T = duration_;
    return (6 * c_[3] + x * (24 * c_[4] + x * 60 * c_[5])) / (T * T * T);
  }
  /// Of the powers 0 to 5 of the share.
  [[nodiscard]] const std::array<double, 6>& coefficients() const { return c_; }

 private:
  std::array<double, 6> c_{};
  double duration_ = 1;
};

/// x^3 (10 - 15 x + 6 x^2) with its derivatives: from 0 to 1 for x in 0..1, without rate and
/// acceleration at both ends. Its greatest rate is 15/8, its greatest acceleration 10/sqrt(3).
inline Jet ease(double x) {
  return {x * x * x * (10 + x * (-15 + 6 * x)), 30 * x * x * (1 - x) * (1 - x),
          60 * x * (1 - x) * (1 - 2 * x)};
}
/// Its third derivative.
inline double ease_jerk(double x) { return 60 * (1 + 6 * x * (x - 1)); }

}  // namespace robomosp::spatial
