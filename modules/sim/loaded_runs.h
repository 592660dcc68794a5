// SPDX-License-Identifier: Apache-2.0
// Runs along a trajectory under a force on the robot (layer: application, sim).
#pragma once

#include "sim/retime.h"
#include "sim/simulate.h"
#include "sim/tip_load.h"

namespace robomosp::sim {

/// Simulator::inverse_dynamics() under a load. With one, tau includes it, and there are columns for
/// its part tau_external = -J^T F, for its force and moment in the world's axes, wrench1 to
/// wrench6, and for the path length of its tip, path [m].
[[nodiscard]] Result<recording::RecordingPtr> inverse_dynamics(const Simulator&, const Run&,
                                                               const TipLoad&, Progress&);
/// Simulator::time_optimal() under a load, which uses part of the torque limits. A load over time
/// is an error, since the timing depends on the load.
[[nodiscard]] Result<recording::RecordingPtr> time_optimal(const Simulator&, const Run&,
                                                           const RetimeOptions&, const TipLoad&,
                                                           Progress&);

}  // namespace robomosp::sim
