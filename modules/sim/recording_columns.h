// SPDX-License-Identifier: Apache-2.0
// Columns that are computed from those of a recording: rates, power, energies, the tool's motion
// and force, how much of the limits is used, expressions (layer: application, sim).
#pragma once

#include <span>
#include <string>

#include "sim/recording.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// Sets the limits of the columns q, qd, qdd, qddd and tau of joints of one coordinate.
void mark_limits(Recording& recording, const RobotModel& model);

}  // namespace robomosp::sim
