// SPDX-License-Identifier: Apache-2.0
// CallQueue: calls that other threads hand to the one thread that may answer them, such as that of
// a script, and ways to wait that answer them meanwhile (layer: core).
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace robomosp {

/// Belongs to the thread that made it, its owner, which answers where it waits (wait_serving(), or
/// serve() in a loop of its own), not in the middle of its own work. [any thread] unless marked.
class CallQueue {
 public:
  CallQueue() = default;
  CallQueue(const CallQueue&) = delete;
  CallQueue& operator=(const CallQueue&) = delete;
  [[nodiscard]] bool is_owner() const { return std::this_thread::get_id() == owner_; }

  enum class Outcome : std::uint8_t {
    done,
    late,     ///< the owner did not come to it within the limit
    closed,   ///< the owner is gone
    given_up  ///< the caller asked to end
  };
  /// Has `fn` called by the owner and waits for its end. `limit` counts until it begins; `gives_up`
  /// (may be empty) is asked every 50 ms until then. Not for the owner.
  [[nodiscard]] Outcome call(const std::function<void()>& fn, std::chrono::milliseconds limit,
                             const std::function<bool()>& gives_up = {});
  /// Answers what waits; returns how many. [owner]
  std::size_t serve();
  /// Whether this thread is just answering a call of another one.
  [[nodiscard]] static bool is_serving();
  [[nodiscard]] bool has_calls() const { return waiting_.load(std::memory_order_acquire) > 0; }
  /// Somebody for whom the owner answers came or went; without one, what waits is refused, and all
  /// that comes. [owner]
  void open();
  void close();

  /// Calls `wake` at each new call while it lives; make and destroy it with no lock held that
  /// `wake` takes. [owner]
  class Waker {
   public:
    Waker(CallQueue& queue, std::function<void()> wake);
    ~Waker();
    Waker(const Waker&) = delete;
    Waker& operator=(const Waker&) = delete;

   private:
    friend class CallQueue;
    CallQueue& queue_;
    std::function<void()> wake_;
  };

  /// The one of this thread; it lives as long as somebody shares it.
  [[nodiscard]] static std::shared_ptr<CallQueue> for_this_thread();
  /// The same, null where this thread answers nobody. Other threads may let go of it at any time.
  [[nodiscard]] static std::shared_ptr<CallQueue> of_this_thread();

 private:
  struct Call;
  const std::thread::id owner_ = std::this_thread::get_id();
  std::mutex mutex_;
  std::condition_variable done_;
  std::deque<Call*> calls_;     // guarded by mutex_; the callers own them
  std::vector<Waker*> wakers_;  // guarded by mutex_
  std::size_t opened_ = 0;      // guarded by mutex_
  std::atomic<std::size_t> waiting_{0};
};

/// Waits on `cv` until `is_done` or the time is over, and answers what is handed to this thread
/// meanwhile. `lock` holds the mutex that goes with `cv`. False when the time is over first.
template <class Cv, class Done, class Rep, class Period>
bool wait_serving(std::unique_lock<std::mutex>& lock, Cv& cv,
                  std::chrono::duration<Rep, Period> at_most, Done is_done) {
  if (is_done()) return true;
  const std::shared_ptr<CallQueue> queue = CallQueue::of_this_thread();
  if (!queue) return cv.wait_for(lock, at_most, is_done);
  const auto end = std::chrono::steady_clock::now() + at_most;
  std::mutex& mutex = *lock.mutex();
  bool done = false;
  lock.unlock();
  {
    const CallQueue::Waker waker(*queue, [&] {
      const std::lock_guard guard(mutex);  // the waiter is either before its look or asleep
      cv.notify_all();
    });
    lock.lock();
    for (;;) {
      done = is_done();
      if (done || std::chrono::steady_clock::now() >= end) break;
      if (queue->has_calls()) {
        lock.unlock();
        queue->serve();
        lock.lock();
        continue;
      }
      cv.wait_until(lock, end, [&] { return is_done() || queue->has_calls(); });
    }
    lock.unlock();
  }
  lock.lock();
  return done || is_done();
}
template <class Cv, class Done>
void wait_serving(std::unique_lock<std::mutex>& lock, Cv& cv, Done is_done) {
  while (!wait_serving(lock, cv, std::chrono::hours(1), is_done)) {
  }
}

}  // namespace robomosp
