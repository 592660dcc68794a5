// SPDX-License-Identifier: Apache-2.0
// The kernels of lanes_kernel.cpp, one per instruction set (layer: plugin).
#pragma once

#include "candidates.h"
#include "family.h"

namespace robomosp::ik_spherical_wrist {

/// Up to kTogether targets of one arm, sample after sample.
struct LaneQuestions {
  const double* targets;    ///< 12 numbers each: base_T_tip, R row-major, then p
  const double* near;       ///< 6 angles each [rad]
  const double* tip_wrist;  ///< the wrist point in the tip frame [m]
  const double *lower, *upper;
  double touch;
  std::size_t count;
};

/// Placements of the joints at q = 0, each relative to the previous one, then the tool: 12 numbers
/// each.
using ArmPlaces = std::array<double, 7 * 12>;

/// The kernels of one instruction set.
struct LaneSolver {
  /// Fills all lanes of all requests, except `rank`.
  void (*solve)(const ParallelArm& arm, const LaneQuestions& questions, Candidates* out);
  void (*rank)(Candidates* candidates, std::size_t count);  ///< fills Candidates::rank
  /// Distance of the tip at q (6 angles per sample) from the targets [m], and the sum of the
  /// squared differences of the rotation matrices' elements; arrays have space for kTogether
  /// samples.
  void (*measure)(const ArmPlaces& places, const LaneQuestions& questions, const double* q,
                  double* distance, double* square);
};

namespace baseline {
const LaneSolver& lane_solver();
}
namespace avx2 {
const LaneSolver& lane_solver();
}
namespace avx512 {
const LaneSolver& lane_solver();
}

}  // namespace robomosp::ik_spherical_wrist
