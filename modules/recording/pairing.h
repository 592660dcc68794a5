// SPDX-License-Identifier: Apache-2.0
// Which rows of two recordings belong together (layer: application, recording). [any thread]
#pragma once

#include <cstddef>
#include <vector>

#include <robomosp/sdk/result.h>

#include "recording/recording.h"

namespace robomosp::recording {

/// Where the rows of one recording stand between those of another.
struct Pairing {
  struct Row {
    std::size_t first, other;
    double share;  ///< of the other's next row
    double at;     ///< the first one's time [s]; without time the row, from 1
    /// The other's value, interpolated linearly.
    [[nodiscard]] double of(const std::vector<double>& values) const {
      return share == 0 ? values[other] : values[other] * (1 - share) + values[other + 1] * share;
    }
  };
  std::vector<Row> rows;
};

/// The rows of `first` over the time that both cover, when its times are later by `shift` [s]; at
/// least one. Without time both need as many rows.
[[nodiscard]] Result<Pairing> pair(const Recording& first, const Recording& other,
                                   double shift = 0);

}  // namespace robomosp::recording
