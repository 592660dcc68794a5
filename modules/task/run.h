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

/// Others in the world of a run, who act while it goes on. [the thread that runs]
class Outside {
 public:
  virtual ~Outside() = default;
  /// At each row, when all that happens up to `now` has happened: sets signals that others have set
  /// (TaskExecutor::set_signal), and looks at what there is to see. `is_idle` = nothing goes on
  /// until one is set. `is_over` = this is the last time. May take as long as it likes; an error
  /// ends the run.
  virtual Result<void> row(TaskExecutor&, const std::vector<ProgramActor>&, double now,
                           bool is_idle, bool is_over) = 0;
};

struct TaskRun {
  WorldId world;
  std::vector<std::string> tasks;  ///< placed tasks; empty = all of the world
  bool has_tasks = true;           ///< false = none, whatever `tasks` says
  std::vector<ProgramInWorld> programs;
  double sample_time = 0.02;               ///< between rows [s]
  double most_time = 3600;                 ///< a run that takes longer is an error [s]
  double duration = 0;                     ///< above 0: what is not over by then ends there [s]
  std::optional<sim::PhysicsRun> physics;  ///< contact physics on the same clock; none = things
                                           ///< stay where they are put
  Outside* outside = nullptr;  ///< of runs without a sink; waits for signals have no end then
  /// Gets the notes of a run without a sink that ends in a fault, and so gives no recording.
  std::vector<std::string>* until_fault = nullptr;
};

/// What a debugger and the run that it looks at share: the machines as they are now, and as they
/// were behind each row. A run holds the mutex while it computes.
struct ProgramWatch {
  std::mutex mutex;
  // Guarded by mutex:
  std::vector<ProgramActor> programs;  ///< in the order of TaskRun::programs
  /// Behind a row of the recording, or where a program was stopped at the same time again.
  struct Row {
    double time = 0;
    std::vector<program::Machine> machines;
    bool is_stopped = false;  ///< a program stands here
    std::size_t stopped_at = 0;
  };
  std::vector<Row> rows;
  std::uint64_t bytes = 0;  ///< of the machines in rows
  /// Of rows at one time the one that is looked at, while `shown` is shown.
  struct Chosen {
    std::size_t row = 0;
    double shown = 0;
    std::size_t rows = 0;  ///< that there were
  };
  std::optional<Chosen> chosen;
  /// Sets breakpoints: before the first instruction, or where a run goes on. What it gives are
  /// notes.
  std::function<std::vector<std::string>(std::vector<ProgramActor>&)> begin;
  /// How a run stood that is to go on with an edited world: it is computed anew to there without a
  /// stop, and stands as it stood. Not guarded; does not change.
  struct Stand {
    std::vector<std::pair<std::string, program::Machine>> programs;  ///< by name
    std::optional<std::size_t> stopped;                              ///< which of them stands
  };
  std::optional<Stand> stand;
  /// What was typed for READ, by program; a run reads on where it has come to.
  std::map<std::string, std::vector<std::string>> lines;
  double now = 0;
  bool is_stopped = false;     ///< a program stands at a breakpoint, behind a step, or asks
  std::size_t stopped_at = 0;  ///< which
  /// A program that computes stops when it sees this. Not guarded.
  std::atomic<bool> wants_pause{false};
};

/// What rows of a ProgramWatch may take; beyond it every second older one is given up [bytes].
inline constexpr std::uint64_t kMostWatchedBytes = std::uint64_t{1} << 30;

/// Every task and program runs by itself from t = 0, but for tasks that programs start; moves and
/// waits take time, all else none.
/// Columns: time,
/// `<robot>.q1`, `<robot>.qd1`, `<robot>.qdd1`, ... of all robots, `signal.<name>`, and the poses
/// `<object>.x .y .z .qw .qx .qy .qz` of the objects that were held; notes tell what was taken, put
/// down and said, and when. Equal worlds give equal recordings. Errors name task and step: a place
/// out of reach, two tasks that move one robot at once, waits that can never come true; of programs
/// file, line and column. Programs have a column `<program>.line`.
///
/// With physics objects that nobody holds fall, touch, slide and are pushed by robots, in its
/// steps, and conditions, grips and places of frames see them there; they have columns from the
/// start. The run is over when the tasks and programs are.
///
/// With a sink every row is handed on as it is made. With a watch besides, programs can be stopped;
/// then the sink rests. `from` = a time [s] at which a run of before goes on: rows and notes up to
/// it are not handed on again; a run that is over before is an error.
[[nodiscard]] Result<recording::RecordingPtr> run(const sim::Simulator&, const TaskRun&, Progress&,
                                                  sim::RowSink* sink = nullptr,
                                                  ProgramWatch* watch = nullptr,
                                                  std::optional<double> from = std::nullopt);

}  // namespace robomosp::task
