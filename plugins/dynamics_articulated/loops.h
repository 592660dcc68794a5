// SPDX-License-Identifier: Apache-2.0
// Closed loops of a tree as constraints of its accelerations: J qdd + bias = 0 (layer: plugin).
#pragma once

#include <cstdint>
#include <span>

#include "spatial/body_tree.h"

namespace robomosp::articulated {

/// Fixed directions of all loops.
[[nodiscard]] std::size_t loop_rows(const spatial::BodyTree& tree);

/// Of a swept tree whose accelerations are those of the velocities alone (qdd = 0). Rows in order
/// of LoopDirection, loop after loop, in the axes of frame a.
struct LoopRows {
  std::span<double> jacobian;  ///< rows * dof, row-major
  std::span<double> bias;      ///< acceleration of the residual at qdd = 0
  std::span<double> rate;      ///< of the residual
  std::span<double> gap;       ///< the residual: way [m] and rotation vector [rad]
};
/// `base_velocity`, `base_acceleration` as in the sweep: what the base does, weight included,
/// both ends of a loop do.
void loop_constraints(const spatial::BodyTree& tree, std::span<const spatial::MovingBody> bodies,
                      std::span<const spatial::Screw> columns, const spatial::TreeState& state,
                      const LoopRows& out);

/// A solution of A x = b for a symmetric positive semidefinite A of n rows, each row scaled to a
/// unit diagonal: by a pivoted Cholesky factor of full column rank, L, the smallest one,
/// x = L (L^T L)^-2 L^T b, refined. Pivots below `tolerance` count as zero: rows that others imply
/// share their forces. A is overwritten, b becomes x; scratch of 2 n n + 5 n. Returns the rank.
std::size_t solve_semidefinite(std::span<double> a, std::size_t n, double tolerance, double* b,
                               double* scratch);

}  // namespace robomosp::articulated
