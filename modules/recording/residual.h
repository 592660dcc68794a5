// SPDX-License-Identifier: Apache-2.0
// What was measured minus what a model says, over time (layer: application, recording). [any
// thread]
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

/// Of one column of a residual, in its unit; samples that are not finite do not count.
struct ResidualStatistics {
  std::string name, unit;
  double mean = 0, rms = 0, deviation = 0;
  double greatest = 0;  ///< amount
  double at = 0;        ///< time of it [s]; without time the row, from 1
  std::size_t samples = 0;
};

/// "tau3" gives "tau_residual3", "left.x" gives "left.x_residual".
[[nodiscard]] std::string residual_name(std::string_view column);

/// A recording with the measured one's times, over the time that both cover, and a column for each
/// of `columns` (groups such as "q" too; empty = all that both have): measured minus model, which
/// is interpolated linearly at the measured time plus `shift` [s]. Units have to be equal.
[[nodiscard]] Result<Recording> residual(const Recording& measured, const Recording& model,
                                         std::span<const std::string> columns, double shift = 0);

/// The shift within +-most [s] whose residual varies least: the variances of the columns, each over
/// its spread in the model, so that a constant offset moves nothing. Shifts at which fewer than
/// half as many measured rows have a partner as at others do not count. Found on a grid, then by
/// golden section to 1e-6 of `most`.
[[nodiscard]] Result<double> best_shift(const Recording& measured, const Recording& model,
                                        std::span<const std::string> columns, double most,
                                        Progress&);

[[nodiscard]] std::vector<ResidualStatistics> residual_statistics(const Recording& residual);

}  // namespace robomosp::recording
