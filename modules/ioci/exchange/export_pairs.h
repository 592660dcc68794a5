// SPDX-License-Identifier: Apache-2.0
// Pairs of links of a robot that need no collision check, for file formats that list them (layer:
// application, ioci).
#pragma once

#include <cstdint>
#include <vector>

#include <robomosp/sdk/io.h>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// All pairs of links that the robot's collision model does not check, and those that touch in none
/// or all of `samples` random configurations within the limits, in the order of the links.
[[nodiscard]] Result<std::vector<ExportPair>> export_pairs(CommandContext&, RobotId,
                                                           std::size_t samples, std::uint64_t seed);

}  // namespace robomosp::ioci
