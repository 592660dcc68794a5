// SPDX-License-Identifier: Apache-2.0
// The application lock: only the thread that holds it changes shared state (layer: core).
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

namespace robomosp {

/// One mutex for the document, its history and the state that sessions share. A thread that holds
/// it must not compute, wait, or call a provider, a script or a subscriber; later() defers such
/// calls until the lock is free. The lock is recursive. [any thread]
class AppLock {
 public:
  /// Holding it longer than this is a defect; it is counted.
  static constexpr std::chrono::milliseconds kLongestHold{50};
  /// Clock for hold times. Tests use one that excludes the time the thread waited for a core.
  using Clock = std::function<std::chrono::nanoseconds()>;

  AppLock() = default;
  AppLock(const AppLock&) = delete;
  AppLock& operator=(const AppLock&) = delete;

  /// Holds the lock for a scope; `who` names the holder in reports of long holds, and must outlive
  /// the scope.
  class Hold {
   public:
    Hold(AppLock& lock, std::string_view who) : lock_(lock), outer_(lock.take(who)) {}
    ~Hold() {
      if (!outer_) lock_.release();
    }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    AppLock& lock_;
    bool outer_;  ///< this thread already held it
  };

  /// True if this thread holds the lock.
  [[nodiscard]] bool is_held() const;
  /// True if this thread holds any application lock; then it must not compute or wait.
  [[nodiscard]] static bool is_any_held();
  /// Counts a call of a provider or script by a thread that holds a lock, which is a defect.
  static void expect_free();
  /// Calls `task` once this thread no longer holds the lock, after all tasks deferred before it;
  /// tasks never run concurrently. A thread that is already running tasks may call it. If tasks
  /// arrive faster than that thread runs them, the threads that add them wait briefly and then take
  /// turns.
  void later(std::function<void()> task);
  /// Runs the deferred tasks, unless this thread holds the lock.
  void flush();

  struct Stats {
    std::uint64_t holds = 0;
    std::uint64_t long_holds = 0;  ///< longer than kLongestHold
    std::chrono::nanoseconds longest{0};
    std::string longest_by;
    std::uint64_t calls_within = 0;  ///< calls of providers and scripts by a thread that held the
                                     ///< lock
  };
  [[nodiscard]] Stats stats() const;
  /// Sets the clock; empty = the steady clock. Call it while no other thread runs.
  void set_clock(Clock clock) { clock_ = std::move(clock); }
  /// Callback, deferred, for each hold that was too long. Set it as set_clock().
  void on_long_hold(std::function<void(const std::string& who, std::chrono::nanoseconds)> report) {
    report_ = std::move(report);
  }

 private:
  friend class Hold;
  bool take(std::string_view who);  ///< true if this thread already held the lock
  void release();
  [[nodiscard]] std::chrono::nanoseconds now() const;

  mutable std::mutex mutex_;
  // Guarded by mutex_:
  std::string_view holder_;
  std::chrono::nanoseconds since_{0}, longest_{0};
  std::uint64_t holds_ = 0, long_holds_ = 0, calls_within_ = 0;
  std::string longest_by_;

  Clock clock_;
  std::function<void(const std::string&, std::chrono::nanoseconds)> report_;

  std::mutex tasks_mutex_;
  std::deque<std::function<void()>> tasks_;  // guarded by tasks_mutex_
  bool is_flushing_ = false;                 // guarded by tasks_mutex_
  std::thread::id flushing_;                 // guarded by tasks_mutex_; the thread that runs tasks
  std::size_t waiting_ = 0;                  // guarded by tasks_mutex_; threads waiting for their
                                             // turn
  bool is_handed_on_ = false;                // guarded by tasks_mutex_; a waiting thread runs the
                                             // tasks next
  std::uint64_t turns_ = 0;                  // guarded by tasks_mutex_; number of hand-overs
  std::condition_variable turn_;
  std::atomic<bool> has_tasks_{false};
};

}  // namespace robomosp
