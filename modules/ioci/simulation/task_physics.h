// SPDX-License-Identifier: Apache-2.0
// Contact physics that runs of tasks and programs take along (layer: application, ioci only).
#pragma once

#include <optional>

#include "ioci/core/command.h"
#include "sim/physics.h"

namespace robomosp::ioci {

/// The argument physics of what runs tasks and programs.
[[nodiscard]] ParamSpec task_physics_field();
/// What it asks for; none = it is left out or false. The world is not set.
Result<std::optional<sim::PhysicsRun>> task_physics(CommandContext&, const Map& args);

}  // namespace robomosp::ioci
