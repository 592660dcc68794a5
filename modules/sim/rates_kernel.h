// SPDX-License-Identifier: Apache-2.0
// The kernels of rates_kernel.cpp, one per instruction set; plain structures only (layer:
// application, sim).
#pragma once

#include <cstddef>

namespace robomosp::sim {

/// Samples of one call of the kernel at most, a multiple of all numbers of lanes.
inline constexpr std::size_t kRatesTogether = 64;
inline constexpr std::size_t kMostRates = 16;  ///< joints

/// Samples with joint rates to correct; see joint_rates().
struct RatesTask {
  std::size_t dof;                       ///< 1..kMostRates
  std::size_t count;                     ///< of samples, at most kRatesTogether
  const double* jacobians;               ///< 6 * dof a sample, base axes, column by column
  const double* rates;                   ///< 24 a sample: pose, then v, w and their derivatives
  const double *qd, *qdd;                ///< dof a sample: estimates
  double *corrected_qd, *corrected_qdd;  ///< dof a sample, with the tip's motion
  /// Least pivot of J J^T against its greatest entry; near 0 the sample's rates are not to be used.
  double* pivot;  ///< space for kRatesTogether numbers
};

struct RatesKernel {
  void (*correct)(const RatesTask&);
};

namespace baseline {
const RatesKernel& rates_kernel();
}
namespace avx2 {
const RatesKernel& rates_kernel();
}
namespace avx512 {
const RatesKernel& rates_kernel();
}

}  // namespace robomosp::sim
