// SPDX-License-Identifier: Apache-2.0
// Pairs of links of a robot that need no collision check, for file formats that list them (layer:
// application, exchange).
#pragma once

#include <cstdint>
#include <vector>

#include <robomosp/sdk/io.h>

#include "evaluation/sources.h"
#include "model/kind.h"

namespace robomosp::exchange {

/// All pairs of links that the robot's collision model does not check, and those that touch in none
/// or all of `samples` random configurations within the limits, in the order of the links.
[[nodiscard]] Result<std::vector<ExportPair>> export_pairs(const evaluation::Sources&, RobotId,
                                                           std::size_t samples, std::uint64_t seed,
                                                           Progress&);

}  // namespace robomosp::exchange
