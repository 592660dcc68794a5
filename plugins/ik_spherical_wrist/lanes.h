// SPDX-License-Identifier: Apache-2.0
// The closed forms of arms with parallel axes: all eight branches side by side, as lanes of vector
// registers (layer: plugin).
#pragma once

#include "candidates.h"
#include "family.h"

namespace robomosp::ik_spherical_wrist {

/// Fills all lanes. Chosen once a process for the processor's vector width.
using LaneSolver = void (*)(const ParallelArm&, const Question&, Candidates&);
[[nodiscard]] LaneSolver lane_solver();

}  // namespace robomosp::ik_spherical_wrist
