// SPDX-License-Identifier: Apache-2.0
// `robomosp plugin check FILE`: loads a plugin in a child process, so that a crash is a report
// (layer: application, shell).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp::shell {

struct PluginCheck {
  int exit_code = 0;  ///< 0 accepted, 3 refused, crashed, too slow, or nothing in it can be used
  std::string text;   ///< for people
  Map report;         ///< the same for programs
};

/// Must be called before the program has threads: it forks.
[[nodiscard]] PluginCheck check_plugin(const std::string& file);

/// `robomosp plugin test FILE`: becomes the program that runs the suites of the SDK on every
/// provider of the file; comes back only with an error, such as a plugin that fails its check. That
/// program is the one installed with the SDK at the prefix `sdk` (empty: where this one is
/// installed), or is built from its sources there the first time, in the user's cache. `arguments`
/// are its own: --model, --models, --suite, --runner, and those of GoogleTest.
[[nodiscard]] Result<int> test_plugin(const std::string& file, const std::string& sdk,
                                      const std::vector<std::string>& arguments);

}  // namespace robomosp::shell
