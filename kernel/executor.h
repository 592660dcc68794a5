// SPDX-License-Identifier: Apache-2.0
// Executor: the threads of the process; jobs, batches and whatever else is divided among the cores
// take theirs from here (layer: core).
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace robomosp {

/// Threads are started when they are first needed, and wait for the next task then. [any thread]
class Executor {
 public:
  /// 0 = one core for each that the machine has.
  explicit Executor(std::size_t cores = 0);
  ~Executor();  ///< waits for the tasks
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  /// That of the process. What starts threads by the number of cores takes them from it.
  [[nodiscard]] static Executor& of_process();

  /// Runs `task`, which must not throw, on a thread that is idle, else on a new one; on this one
  /// when the system gives none.
  void run(std::function<void()> task);
  /// Calls part(0) ... part(parts - 1), by this thread and helpers, at most `threads` together, and
  /// returns when all are done. All callers share as many helpers as there are further cores, so it
  /// may be that this thread does it all. Answers calls that are handed to this thread while it
  /// waits. `part` must not throw.
  void spread(std::size_t parts, std::size_t threads, const std::function<void(std::size_t)>& part);
  [[nodiscard]] std::size_t cores() const { return cores_; }

 private:
  struct Spread;
  struct Task {
    std::function<void()> work;
    bool is_helper = false;  ///< given to spread()
  };
  void work();
  void start(Task task);
  const std::size_t cores_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Task> tasks_;            // guarded by mutex_
  std::vector<std::thread> threads_;  // guarded by mutex_
  std::size_t busy_ = 0;              // guarded by mutex_; threads that have a task
  std::size_t helpers_ = 0;           // guarded by mutex_; given to spread()
  bool is_ending_ = false;            // guarded by mutex_
};

}  // namespace robomosp
