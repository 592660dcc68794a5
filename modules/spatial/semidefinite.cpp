// SPDX-License-Identifier: Apache-2.0
#include "spatial/semidefinite.h"

#include <algorithm>
#include <cmath>

#include "spatial/body_tree.h"

namespace robomosp::spatial {

std::size_t solve_semidefinite(std::span<double> a, std::size_t n, double tolerance,
                               std::span<double> b, double* scratch) {
  double* factor = scratch;            // n rows of n, of which `rank` columns are used
  double* normal = scratch + n * n;    // rank * rank
  double* left = scratch + 2 * n * n;  // what is left of the diagonal
  double *x = left + n, *unit = x + n, *rest = unit + n, *sum = rest + n;
  double greatest = 0;
  for (std::size_t i = 0; i < n; ++i) greatest = std::max(greatest, a[i * n + i]);
  for (std::size_t i = 0; i < n; ++i)  // rows of all units weigh the same
    unit[i] = a[i * n + i] > 1e-24 * greatest ? 1 / std::sqrt(a[i * n + i]) : 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) a[i * n + k] *= unit[i] * unit[k];
    left[i] = a[i * n + i];
  }
  std::fill(factor, factor + n * n, 0.0);
  std::size_t rank = 0;
  for (; rank < n; ++rank) {
    const auto at = static_cast<std::size_t>(std::max_element(left, left + n) - left);
    if (!(left[at] > tolerance)) break;
    const double pivot = std::sqrt(left[at]);
    for (std::size_t i = 0; i < n; ++i) {
      if (left[i] < 0) continue;  // used as a pivot before
      double s = a[i * n + at];
      for (std::size_t k = 0; k < rank; ++k) s -= factor[i * n + k] * factor[at * n + k];
      factor[i * n + rank] = s / pivot;
      left[i] = std::max(0.0, left[i] - factor[i * n + rank] * factor[i * n + rank]);
    }
    left[at] = -1;
  }
  for (std::size_t r = 0; r < rank; ++r)
    for (std::size_t c = 0; c < rank; ++c) {
      double s = 0;
      for (std::size_t i = 0; i < n; ++i) s += factor[i * n + r] * factor[i * n + c];
      normal[r * rank + c] = s;
    }
  (void)cholesky(std::span(normal, rank * rank), rank);  // L has full column rank
  for (; b.size() >= n && n > 0; b = b.subspan(n)) {
    for (std::size_t i = 0; i < n; ++i) rest[i] = b[i] *= unit[i];
    std::fill(sum, sum + n, 0.0);
    for (int refined = 0; refined < 3; ++refined) {
      for (std::size_t r = 0; r < rank; ++r) {
        x[r] = 0;
        for (std::size_t i = 0; i < n; ++i) x[r] += factor[i * n + r] * rest[i];
      }
      for (int twice = 0; twice < 2; ++twice)
        cholesky_solve(std::span<const double>(normal, rank * rank), rank, x);
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t k = 0; k < rank; ++k) sum[i] += factor[i * n + k] * x[k];
      for (std::size_t i = 0; i < n; ++i) {
        rest[i] = b[i];
        for (std::size_t k = 0; k < n; ++k) rest[i] -= a[i * n + k] * sum[k];
      }
    }
    for (std::size_t i = 0; i < n; ++i) b[i] = unit[i] * sum[i];
  }
  return rank;
}

}  // namespace robomosp::spatial
