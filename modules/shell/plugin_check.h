// SPDX-License-Identifier: Apache-2.0
// `robomosp plugin check FILE`: loads a plugin in a child process, so that a crash is a report
// (layer: application, shell).
#pragma once

#include <string>

#include "kernel/value.h"

namespace robomosp::shell {

struct PluginCheck {
  int exit_code = 0;  ///< 0 accepted, 3 refused or crashed
  std::string text;   ///< for people
  Map report;         ///< the same for programs
};

/// Must be called before the program has threads: it forks.
[[nodiscard]] PluginCheck check_plugin(const std::string& file);

}  // namespace robomosp::shell
