// SPDX-License-Identifier: Apache-2.0
// Closed loops of a tree as constraints of its accelerations: J qdd + bias = 0 (layer: data
// processing, spatial).
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "spatial/body_tree.h"

namespace robomosp::spatial {

/// Pose of frame b of a loop relative to frame a, and its rates when either end moves.
class LoopGap {
 public:
  /// Both in the base frame.
  LoopGap(const Pose& a, const Pose& b);

  Vec3 way{};   ///< from a to b, axes of a [m]
  Vec3 turn{};  ///< rotation vector, axes of a [rad]

  /// Rate of the rotation vector for an angular velocity u of b relative to a (axes of a): the
  /// inverse of the left Jacobian of SO(3) times u (J. Sola et al., "A micro Lie theory", 2018, eq.
  /// 146).
  [[nodiscard]] Vec3 turn_rate(const Vec3& u) const;
  /// Rate of turn_rate(u) for constant u, while the rotation vector changes by `rate`.
  [[nodiscard]] Vec3 turn_rate_change(const Vec3& rate, const Vec3& u) const;
  /// Rates of `way` and `turn` for a motion of b in the base frame; without `by_vector` the angular
  /// velocity replaces the rate of turn. Negate for a motion of a.
  [[nodiscard]] std::array<double, 6> rates(const Screw& motion, bool by_vector) const;

 private:
  Pose a_;
  Vec3 b_{};
  double c_ = 0, slope_ = 0;  // inverse = 1 - [v]/2 + c [v]^2; slope = c'(t) / t, t = |v|
};

/// Number of fixed directions of all loops.
[[nodiscard]] std::size_t loop_rows(std::span<const LoopModel> loops);
/// Index of the loop of a row, in the order of their fixed directions.
[[nodiscard]] std::size_t loop_of_row(std::span<const LoopModel> loops, std::size_t row);

/// For a swept tree with accelerations for qdd = 0, due to velocities alone. Rows in order of
/// LoopDirection, loop after loop, in the axes of frame a.
struct LoopRows {
  std::span<double> jacobian;  ///< rows * dof, row-major
  std::span<double> bias;      ///< acceleration of the residual at qdd = 0
  std::span<double> rate;      ///< of the residual
  std::span<double> gap;       ///< the residual: displacement [m] and rotation vector [rad]
};
/// `base_velocity`, `base_acceleration` as in the sweep: what the base does, weight included,
/// both ends of a loop do.
void loop_constraints(const BodyTree& tree, std::span<const MovingBody> bodies,
                      std::span<const Screw> columns, const TreeState& state, const LoopRows& out);

}  // namespace robomosp::spatial
