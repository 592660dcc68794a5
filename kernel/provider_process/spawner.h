// SPDX-License-Identifier: Apache-2.0
// Spawner: starts processes that the system ends with this one. The system does so when the
// starting thread ends, so a thread that lasts as long as the program starts them (layer: core).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

namespace robomosp::apart {

/// Starts a program with the given descriptor 0, and descriptors 1 and 2 for its output. Returns
/// its process id. [any thread; waits for the start]
[[nodiscard]] Result<int> spawn_for_good(std::filesystem::path program,
                                         std::vector<std::string> arguments, int in, int out);

}  // namespace robomosp::apart
