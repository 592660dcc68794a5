// SPDX-License-Identifier: Apache-2.0
// `robomosp plugin`, `commands` and `doctor` (layer: application, shell only).
#pragma once

#include <string>
#include <vector>

#include "shell/program.h"

namespace robomosp::shell {

// Each returns the exit code.
int run_plugin_list(const Settings&, const Voice&);
int run_plugin_check(const Voice&, const std::string& file);
int run_plugin_test(const Voice&, const std::string& file, const std::string& sdk,
                    const std::vector<std::string>& options);
int run_commands(const Settings&, const Voice&, const std::string& folder);
int run_doctor(const Settings&, const Voice&);

}  // namespace robomosp::shell
