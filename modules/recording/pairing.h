// SPDX-License-Identifier: Apache-2.0
// Pairs the rows of two recordings (layer: application, recording). [any thread]
#pragma once

#include <cstddef>
#include <vector>

#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::recording {

/// Positions of the rows of one recording between those of another.
struct Pairing {
  struct Row {
    std::size_t first, other;
    double share;  ///< weight of the other's next row
    double at;     ///< the first one's time [s]; without time the row, from 1
    /// The other's value, interpolated linearly.
    [[nodiscard]] double of(const std::vector<double>& values) const {
      return share == 0 ? values[other] : values[other] * (1 - share) + values[other + 1] * share;
    }
  };
  std::vector<Row> rows;
};

/// Pairs the rows of `first` in the time range of both, with its times shifted by `shift` [s]; at
/// least one. Without time both must have the same number of rows.
[[nodiscard]] Result<Pairing> pair(const Recording& first, const Recording& other,
                                   double shift = 0);

}  // namespace robomosp::recording
