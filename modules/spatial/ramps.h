// SPDX-License-Identifier: Apache-2.0
// Ramps: the motion of one coordinate in pieces of constant jerk: trapezoidal and S-curve speed
// profiles (layer: data processing, spatial; standard library only). [any thread]
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
  /// Appends a piece of dt >= 0 with initial acceleration a and jerk j. Pieces of zero length are
  /// skipped.
  void append(double dt, double a, double j);
  /// The same with continuous acceleration.
  void append(double dt, double j) { append(dt, last_.a, j); }

  [[nodiscard]] double duration() const { return duration_; }
  [[nodiscard]] const Motion1& end() const { return last_; }
  [[nodiscard]] std::span<const Piece> pieces() const { return {pieces_.data(), count_}; }
  /// Constant outside 0..duration(), with zero rates.
  [[nodiscard]] Motion1 at(double t) const;

 private:
  std::array<Piece, kMost> pieces_{};
  std::size_t count_ = 0;
  double duration_ = 0;
  Motion1 last_;
};

/// Greatest values, all above 0; an infinite jerk gives trapezoidal profiles, a finite one
/// S-curves.
struct RampLimits {
  double v = 1, a = 1, j = std::numeric_limits<double>::infinity();
};

/// Shortest time for a speed change dv >= 0 with zero acceleration at both ends.
[[nodiscard]] double ramp_time(double dv, const RampLimits&);

/// The fastest motion over a displacement `way` > 0 from speed v0 to v1, both within 0..limits.v,
/// never backwards: to a top speed, cruise, and to v1. Empty if `way` is too short to change from
/// v0 to v1: least_way() returns the least displacement.
[[nodiscard]] std::optional<Ramps> fastest_ramps(double way, double v0, double v1,
                                                 const RampLimits&);
/// The same in exactly `duration`, with a lower speed in between. Empty if the duration is too
/// short for the limits, or too long for a motion without a stop or reversal.
[[nodiscard]] std::optional<Ramps> timed_ramps(double way, double v0, double v1, const RampLimits&,
                                               double duration);
[[nodiscard]] double least_way(double v0, double v1, const RampLimits&);

}  // namespace robomosp::spatial
