// SPDX-License-Identifier: Apache-2.0
// Live runs of this session of the program, by the numbers of their handles (layer: application).
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "document/document.h"
#include "kernel/value.h"
#include "sim/live_run.h"
#include "sim/pulls.h"
#include "task/run.h"

namespace robomosp::ioci {

/// Breakpoints of a run, preserved by run.refresh and run.reset. [any thread]
struct Breakpoints {
  struct One {
    std::int64_t number = 0;
    std::string program;    ///< by its name in the world
    std::uint32_t own = 0;  ///< number assigned by its machine
    program::Breakpoint what;
  };
  /// Sets the breakpoints in machines of programs that start, or continue at a run's position, with
  /// their hit counts. Returns a note for each that has no place any more; it is kept.
  std::vector<std::string> set_all(std::vector<task::ProgramActor>&,
                                   const task::ProgramWatch::Stand*);
  /// How programs start next time: run, or stop before the first statement; `waits` also applies
  /// breakpoints that are set in the meantime.
  enum class Entry : std::uint8_t { runs, stops, waits };
  std::mutex mutex;
  Entry entry = Entry::runs;        // guarded by mutex
  std::int64_t next = 1;            // guarded by mutex
  std::map<std::int64_t, One> all;  // guarded by mutex; by number
  /// Numbers by program and by the number assigned by its machine. Guarded by mutex.
  std::map<std::pair<std::string, std::uint32_t>, std::int64_t> numbers;
};

struct LiveRunEntry {
  std::string title;  ///< "cell: physics"
  std::string of;     ///< what is simulated, as requested
  Handle subject;     ///< the world or robot
  Map with;           ///< arguments of the simulation, as they were given
  std::unique_ptr<sim::LiveRun> run;
  std::shared_ptr<Breakpoints> breakpoints = std::make_shared<Breakpoints>();
  sim::Pulls pulls;                     ///< of run.pull
  std::atomic<bool> has_forces{false};  ///< it is computed row by row from forces: pulls act

  /// Its programs; null = none, or it is not computed row by row.
  [[nodiscard]] std::shared_ptr<task::ProgramWatch> watch() const {
    const std::lock_guard lock(mutex_);
    return watch_;
  }
  void set_watch(std::shared_ptr<task::ProgramWatch> watch) {
    const std::lock_guard lock(mutex_);
    watch_ = std::move(watch);
  }
  /// The records used by the simulation.
  [[nodiscard]] document::SnapshotPtr snapshot() const {
    const std::lock_guard lock(mutex_);
    return snapshot_;
  }
  void set_snapshot(document::SnapshotPtr now) {
    const std::lock_guard lock(mutex_);
    snapshot_.swap(now);
  }

 private:
  mutable std::mutex mutex_;
  document::SnapshotPtr snapshot_;             // guarded by mutex_
  std::shared_ptr<task::ProgramWatch> watch_;  // guarded by mutex_
};

using LiveRunPtr = std::shared_ptr<LiveRunEntry>;

/// Run state, outside the document and its history. [any thread]
class Runs {
 public:
  std::uint64_t add(LiveRunPtr entry) {
    const std::lock_guard lock(mutex_);
    entries_.emplace(next_, std::move(entry));
    return next_++;
  }
  /// Null if no run has that number.
  [[nodiscard]] LiveRunPtr find(std::uint64_t number) const {
    const std::lock_guard lock(mutex_);
    const auto it = entries_.find(number);
    return it == entries_.end() ? nullptr : it->second;
  }
  /// The run ends when its last user releases it.
  LiveRunPtr remove(std::uint64_t number) {
    const std::lock_guard lock(mutex_);
    const auto node = entries_.extract(number);
    return node.empty() ? nullptr : node.mapped();
  }
  [[nodiscard]] std::vector<std::pair<std::uint64_t, LiveRunPtr>> list() const {
    const std::lock_guard lock(mutex_);
    return {entries_.begin(), entries_.end()};
  }

 private:
  mutable std::mutex mutex_;
  std::uint64_t next_ = 1;                       // number of a handle, never reused
  std::map<std::uint64_t, LiveRunPtr> entries_;  // guarded by mutex_
};

}  // namespace robomosp::ioci
