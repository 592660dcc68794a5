// SPDX-License-Identifier: Apache-2.0
// CallQueue: calls that other threads hand to the one thread that may run them, such as that of a
// script, and functions to wait while running them (layer: core).
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

/// Belongs to the thread that made it, its owner. The owner runs the calls where it waits
/// (wait_serving(), or serve() in its own loop), never in the middle of other work. [any thread]
/// unless marked.
class CallQueue {
 public:
  CallQueue() = default;
  CallQueue(const CallQueue&) = delete;
  CallQueue& operator=(const CallQueue&) = delete;
  [[nodiscard]] bool is_owner() const { return std::this_thread::get_id() == owner_; }

  enum class Outcome : std::uint8_t {
    done,
    late,     ///< the owner did not start the call within the limit
    closed,   ///< the owner has ended
    given_up  ///< the caller cancelled
  };
  /// Runs `fn` on the owner's thread and waits until it returns. `limit` applies until the call
  /// starts; `gives_up` (may be empty) is polled every 50 ms until then. If this thread has a queue
  /// too, it runs the calls handed to it meanwhile, so that threads may call each other. Not for
  /// the owner.
  [[nodiscard]] Outcome call(const std::function<void()>& fn, std::chrono::milliseconds limit,
                             const std::function<bool()>& gives_up = {});
  /// Runs all waiting calls; returns their number. [owner]
  std::size_t serve();
  /// True if this thread is currently running a call of another thread, or helps one that does.
  /// Then it must not wait for a value that a third thread makes: that one may wait for this call.
  [[nodiscard]] static bool is_serving();

  /// During its lifetime, calls made by this thread wait for their owner without limit, and are
  /// given up once `gives_up` returns true: for background work that can be stopped. [this thread]
  class PatientScope {
   public:
    explicit PatientScope(const std::function<bool()>& gives_up);
    ~PatientScope();
    PatientScope(const PatientScope&) = delete;
    PatientScope& operator=(const PatientScope&) = delete;

   private:
    const std::function<bool()>* before_;
  };
  /// How calls of a thread are made and run, for threads that help it or work on its behalf.
  struct Context {
    bool is_serving = false;
    const std::function<bool()>* gives_up = nullptr;  ///< of a PatientScope; lives as long as that
    [[nodiscard]] static Context here();
  };
  /// Gives this thread the context of another one.
  class ContextScope {
   public:
    explicit ContextScope(const Context& context);
    ~ContextScope();
    ContextScope(const ContextScope&) = delete;
    ContextScope& operator=(const ContextScope&) = delete;

   private:
    const Context before_;
  };
  [[nodiscard]] bool has_calls() const { return waiting_.load(std::memory_order_acquire) > 0; }
  /// open() and close() count the users that the owner runs calls for; without users, waiting and
  /// new calls are refused. [owner]
  void open();
  void close();

  /// Calls `wake` for each new call during its lifetime. Create and destroy it without holding any
  /// lock that `wake` acquires. [owner]
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

  /// The queue of this thread; it lives as long as a shared owner exists.
  [[nodiscard]] static std::shared_ptr<CallQueue> for_this_thread();
  /// The same, null if this thread has no queue. Other threads may release it at any time.
  [[nodiscard]] static std::shared_ptr<CallQueue> of_this_thread();

 private:
  struct Call;
  const std::thread::id owner_ = std::this_thread::get_id();
  std::mutex mutex_;            // locked before the mutex of a call
  std::deque<Call*> calls_;     // guarded by mutex_; the callers own them
  std::vector<Waker*> wakers_;  // guarded by mutex_
  std::size_t opened_ = 0;      // guarded by mutex_
  std::atomic<std::size_t> waiting_{0};
};

/// Waits on `cv` until `is_done` or the timeout, and runs calls handed to this thread meanwhile.
/// `lock` holds the mutex of `cv`. Returns false on timeout.
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
