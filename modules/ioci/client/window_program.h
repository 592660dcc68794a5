// SPDX-License-Identifier: Apache-2.0
// The program behind a window: an application with the user's folders (layer: application).
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"

namespace robomosp::ioci {

struct WindowProgramOptions {
  std::vector<std::filesystem::path> plugin_path, library;  ///< searched first
  bool keeps_unsaved = true;                                ///< writes a journal of unsaved work
  bool trusts_scripts = false;  ///< runs solvers in Lua that come with files
  /// Called with each message: those of the start by this thread, later ones by any.
  std::function<void(const Message&)> on_message = {};
};

/// Starts the application with the geometry that earlier runs kept.
[[nodiscard]] Result<std::unique_ptr<Application>> start_window_program(WindowProgramOptions);

}  // namespace robomosp::ioci
