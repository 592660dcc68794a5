// SPDX-License-Identifier: Apache-2.0
#include "kernel/app_thread.h"

#include <cstdio>
#include <exception>
#include <utility>

#include "kernel/check.h"

namespace robomosp {

void AppThread::post(std::function<void()> task) {
  const std::lock_guard lock(mutex_);
  tasks_.push_back(std::move(task));
}

std::size_t AppThread::pump() {
  RMP_CHECK(is_current(), "AppThread::pump was called on another thread");
  std::vector<std::function<void()>> tasks;
  {
    const std::lock_guard lock(mutex_);
    tasks.swap(tasks_);  // what they post in turn waits for the next pump
  }
  for (auto& task : tasks) {
    // One wall for all posters: a task that throws must not take the others with it.
    try {
      task();
    } catch (const std::exception& e) {
      std::fprintf(stderr, "robomosp: a task of the application thread threw: %s\n", e.what());
    } catch (...) {
      std::fprintf(stderr,
                   "robomosp: a task of the application thread threw an unknown exception\n");
    }
  }
  return tasks.size();
}

}  // namespace robomosp
