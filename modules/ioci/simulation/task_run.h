// SPDX-License-Identifier: Apache-2.0
// Runs of the tasks and programs of a world, from arguments (layer: application, ioci only).
#pragma once

#include "ioci/core/command.h"
#include "task/run.h"

namespace robomosp::ioci {

/// What world.run_task was asked for.
Result<task::TaskRun> task_run(CommandContext&, const Map& args);

}  // namespace robomosp::ioci
