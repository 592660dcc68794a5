// SPDX-License-Identifier: Apache-2.0
// Adds a column to a recording (layer: application, sim).
#pragma once

#include <algorithm>
#include <utility>

#include "recording/recording.h"

namespace robomosp::sim {

/// Adds a column, or replaces the column with the same name in its place.
inline void put_column(recording::Recording& r, recording::Column c) {
  const auto old = std::find_if(r.columns.begin(), r.columns.end(),
                                [&](const recording::Column& each) { return each.name == c.name; });
  if (old == r.columns.end()) r.columns.push_back(std::move(c));
  else *old = std::move(c);
}

}  // namespace robomosp::sim
