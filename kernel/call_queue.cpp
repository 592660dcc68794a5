// SPDX-License-Identifier: Apache-2.0
#include "kernel/call_queue.h"

#include <algorithm>
#include <utility>

namespace robomosp {
namespace {

thread_local std::weak_ptr<CallQueue> queue_here;
thread_local CallQueue::Context context_here;
constexpr std::chrono::milliseconds kQueueLook{50}, kPatientLook{10};

}  // namespace

struct CallQueue::Call {
  explicit Call(const std::function<void()>* f) : fn(f) {}
  const std::function<void()>* fn;
  std::mutex mutex;
  std::condition_variable changed;
  enum class State : std::uint8_t { waiting, running, done, refused } state = State::waiting;
  /// The caller may destroy this as soon as it sees the new state.
  void become(State next) {
    const std::lock_guard lock(mutex);
    state = next;
    changed.notify_all();
  }
};

CallQueue::Outcome CallQueue::call(const std::function<void()>& fn, std::chrono::milliseconds limit,
                                   const std::function<bool()>& gives_up) {
  const std::function<bool()>* const patient = context_here.gives_up;
  const auto end = std::chrono::steady_clock::now() + limit;
  Call call(&fn);
  {
    const std::lock_guard lock(mutex_);
    if (opened_ == 0) return Outcome::closed;
    calls_.push_back(&call);
    waiting_.fetch_add(1, std::memory_order_release);
    for (Waker* w : wakers_) w->wake_();
  }
  /// False if the owner has taken it already.
  const auto withdraw = [&] {
    const std::lock_guard lock(mutex_);
    if (std::erase(calls_, &call) == 0) return false;
    waiting_.fetch_sub(1, std::memory_order_release);
    return true;
  };
  std::unique_lock lock(call.mutex);
  const auto has_moved = [&] { return call.state != Call::State::waiting; };
  for (;;) {
    const auto left = patient ? std::chrono::steady_clock::duration(kPatientLook)
                              : std::min<std::chrono::steady_clock::duration>(
                                    end - std::chrono::steady_clock::now(), kQueueLook);
    if (wait_serving(lock, call.changed, left, has_moved)) break;
    lock.unlock();
    const bool is_given_up = (gives_up && gives_up()) || (patient && (*patient)());
    const bool is_late = !patient && std::chrono::steady_clock::now() >= end;
    if ((is_given_up || is_late) && withdraw())
      return is_given_up ? Outcome::given_up : Outcome::late;
    lock.lock();
  }
  wait_serving(lock, call.changed, [&] {
    return call.state == Call::State::done || call.state == Call::State::refused;
  });
  return call.state == Call::State::done ? Outcome::done : Outcome::closed;
}

bool CallQueue::is_serving() { return context_here.is_serving; }

CallQueue::Context CallQueue::Context::here() { return context_here; }

CallQueue::ContextScope::ContextScope(const Context& context) : before_(context_here) {
  context_here = context;
}
CallQueue::ContextScope::~ContextScope() { context_here = before_; }

CallQueue::PatientScope::PatientScope(const std::function<bool()>& gives_up)
    : before_(std::exchange(context_here.gives_up, &gives_up)) {}
CallQueue::PatientScope::~PatientScope() { context_here.gives_up = before_; }

std::size_t CallQueue::serve() {
  std::size_t count = 0;
  std::unique_lock lock(mutex_);
  while (!calls_.empty()) {
    Call* call = calls_.front();
    calls_.pop_front();
    waiting_.fetch_sub(1, std::memory_order_release);
    lock.unlock();
    call->become(Call::State::running);
    {
      const ContextScope serving({.is_serving = true, .gives_up = nullptr});
      (*call->fn)();
    }
    call->become(Call::State::done);
    ++count;
    lock.lock();
  }
  return count;
}

void CallQueue::open() {
  const std::lock_guard lock(mutex_);
  ++opened_;
}

void CallQueue::close() {
  const std::lock_guard lock(mutex_);
  if (--opened_ > 0) return;
  waiting_.fetch_sub(calls_.size(), std::memory_order_release);
  for (Call* call : std::exchange(calls_, {})) call->become(Call::State::refused);
}

CallQueue::Waker::Waker(CallQueue& queue, std::function<void()> wake)
    : queue_(queue), wake_(std::move(wake)) {
  const std::lock_guard lock(queue_.mutex_);
  queue_.wakers_.push_back(this);
}
CallQueue::Waker::~Waker() {
  const std::lock_guard lock(queue_.mutex_);
  std::erase(queue_.wakers_, this);
}

std::shared_ptr<CallQueue> CallQueue::for_this_thread() {
  std::shared_ptr<CallQueue> queue = queue_here.lock();
  if (!queue) queue_here = queue = std::make_shared<CallQueue>();
  return queue;
}

std::shared_ptr<CallQueue> CallQueue::of_this_thread() { return queue_here.lock(); }

}  // namespace robomosp
