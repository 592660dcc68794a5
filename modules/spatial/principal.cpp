// SPDX-License-Identifier: Apache-2.0
#include "spatial/principal.h"

#include <algorithm>
#include <cmath>

namespace robomosp::spatial {

Principal principal(const Sym3& s) {
  // Cyclic Jacobi: Golub & Van Loan, Matrix Computations, 8.5. Three by three converges in a few
  // sweeps; the bound only guards against NaN.
  double a[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const double scale = std::fabs(s.xx) + std::fabs(s.yy) + std::fabs(s.zz);
  for (int sweep = 0; sweep < 30; ++sweep) {
    if (std::fabs(a[0][1]) + std::fabs(a[0][2]) + std::fabs(a[1][2]) <= 1e-17 * scale) break;
    for (std::size_t p = 0; p < 2; ++p)
      for (std::size_t q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const double tau = (a[q][q] - a[p][p]) / (2 * a[p][q]);
        const double t = (tau >= 0 ? 1.0 : -1.0) / (std::fabs(tau) + std::sqrt(1 + tau * tau));
        const double c = 1 / std::sqrt(1 + t * t), sn = t * c;
        for (std::size_t k = 0; k < 3; ++k) {
          const double x = a[k][p], y = a[k][q];
          a[k][p] = c * x - sn * y;
          a[k][q] = sn * x + c * y;
        }
        for (std::size_t k = 0; k < 3; ++k) {
          const double x = a[p][k], y = a[q][k];
          a[p][k] = c * x - sn * y;
          a[q][k] = sn * x + c * y;
        }
        for (auto& row : v) {
          const double x = row[p], y = row[q];
          row[p] = c * x - sn * y;
          row[q] = sn * x + c * y;
        }
      }
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return a[i][i] < a[j][j]; });
  Principal out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.moments[i] = a[order[i]][order[i]];
    for (std::size_t k = 0; k < 3; ++k) out.axes[3 * k + i] = v[k][order[i]];
  }
  const auto& m = out.axes;
  const double det = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                     m[2] * (m[3] * m[7] - m[4] * m[6]);
  if (det < 0)
    for (std::size_t k = 0; k < 3; ++k) out.axes[3 * k + 2] = -out.axes[3 * k + 2];
  return out;
}

}  // namespace robomosp::spatial
