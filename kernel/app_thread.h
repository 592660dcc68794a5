// SPDX-License-Identifier: Apache-2.0
// The application thread: who it is, and a queue through which other threads hand it work
// (layer: core).
#pragma once

#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace robomosp {

/// Belongs to the thread that constructed it. post() from anywhere, pump() on that thread.
class AppThread {
 public:
  void post(std::function<void()> task);  ///< [any thread]
  std::size_t pump();  ///< runs what was posted; returns how many [application thread]
  [[nodiscard]] bool is_current() const { return std::this_thread::get_id() == owner_; }

 private:
  std::thread::id owner_ = std::this_thread::get_id();
  std::mutex mutex_;
  std::vector<std::function<void()>> tasks_;  // guarded by mutex_
};

}  // namespace robomosp
