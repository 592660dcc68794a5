// SPDX-License-Identifier: Apache-2.0
// Trajectories that follow the edges of solids (layer: application). Internal to modules/ioci.
#pragma once

#include "ioci/core/command.h"

namespace robomosp::ioci {

/// Called before the open transaction of `ctx` is committed: recomputes the segments of
/// trajectories that follow solids, or paths along edges, changed by it. If that fails, or if the
/// segments were edited, the trajectory keeps its segments, stops following, and a message gives
/// the reason. Costs one check per changed record if no trajectory follows edges.
Result<void> follow_edges(CommandContext& ctx);

}  // namespace robomosp::ioci
