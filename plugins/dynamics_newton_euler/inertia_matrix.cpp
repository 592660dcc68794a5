// SPDX-License-Identifier: Apache-2.0
#include "inertia_matrix.h"

namespace robomosp::newton_euler {

std::int32_t singular_entry(const Chain& chain, std::vector<double> m) {
  const std::size_t n = chain.dof();
  const std::int32_t* parent = chain.mechanism().entry_parent;
  std::vector<double> diagonal(n);
  for (std::size_t k = 0; k < n; ++k) diagonal[k] = m[k * n + k];
  for (std::size_t k = n; k-- > 0;) {
    const double* row = m.data() + k * n;
    if (!(row[k] > spatial::recursions::kPivot * diagonal[k]) ||
        !(row[k] > chain.mechanism().least_inertia[k]))
      return static_cast<std::int32_t>(k);
    for (std::int32_t i = parent[k]; i >= 0; i = parent[i])
      for (std::int32_t j = i; j >= 0; j = parent[j])
        m[static_cast<std::size_t>(i) * n + static_cast<std::size_t>(j)] -=
            row[i] / row[k] * row[j];
  }
  return -1;
}

}  // namespace robomosp::newton_euler
