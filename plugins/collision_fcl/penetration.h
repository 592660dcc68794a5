// SPDX-License-Identifier: Apache-2.0
// How deep two convex shapes are in each other (layer: plugin, collision_fcl). Of our own, because
// FCL's ends the process by an assertion on some pairs of overlapping cylinders.
#pragma once

#include "convex.h"

namespace robomosp::collision_fcl {

/// The least way out of each other: `distance` is minus the depth, of shapes that overlap; points
/// in the frame of the first. Expanding polytope (van den Bergen, Game Developers Conference 2001),
/// started from supports all round. Exact for polytopes; where surfaces are round the depth is an
/// upper bound within about 1e-6 of the size.
[[nodiscard]] Apart penetration(const Core& a, const Core& b, const Pose& a_T_b);

}  // namespace robomosp::collision_fcl
