// SPDX-License-Identifier: Apache-2.0
// Ramps: the motion of one coordinate by pieces of constant jerk: trapezoidal and S-shaped speed
// (layer: data processing, spatial; standard library only). [any thread]
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

namespace robomosp::spatial {

/// A coordinate and its derivatives. [unit, s]
struct Motion1 {
  double x = 0, v = 0, a = 0, j = 0;
};

/// Pieces of constant jerk, one after the other; the acceleration may jump between them.
class Ramps {
 public:
  static constexpr std::size_t kMost = 24;

  struct Piece {
    double from;  ///< [s]
    Motion1 start;
  };

  explicit Ramps(double x = 0, double v = 0, double a = 0) : last_{x, v, a, 0} {}
  /// Goes on for dt >= 0 with acceleration a at its start and jerk j. Pieces of no length are left
  /// out.
  void append(double dt, double a, double j);
  /// The same without a jump of the acceleration.
  void append(double dt, double j) { append(dt, last_.a, j); }

  [[nodiscard]] double duration() const { return duration_; }
  [[nodiscard]] const Motion1& end() const { return last_; }
  [[nodiscard]] std::span<const Piece> pieces() const { return {pieces_.data(), count_}; }
  /// Held at the ends outside 0..duration(), rates zero.
  [[nodiscard]] Motion1 at(double t) const;

 private:
  std::array<Piece, kMost> pieces_{};
  std::size_t count_ = 0;
  double duration_ = 0;
  Motion1 last_;
};

/// Greatest values, all above 0; an infinite jerk makes trapezoids of speed, a finite one S-curves.
struct RampLimits {
  double v = 1, a = 1, j = std::numeric_limits<double>::infinity();
};

/// Shortest time in which the speed changes by dv >= 0, at rest in acceleration at both ends.
[[nodiscard]] double ramp_time(double dv, const RampLimits&);

/// The fastest way over `way` > 0 from speed v0 to v1, both within 0..limits.v, never backwards:
/// up to a top speed, along at it, and to v1. None when `way` is too short to change from v0 to v1:
/// least_way() says how long it must be.
[[nodiscard]] std::optional<Ramps> fastest_ramps(double way, double v0, double v1,
                                                 const RampLimits&);
/// The same in exactly `duration`: with a lower speed in between. None when that is too short for
/// the limits, or too long to go without stopping and turning back.
[[nodiscard]] std::optional<Ramps> timed_ramps(double way, double v0, double v1, const RampLimits&,
                                               double duration);
[[nodiscard]] double least_way(double v0, double v1, const RampLimits&);

}  // namespace robomosp::spatial
