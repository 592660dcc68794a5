// SPDX-License-Identifier: Apache-2.0
// Runs tasks of a world on one clock, several robots together (layer: application, task).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "recording/recording.h"
#include "sim/simulate.h"

namespace robomosp::task {

struct TaskRun {
  WorldId world;
  std::vector<std::string> tasks;  ///< placed tasks; empty = all of the world
  double sample_time = 0.02;       ///< between rows [s]
  double most_time = 3600;         ///< a run that takes longer is an error [s]
};

/// Every task runs by itself from t = 0; moves and waits take time, all else none. Columns: time,
/// `<robot>.q1`, `<robot>.qd1`, `<robot>.qdd1`, ... of all robots, `signal.<name>`, and the poses
/// `<object>.x .y .z .qw .qx .qy .qz` of the objects that were held; notes tell what was taken, put
/// down and said, and when. Equal worlds give equal recordings. Errors name task and step: a place
/// out of reach, two tasks that move one robot at once, waits that can never come true.
[[nodiscard]] Result<recording::RecordingPtr> run(const sim::Simulator&, const TaskRun&, Progress&);

}  // namespace robomosp::task
