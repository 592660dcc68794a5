// SPDX-License-Identifier: Apache-2.0
// Segments of trajectories as statements (layer: data processing, program_source only).
#pragma once

#include <cstdint>
#include <string>

#include "evaluation/sources.h"
#include "model/records.h"
#include "program_source/source.h"

namespace robomosp::program_source {

/// The motions of a trajectory at `base_T_trajectory`, written to the body of `source`;
/// curves that are neither line nor arc are paths through `points` points.
[[nodiscard]] Result<void> write_motions(const evaluation::Sources&, Source& source,
                                         const model::Trajectory&, const Pose& base_T_trajectory,
                                         std::int64_t points);

/// SPEED and what goes with it, of a segment with a trapezoidal law.
[[nodiscard]] Result<std::string> trapezoid_words(const evaluation::Sources&,
                                                  const model::TrajectorySegment&, Source&);

}  // namespace robomosp::program_source
