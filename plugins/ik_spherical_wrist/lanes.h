// SPDX-License-Identifier: Apache-2.0
// The closed forms of arms with parallel axes: all eight branches side by side, as lanes of vector
// registers (layer: plugin).
#pragma once

#include "candidates.h"
#include "family.h"

namespace robomosp::ik_spherical_wrist {

/// For the processor's vector width.
struct LaneSolver {
  void (*solve)(const ParallelArm&, const Question&, Candidates&) = nullptr;  ///< fills all lanes
  void (*sines_cosines)(const double* q, double* sine, double* cosine) = nullptr;  ///< of 8 angles
};
[[nodiscard]] LaneSolver lane_solver();

}  // namespace robomosp::ik_spherical_wrist
