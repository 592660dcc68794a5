// SPDX-License-Identifier: Apache-2.0
// Where a motion begins between the rows of a recording (layer: application, task).
#pragma once

#include <cmath>

namespace robomosp::task {

/// The time since the last row at t, of rows every `step`; 0 at a row [s].
[[nodiscard]] inline double lead_of(double t, double step) {
  const double lead = t - step * std::floor(t / step * (1 + 1e-12));
  return lead > 1e-9 * step && lead < step ? lead : 0;
}

}  // namespace robomosp::task
