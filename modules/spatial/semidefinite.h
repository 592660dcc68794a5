// SPDX-License-Identifier: Apache-2.0
// Linear systems with possibly redundant rows (layer: data processing, spatial).
#pragma once

#include <cstddef>
#include <span>

namespace robomosp::spatial {

/// Solutions of A x = b for a symmetric positive semidefinite A of n rows, each row scaled to a
/// unit diagonal: by a pivoted Cholesky factor of full column rank, L, the smallest one,
/// x = L (L^T L)^-2 L^T b, refined. Pivots below `tolerance` count as zero: rows that others imply
/// share their forces. A is overwritten; `b` holds right-hand sides of n numbers, one after the
/// other, which become their x. Scratch of 2 n n + 5 n. Returns the rank.
std::size_t solve_semidefinite(std::span<double> a, std::size_t n, double tolerance,
                               std::span<double> b, double* scratch);

}  // namespace robomosp::spatial
