// SPDX-License-Identifier: Apache-2.0
#include "ioci/commands.h"

namespace robomosp::ioci {

std::vector<CommandSpec> solid_commands() { return {}; }

}  // namespace robomosp::ioci
