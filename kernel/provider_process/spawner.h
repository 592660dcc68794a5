// SPDX-License-Identifier: Apache-2.0
// Spawner: starts processes that the system ends with this one. It does so when the thread that
// started them ends, so that is one which lasts (layer: core).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::apart {

/// Starts a program with descriptor 0 and, for what it prints, 1 and 2. Gives its number. [any
/// thread; waits for the start]
[[nodiscard]] Result<int> spawn_for_good(std::filesystem::path program,
                                         std::vector<std::string> arguments, int in, int out);

}  // namespace robomosp::apart
