// SPDX-License-Identifier: Apache-2.0
// How far two recordings differ (layer: application, recording). [any thread]
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::recording {

/// Of one column, other minus first, in the column's unit.
struct ColumnDifference {
  std::string name, unit;
  double greatest = 0;  ///< of the differences' amounts
  double at = 0;        ///< time of it [s]; without time the row, from 1
  double rms = 0;       ///< root mean square
  double mean = 0;
  double deviation = 0;               ///< standard deviation about the mean
  std::optional<double> correlation;  ///< Pearson's; none where a column does not vary
  std::size_t samples = 0;            ///< that both have
};

/// Of the columns that both have, or of those named. Where the times differ the other recording is
/// interpolated linearly at the first one's times, over the time that both cover; without time both
/// need as many rows. Samples that are not finite in either are left out.
[[nodiscard]] Result<std::vector<ColumnDifference>> compare(const Recording& first,
                                                            const Recording& other,
                                                            std::span<const std::string> columns);

}  // namespace robomosp::recording
