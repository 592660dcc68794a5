// SPDX-License-Identifier: Apache-2.0
// Where the user has plugins run, kept from run to run in ~/.config/robomosp/plugins
// (layer: application, ioci).
#pragma once

#include <filesystem>

#include <robomosp/sdk/result.h>

#include "kernel/plugin_run.h"

namespace robomosp::ioci {

/// $XDG_CONFIG_HOME/robomosp/plugins or ~/.config/robomosp/plugins; empty = there is no home.
[[nodiscard]] std::filesystem::path kept_plugin_runs_file();

/// Of files that run in processes of their own; a line that cannot be read is left out.
[[nodiscard]] PluginRuns::Wishes kept_plugin_runs();

/// Keeps where a file runs; one that runs in the program, as all do, is forgotten.
Result<void> keep_plugin_run(const std::filesystem::path& file, const PluginRun& run);

}  // namespace robomosp::ioci
