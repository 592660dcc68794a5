// SPDX-License-Identifier: Apache-2.0
// Motions from any state of one coordinate (position, velocity, acceleration) to any other within
// limits of velocity, acceleration and jerk: shortest time, all feasible times, and the motion for
// each (layer: data processing, spatial; standard library only). No allocation. [any thread]
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include "spatial/ramps.h"

namespace robomosp::spatial {

/// Greatest absolute values, above 0; v and a may be infinite, j not. [unit, s]
struct StateLimits {
  double v = std::numeric_limits<double>::infinity();
  double a = std::numeric_limits<double>::infinity();
  double j = 1;
};

/// One bound of the reachable positions: the motion that moves farthest forwards in a given time,
/// in units of time and jerk 1. Its acceleration rises to p, is held, falls to q, is held, and
/// rises to the end's; at the greatest velocity it stays at 0 before it falls.
struct FarthestMotion {
  double v0, a0, v1, a1, V, A;
  double C;       ///< v1 - v0 - (a1^2 - a0^2) / 2
  double c0, c1;  ///< velocity at a = 0 before the start, behind the end
  double p_top, q_top, hold_p_top, hold_q_top, S_top;  ///< where V is just reached

  struct Shape {
    double p, q, hold_p, hold_q, cruise;
  };
  void prepare();
  /// S = T - (a1 - a0): the time without the direct change of acceleration.
  [[nodiscard]] Shape shape(double S) const;
  /// The displacement, and its derivative by the given time.
  [[nodiscard]] double way(const Shape&) const;
  [[nodiscard]] double growth(const Shape&) const;
  /// Least S in [from, to] at which the displacement reaches x; it is below x at `from`. Infinite
  /// if there is none.
  [[nodiscard]] double reach(double x, double from, double to, double touch) const;
};

/// The feasible times and motions of one coordinate. The reachable positions in a time T are an
/// interval, because limits and equations are linear: [nearest(T), farthest(T)]. T is feasible if
/// the interval contains the end, and any mixture of the two extreme motions respects all limits.
class StateToState {
 public:
  enum class Fault { none, end_velocity, end_acceleration, end_passed };

  /// `j` of the states is ignored. A start outside the limits is first brought back as fast as
  /// possible. An end outside them is a fault; `end_passed`: the velocity limit would be violated
  /// before the end, or after it.
  Fault prepare(const Motion1& start, const Motion1& end, const StateLimits&);

  /// Shortest feasible duration >= T. Durations may be blocked: a moving start cannot always be
  /// delayed slightly.
  [[nodiscard]] double next_duration(double T) const;
  /// The motion for a duration that next_duration() returned, or would return unchanged.
  [[nodiscard]] Ramps motion(double T) const;

 private:
  [[nodiscard]] double next_core(double T) const;

  Motion1 start_, end_;
  double jerk_ = 1, brake_time_ = 0;
  std::array<double, 9> brake_dt_{}, brake_jerk_{};
  std::size_t brakes_ = 0;
  double way_ = 0, touch_ = 0, direct_ = 0;
  double first_ = 0, gap_from_ = 0, gap_to_ = 0;  ///< possible changes of velocity [s]
  bool is_direct_ = false;  ///< the direct change of acceleration leads to the end
  FarthestMotion forward_, backward_;
};

/// Shortest duration >= T feasible for all coordinates, so that they arrive together.
[[nodiscard]] double common_duration(std::span<const StateToState>, double T = 0);

}  // namespace robomosp::spatial
