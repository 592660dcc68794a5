// SPDX-License-Identifier: Apache-2.0
// The closed forms of arms with parallel axes: all eight branches side by side, as lanes of vector
// registers (layer: plugin).
#pragma once

#include "lanes_kernel.h"

namespace robomosp::ik_spherical_wrist {

/// For the processor's vector width.
[[nodiscard]] const LaneSolver& lane_solver();

}  // namespace robomosp::ik_spherical_wrist
