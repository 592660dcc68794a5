// SPDX-License-Identifier: Apache-2.0
// A placement given as separate arguments, such as position and rpy (layer: application, ioci).
#pragma once

#include "ioci/core/commands.h"
#include "model/placement.h"

namespace robomosp::ioci {

/// True if the caller gave any argument of a placement.
[[nodiscard]] bool has_placement(const CommandContext& ctx);

/// The placement the caller gave; `what` is the path in messages, such as "tool".
[[nodiscard]] Result<model::Placement> placement_given(const CommandContext& ctx,
                                                       const std::string& what);

}  // namespace robomosp::ioci
