// SPDX-License-Identifier: Apache-2.0
// Marks code of plugins that runs at program start, after they were opened (layer: core).
#pragma once

#include <filesystem>
#include <memory>

namespace robomosp {

/// During its lifetime, marks that code of a plugin's file is running that did not run when the
/// file was opened. If the process ends meanwhile, the next start knows which file was to blame
/// (PluginTrials::Opening). Null if failures are not recorded. [the thread that loads plugins]
[[nodiscard]] std::shared_ptr<void> mark_opening(const std::filesystem::path& file);

}  // namespace robomosp
