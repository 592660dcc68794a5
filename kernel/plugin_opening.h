// SPDX-License-Identifier: Apache-2.0
// Code of plugins that runs when the program starts, after they were opened (layer: core).
#pragma once

#include <filesystem>
#include <memory>

namespace robomosp {

/// Marks, as long as it lives, that code of a plugin's file runs here that its opening did not run:
/// whatever ends the process meanwhile, the next start knows the file (PluginTrials::Opening). Null
/// where nothing is remembered. [the thread that loads plugins]
[[nodiscard]] std::shared_ptr<void> mark_opening(const std::filesystem::path& file);

}  // namespace robomosp
