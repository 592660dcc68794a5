// SPDX-License-Identifier: Apache-2.0
// Measured values minus those of a model, over time (layer: application, recording). [any thread]
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::recording {

/// Statistics of one column of a residual, in its unit; non-finite samples are ignored.
struct ResidualStatistics {
  std::string name, unit;
  double mean = 0, rms = 0, deviation = 0;
  double greatest = 0;  ///< absolute value
  double at = 0;        ///< its time [s]; without time the row, from 1
  std::size_t samples = 0;
};

/// "tau3" gives "tau_residual3", "left.x" gives "left.x_residual".
[[nodiscard]] std::string residual_name(std::string_view column);

/// A recording with the times of `measured` within the time range of both, and a column for each of
/// `columns` (also groups such as "q"; empty = all common ones): measured minus model, interpolated
/// linearly at the measured time plus `shift` [s]. Units must be equal.
[[nodiscard]] Result<Recording> residual(const Recording& measured, const Recording& model,
                                         std::span<const std::string> columns, double shift = 0);

/// The shift within +-most [s] that minimises the variation of the residual: the sum of the
/// columns' variances, each divided by its spread in the model, so that constant offsets do not
/// matter. Shifts with fewer than half the maximum number of paired rows are skipped. Found on a
/// grid, then by golden section to 1e-6 of `most`.
[[nodiscard]] Result<double> best_shift(const Recording& measured, const Recording& model,
                                        std::span<const std::string> columns, double most,
                                        Progress&);

[[nodiscard]] std::vector<ResidualStatistics> residual_statistics(const Recording& residual);

}  // namespace robomosp::recording
