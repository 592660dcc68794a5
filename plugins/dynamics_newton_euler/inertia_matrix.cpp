// SPDX-License-Identifier: Apache-2.0
#include "inertia_matrix.h"

#include <algorithm>

namespace robomosp::newton_euler {
namespace {

// Relative to the diagonal element before elimination: below this a pivot is rounding.
constexpr double kPivot = 1e-13;
// Relative to the greatest diagonal element: below this a diagonal element is rounding.
constexpr double kDiagonal = 1e-18;

}  // namespace

std::int32_t factor(const Chain& chain, double* m, double* diagonal) {
  const std::size_t n = chain.dof();
  double greatest = 0;
  for (std::size_t k = 0; k < n; ++k) {
    diagonal[k] = m[k * n + k];
    greatest = std::max(greatest, diagonal[k]);
  }
  for (std::size_t k = n; k-- > 0;) {
    const double* row = m + k * n;
    const double pivot = row[k];
    if (!(pivot > kPivot * diagonal[k]) || !(pivot > kDiagonal * greatest))
      return static_cast<std::int32_t>(k);
    for (std::int32_t i = chain.joints[k].parent; i >= 0;
         i = chain.joints[static_cast<std::size_t>(i)].parent) {
      const std::size_t r = static_cast<std::size_t>(i);
      double* to = m + r * n;
      const double a = row[r] / pivot;
      if (chain.is_serial) {
        for (std::size_t j = 0; j <= r; ++j) to[j] -= a * row[j];
      } else {
        for (std::int32_t j = i; j >= 0; j = chain.joints[static_cast<std::size_t>(j)].parent)
          to[j] -= a * row[j];
      }
      m[k * n + r] = a;
    }
  }
  return -1;
}

void solve(const Chain& chain, const double* m, double* x) {
  const std::size_t n = chain.dof();
  for (std::size_t k = n; k-- > 0;)  // L^T y = b
    for (std::int32_t i = chain.joints[k].parent; i >= 0;
         i = chain.joints[static_cast<std::size_t>(i)].parent)
      x[i] -= m[k * n + static_cast<std::size_t>(i)] * x[k];
  for (std::size_t k = 0; k < n; ++k) x[k] /= m[k * n + k];
  for (std::size_t k = 0; k < n; ++k)  // L x = D^-1 y
    for (std::int32_t i = chain.joints[k].parent; i >= 0;
         i = chain.joints[static_cast<std::size_t>(i)].parent)
      x[k] -= m[k * n + static_cast<std::size_t>(i)] * x[i];
}

}  // namespace robomosp::newton_euler
