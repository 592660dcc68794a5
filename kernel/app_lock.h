// SPDX-License-Identifier: Apache-2.0
// The application lock: whoever holds it is the application for that moment (layer: core).
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

/// One mutex for the document, its history and what sessions share. Nobody computes, waits or calls
/// a provider, a script or a subscriber while holding it; what must be called is put off with
/// later() until it is free again. A thread that holds it may take it again. [any thread]
class AppLock {
 public:
  /// Holding it longer than this is a defect; it is counted.
  static constexpr std::chrono::milliseconds kLongestHold{50};
  /// Time that passes for the holder. Tests leave out the time that the thread waited for a core.
  using Clock = std::function<std::chrono::nanoseconds()>;

  AppLock() = default;
  AppLock(const AppLock&) = delete;
  AppLock& operator=(const AppLock&) = delete;

  /// Holds it for a scope; `who` names the holder where it is held too long, and outlives the
  /// scope.
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
    bool outer_;  ///< this thread held it already
  };

  /// Whether this thread holds it.
  [[nodiscard]] bool is_held() const;
  /// Whether this thread holds any application lock; then it must not compute or wait.
  [[nodiscard]] static bool is_any_held();
  /// Counts a call of a provider or script by a thread that holds one, which is a defect.
  static void expect_free();
  /// Calls `task` once this thread holds the lock no more, after those that were put off before it,
  /// and never two at a time. It may be called by another thread that is at it already; where more
  /// is put off than that one gets done, those who put it off wait a little and then take turns.
  void later(std::function<void()> task);
  /// Calls what was put off, unless this thread holds the lock.
  void flush();

  struct Stats {
    std::uint64_t holds = 0;
    std::uint64_t long_holds = 0;  ///< longer than kLongestHold
    std::chrono::nanoseconds longest{0};
    std::string longest_by;
    std::uint64_t calls_within = 0;  ///< of providers and scripts while it was held
  };
  [[nodiscard]] Stats stats() const;
  /// Empty = the steady clock. Not while anything runs.
  void set_clock(Clock clock) { clock_ = std::move(clock); }
  /// Called, put off, after each hold that was too long. Not while anything runs.
  void on_long_hold(std::function<void(const std::string& who, std::chrono::nanoseconds)> report) {
    report_ = std::move(report);
  }

 private:
  friend class Hold;
  bool take(std::string_view who);  ///< true if this thread held it already
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
  std::thread::id flushing_;                 // guarded by tasks_mutex_; which thread is at it
  std::size_t waiting_ = 0;                  // guarded by tasks_mutex_; for their turn
  bool is_handed_on_ = false;                // guarded by tasks_mutex_; to one who waits
  std::uint64_t turns_ = 0;                  // guarded by tasks_mutex_; handed on so far
  std::condition_variable turn_;
  std::atomic<bool> has_tasks_{false};
};

}  // namespace robomosp
