// SPDX-License-Identifier: Apache-2.0
// The user's settings of where plugins run, stored in ~/.config/robomosp/plugins (layer:
// application, ioci).
#pragma once

#include <filesystem>

#include <robomosp/sdk/result.h>

#include "kernel/plugin_run.h"

namespace robomosp::ioci {

/// $XDG_CONFIG_HOME/robomosp/plugins or ~/.config/robomosp/plugins; empty if there is no home
/// folder.
[[nodiscard]] std::filesystem::path kept_plugin_runs_file();

/// Files that run in separate processes; unreadable lines are skipped.
[[nodiscard]] PluginRuns::Wishes kept_plugin_runs();

/// Stores where a file runs; removes the entry of a file that runs in the program, the default.
Result<void> keep_plugin_run(const std::filesystem::path& file, const PluginRun& run);

}  // namespace robomosp::ioci
