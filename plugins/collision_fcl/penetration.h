// SPDX-License-Identifier: Apache-2.0
// Penetration depth of two convex shapes (layer: plugin, collision_fcl). Implemented here because
// FCL's function ends the process by an assertion on some pairs of overlapping cylinders.
#pragma once

#include "convex.h"

namespace robomosp::collision_fcl {

/// The minimal translation that separates overlapping shapes: `distance` is minus the depth; points
/// in the frame of the first. Expanding polytope (van den Bergen, Game Developers Conference 2001),
/// started from supports in all directions. Exact for polytopes; for round surfaces the depth is an
/// upper bound within about 1e-6 of the size.
[[nodiscard]] Apart penetration(const Core& a, const Core& b, const Pose& a_T_b);

}  // namespace robomosp::collision_fcl
