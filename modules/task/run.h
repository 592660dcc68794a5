// SPDX-License-Identifier: Apache-2.0
// Runs tasks and programs of a world on one clock, several robots together (layer: application,
// task).
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "recording/recording.h"
#include "sim/physics.h"
#include "sim/row_sink.h"
#include "sim/simulate.h"
#include "task/program_actor.h"

namespace robomosp::task {

/// Observers of a run that may act on its world. [the run's thread]
class Outside {
 public:
  virtual ~Outside() = default;
  /// Called at each row, after everything up to `now` has happened: sets signals changed from
  /// outside (TaskExecutor::set_signal), and reads the state. `is_idle` = nothing happens until a
  /// signal is set. `is_over` = this is the last call. May block; an error ends the run.
  virtual Result<void> row(TaskExecutor&, const std::vector<ProgramActor>&, double now,
                           bool is_idle, bool is_over) = 0;
};

struct TaskRun {
  WorldId world;
  std::vector<std::string> tasks;  ///< placed tasks; empty = all of the world
  bool has_tasks = true;           ///< false = none, regardless of `tasks`
  std::vector<ProgramInWorld> programs;
  double sample_time = 0.02;               ///< between rows [s]
  double most_time = 3600;                 ///< a run that takes longer is an error [s]
  double duration = 0;                     ///< above 0: whatever is not over by then ends there [s]
  std::optional<sim::PhysicsRun> physics;  ///< contact physics on the same clock; empty = objects
                                           ///< stay where they are put
  Outside* outside = nullptr;  ///< for runs without a sink; waits for signals then have no limit
  /// Receives the notes of a run without a sink that ends in a fault, and so has no recording.
  std::vector<std::string>* until_fault = nullptr;
};

/// State shared by a debugger and its run: the current machines, and those after each row. A run
/// holds the mutex while it computes.
struct ProgramWatch {
  std::mutex mutex;
  // Guarded by mutex:
  std::vector<ProgramActor> programs;  ///< in the order of TaskRun::programs
  /// After a row of the recording, or where a program stopped again at the same time.
  struct Row {
    double time = 0;
    std::vector<program::Machine> machines;
    bool is_stopped = false;  ///< a program is stopped here
    std::size_t stopped_at = 0;
  };
  std::vector<Row> rows;
  std::uint64_t bytes = 0;  ///< of the machines in rows
  /// The selected one of the rows at one time, while `shown` is shown.
  struct Chosen {
    std::size_t row = 0;
    double shown = 0;
    std::size_t rows = 0;  ///< total number of rows
  };
  std::optional<Chosen> chosen;
  /// Sets breakpoints: before the first instruction, or where a run continues. Returns notes.
  std::function<std::vector<std::string>(std::vector<ProgramActor>&)> begin;
  /// Where a run was stopped that continues in an edited world: it is recomputed up to there, and
  /// stops in the same state. Not guarded; constant.
  struct Stand {
    std::vector<std::pair<std::string, program::Machine>> programs;  ///< by name
    std::optional<std::size_t> stopped;                              ///< index of the stopped one
  };
  std::optional<Stand> stand;
  /// Input typed for READ, by program; a run continues to read where it was.
  std::map<std::string, std::vector<std::string>> lines;
  double now = 0;
  bool is_stopped = false;     ///< a program is at a breakpoint, after a step, or waits for input
  std::size_t stopped_at = 0;  ///< its index
  /// A running program stops when this is set. Not guarded.
  std::atomic<bool> wants_pause{false};
};

/// Memory limit for rows of a ProgramWatch; beyond it every second older one is dropped [bytes].
inline constexpr std::uint64_t kMostWatchedBytes = std::uint64_t{1} << 30;

/// Every task and program runs independently from t = 0, except tasks started by programs; moves
/// and waits take time, everything else none. Columns: time, `<robot>.q1`, `<robot>.qd1`,
/// `<robot>.qdd1`, ... of all robots, `signal.<name>`, and the poses `<object>.x .y .z .qw .qx .qy
/// .qz` of the objects that were held; notes report what was picked up, put down and written, and
/// when. Equal worlds give equal recordings. Errors name task and step: an unreachable pose, two
/// tasks that move one robot at once, waits that can never end; for programs file, line and column.
/// Programs have a column `<program>.line`.
///
/// With physics, free objects fall, touch, slide and are pushed by robots, in its steps, and
/// conditions, grips and poses of frames use these positions; their columns start at t = 0. The run
/// is over when the tasks and programs are.
///
/// With a sink, every row is passed on as it is computed. With a watch in addition, programs can be
/// stopped; the sink is then paused. `from` = a time [s] at which an earlier run continues: rows
/// and notes up to it are not passed on again; a run that ends before is an error.
[[nodiscard]] Result<recording::RecordingPtr> run(const sim::Simulator&, const TaskRun&, Progress&,
                                                  sim::RowSink* sink = nullptr,
                                                  ProgramWatch* watch = nullptr,
                                                  std::optional<double> from = std::nullopt);

}  // namespace robomosp::task
