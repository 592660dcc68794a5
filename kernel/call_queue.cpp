// SPDX-License-Identifier: Apache-2.0
#include "kernel/call_queue.h"

#include <algorithm>
#include <utility>

namespace robomosp {
namespace {

thread_local std::weak_ptr<CallQueue> queue_here;
thread_local std::size_t serving_here = 0;  ///< calls, one within another
constexpr std::chrono::milliseconds kQueueLook{50};

}  // namespace

struct CallQueue::Call {
  const std::function<void()>* fn;
  enum class State : std::uint8_t { waiting, running, done, refused } state = State::waiting;
};

CallQueue::Outcome CallQueue::call(const std::function<void()>& fn, std::chrono::milliseconds limit,
                                   const std::function<bool()>& gives_up) {
  const auto end = std::chrono::steady_clock::now() + limit;
  Call call{&fn};
  std::unique_lock lock(mutex_);
  if (opened_ == 0) return Outcome::closed;
  calls_.push_back(&call);
  waiting_.fetch_add(1, std::memory_order_release);
  for (Waker* w : wakers_) w->wake_();
  const auto withdraw = [&](Outcome outcome) {
    std::erase(calls_, &call);
    waiting_.fetch_sub(1, std::memory_order_release);
    return outcome;
  };
  const auto moved = [&] { return call.state != Call::State::waiting; };
  while (!moved()) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= end) return withdraw(Outcome::late);
    done_.wait_until(lock, std::min(end, now + kQueueLook), moved);
    if (moved() || !gives_up) continue;
    lock.unlock();
    const bool is_given_up = gives_up();
    lock.lock();
    if (is_given_up && !moved()) return withdraw(Outcome::given_up);
  }
  done_.wait(lock, [&] { return call.state != Call::State::running; });
  return call.state == Call::State::done ? Outcome::done : Outcome::closed;
}

bool CallQueue::is_serving() { return serving_here > 0; }

std::size_t CallQueue::serve() {
  std::size_t count = 0;
  std::unique_lock lock(mutex_);
  while (!calls_.empty()) {
    Call* call = calls_.front();
    calls_.pop_front();
    waiting_.fetch_sub(1, std::memory_order_release);
    call->state = Call::State::running;
    lock.unlock();
    ++serving_here;
    (*call->fn)();
    --serving_here;
    lock.lock();
    call->state = Call::State::done;
    done_.notify_all();
    ++count;
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
  for (Call* call : calls_) call->state = Call::State::refused;
  waiting_.fetch_sub(calls_.size(), std::memory_order_release);
  calls_.clear();
  done_.notify_all();
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
