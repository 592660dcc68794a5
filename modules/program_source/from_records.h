// SPDX-License-Identifier: Apache-2.0
// Programs of robots written of what a world has already: tasks, trajectories, recordings (layer:
// data processing, program_source).
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "evaluation/sources.h"
#include "model/kind.h"
#include "model/program.h"
#include "recording/recording.h"

namespace robomosp::program_source {

/// A program that is in no document yet.
struct WrittenProgram {
  std::string name;  ///< of its source, as a proposal
  model::Program program;
  std::vector<std::string> notes;  ///< what the program does otherwise, a sentence each
};

/// The motions of the trajectory `w.trajectories[trajectory]` for the robot `w.robots[robot]`.
/// Curves that are neither line nor arc are paths through `points` points (2 to 100,000). Errors
/// name the segment. Cost: linear in segments and points. [any thread]
[[nodiscard]] Result<WrittenProgram> from_trajectory(const evaluation::Sources&, WorldId,
                                                     std::size_t robot, std::size_t trajectory,
                                                     std::int64_t points, const std::string& name,
                                                     Progress&);

/// The task `w.tasks[task]`, with its joint motions timed as a run times them. A step that the
/// language cannot express is an error that names it. Cost: linear in the steps, with those of
/// repeats counted up to three times. [any thread]
[[nodiscard]] Result<WrittenProgram> from_task(const evaluation::Sources&, WorldId,
                                               std::size_t task, const std::string& name,
                                               Progress&);

/// Joint motions through as few rows of a recording as keep all others within `tolerance` [rad or
/// m]. `robot`: of the recording's world; "" = the recording's, or the only one. [any thread]
[[nodiscard]] Result<WrittenProgram> from_recording(const evaluation::Sources&,
                                                    const recording::Recording&,
                                                    const std::string& robot, double tolerance,
                                                    const std::string& name, Progress&);

}  // namespace robomosp::program_source
