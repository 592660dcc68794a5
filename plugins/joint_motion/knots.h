// SPDX-License-Identifier: Apache-2.0
// Splines of one coordinate a joint through values at knots, and their greatest derivatives
// (layer: plugin).
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "task.h"

namespace robomosp::joint_motion {

/// A polynomial of degree 5 or less in the time since its knot, constant term first.
using Piece = std::array<double, 6>;

/// Derivatives at both ends: velocities and, for quintic splines, accelerations of all joints.
struct Clamps {
  std::vector<double> v0, v1, a0, a1;
};

/// What holds at the ends of a spline besides its first and last joint vector.
enum class EndRule {
  clamped,     ///< the rates of Clamps
  natural,     ///< cubic: no acceleration; quintic: no third and fourth derivative
  not_a_knot,  ///< one polynomial over the first two pieces (quintic: three), likewise the last
  periodic     ///< all derivatives that are continuous are the same at both ends
};

struct Spline {
  std::vector<double> step;   ///< between knots [s]
  std::vector<Piece> pieces;  ///< of all joints, row-major, one row between two knots
};

/// Through the task's joint vectors at knots `step` apart. Cubic: two continuous derivatives;
/// quintic: four. `clamps` of EndRule::clamped only. Not-a-knot wants as many joint vectors as the
/// polynomial has coefficients, periodic the same one at both ends.
[[nodiscard]] Spline through(const Task&, std::span<const double> step, bool is_quintic, EndRule,
                             const Clamps& clamps);

[[nodiscard]] Motion1 value(const Piece&, double t);

/// Extremes of a derivative (0 = the value itself) over 0..h.
struct Range {
  double least, most;
};
[[nodiscard]] Range range(const Piece&, int order, double h);
/// A piece that leaves the joint's range between the joint vectors `point` and the next, counted
/// from 0.
Result<void> check_range(const Piece&, double h, const Task&, std::size_t joint, std::size_t point);

}  // namespace robomosp::joint_motion
