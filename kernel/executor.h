// SPDX-License-Identifier: Apache-2.0
// Executor: the threads of the process, shared by jobs, batches and all other parallel work (layer:
// core).
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "kernel/bell.h"

namespace robomosp {

/// Starts threads on demand; idle ones wait for the next task. [any thread]
class Executor {
 public:
  /// 0 = the number of cores of the machine.
  explicit Executor(std::size_t cores = 0);
  ~Executor();  ///< waits for the tasks
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  /// The executor of the process. All code that would start threads by the number of cores uses it.
  [[nodiscard]] static Executor& of_process();

  /// Runs `task`, which must not throw, on an idle thread or a new one; on the calling thread if
  /// the system cannot start one.
  void run(std::function<void()> task);
  /// Calls part(0) ... part(parts - 1) on this thread and helpers, at most `threads` in parallel,
  /// and returns when all are done. All callers share as many helpers as there are further cores,
  /// so this thread may have to run all parts. Runs calls handed to this thread while it waits.
  /// `part` must not throw.
  void spread(std::size_t parts, std::size_t threads, const std::function<void(std::size_t)>& part);
  [[nodiscard]] std::size_t cores() const { return cores_; }

 private:
  struct Spread;
  struct Task {
    std::function<void()> work;
    bool is_helper = false;  ///< task of spread()
  };
  void work();
  void start(Task task);
  const std::size_t cores_;
  std::mutex mutex_;
  Bell wake_;
  std::deque<Task> tasks_;            // guarded by mutex_
  std::vector<std::thread> threads_;  // guarded by mutex_
  std::size_t busy_ = 0;              // guarded by mutex_; threads running a task
  std::size_t helpers_ = 0;           // guarded by mutex_; those running parts of spread()
  bool is_ending_ = false;            // guarded by mutex_
};

}  // namespace robomosp
