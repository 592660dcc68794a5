// SPDX-License-Identifier: Apache-2.0
// The console, on a terminal or from a pipe (layer: application, shell only).
#pragma once

#include <string_view>

#include "shell/program.h"

namespace robomosp::shell {

/// Whether these words leave a console, as one would type them.
[[nodiscard]] bool is_leaving(std::string_view input);
/// Returns the exit code.
int run_console(const Settings&, Voice&);

}  // namespace robomosp::shell
