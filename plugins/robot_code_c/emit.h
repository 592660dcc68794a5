// SPDX-License-Identifier: Apache-2.0
// C99 text of expressions (layer: plugin).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/robot_code.h>

#include "mechanism.h"

namespace robomosp::robot_code {

/// The header and source `<name>.h`, `<name>.c` of these functions, each single and for batches.
[[nodiscard]] std::vector<CodeFile> write_files(const RobotModel& model, const std::string& name,
                                                const std::vector<Function>& functions);

}  // namespace robomosp::robot_code
