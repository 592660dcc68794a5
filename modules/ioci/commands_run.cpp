// SPDX-License-Identifier: Apache-2.0
// Live runs: simulations that are stepped, played, paused and run backwards.
#include "ioci/commands.h"
#include "ioci/live_runs.h"

namespace robomosp::ioci {

std::vector<CommandSpec> run_commands() { return {}; }

}  // namespace robomosp::ioci
