// SPDX-License-Identifier: Apache-2.0
// From any state of one coordinate (place, velocity, acceleration) to any other within limits of
// velocity, acceleration and jerk: shortest time, every possible time, and the motion for it
// (layer: data processing, spatial; standard library only). No allocation. [any thread]
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

/// One side of what can be reached: the motion that comes farthest forwards in a given time, in
/// units of time and jerk 1. Its acceleration rises to p, is held, falls to q, is held, and rises
/// to the end's; at the greatest velocity it rests at 0 on its way down.
struct FarthestMotion {
  double v0, a0, v1, a1, V, A;
  double C;       ///< v1 - v0 - (a1^2 - a0^2) / 2
  double c0, c1;  ///< velocity at a = 0 before the start, behind the end
  double p_top, q_top, hold_p_top, hold_q_top, S_top;  ///< where V is just reached

  struct Shape {
    double p, q, hold_p, hold_q, cruise;
  };
  void prepare();
  /// S = T - (a1 - a0): the time but for the direct change of acceleration.
  [[nodiscard]] Shape shape(double S) const;
  /// The way done, and how fast it grows with the time given.
  [[nodiscard]] double way(const Shape&) const;
  [[nodiscard]] double growth(const Shape&) const;
  /// Least S in [from, to] where the way reaches x; it is below x at `from`. Infinite when none.
  [[nodiscard]] double reach(double x, double from, double to, double touch) const;
};

/// The times and motions of one coordinate. What can be reached in a time T is an interval of
/// places, because limits and equations are linear: [nearest(T), farthest(T)]. T is possible when
/// the end lies in it, and any mixture of the two extreme motions keeps all limits.
class StateToState {
 public:
  enum class Fault { none, end_velocity, end_acceleration, end_passed };

  /// `j` of the states is not read. A start outside the limits is first brought back as fast as
  /// possible. An end outside them is a fault; `end_passed`: to arrive so, the velocity limit was
  /// broken before, or would be behind it.
  Fault prepare(const Motion1& start, const Motion1& end, const StateLimits&);

  /// Shortest possible duration >= T. Durations may be blocked: a moving start cannot always be
  /// delayed by a little.
  [[nodiscard]] double next_duration(double T) const;
  /// The motion of a duration that next_duration() returned or that it returns unchanged.
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

/// Shortest duration >= T that all coordinates can take, so that they arrive together.
[[nodiscard]] double common_duration(std::span<const StateToState>, double T = 0);

}  // namespace robomosp::spatial
