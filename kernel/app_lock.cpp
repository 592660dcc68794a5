// SPDX-License-Identifier: Apache-2.0
#include "kernel/app_lock.h"

#include <cstdio>
#include <exception>
#include <utility>

#include "kernel/check.h"

namespace robomosp {
namespace {

/// What this thread holds, the innermost; a thread rarely holds more than one.
thread_local AppLock* held = nullptr;

/// As many tasks may be put off before those who do it wait for their turn to call them.
constexpr std::size_t kMostPutOff = 128;
constexpr std::chrono::milliseconds kLongestTurn{20};

}  // namespace

bool AppLock::is_held() const { return held == this; }
bool AppLock::is_any_held() { return held != nullptr; }
void AppLock::expect_free() {
  if (held) ++held->calls_within_;
}

std::chrono::nanoseconds AppLock::now() const {
  return clock_ ? clock_() : std::chrono::steady_clock::now().time_since_epoch();
}

bool AppLock::take(std::string_view who) {
  if (held == this) return true;
  RMP_CHECK(held == nullptr, "two application locks are taken by one thread");
  mutex_.lock();
  held = this;
  holder_ = who;
  since_ = now();
  return false;
}

void AppLock::release() {
  const std::chrono::nanoseconds took = now() - since_;
  ++holds_;
  if (took > longest_) {
    longest_ = took;
    longest_by_ = holder_;
  }
  const bool is_long = took > kLongestHold;
  if (is_long) {
    ++long_holds_;
    if (report_) later([this, who = std::string(holder_), took] { report_(who, took); });
  }
  held = nullptr;
  mutex_.unlock();
  flush();
}

void AppLock::later(std::function<void()> task) {
  const std::lock_guard lock(tasks_mutex_);
  tasks_.push_back(std::move(task));
  has_tasks_.store(true, std::memory_order_release);
}

void AppLock::flush() {
  if (held == this || !has_tasks_.load(std::memory_order_acquire)) return;
  std::unique_lock lock(tasks_mutex_);
  if (flushing_ == std::this_thread::get_id()) return;  // called by a task
  if (is_flushing_) {
    // Whoever is at it calls the new ones too, unless they come faster than it can: it must not be
    // kept for ever, nor must they pile up.
    if (tasks_.size() < kMostPutOff) return;
    ++waiting_;
    const bool is_next = turn_.wait_for(lock, kLongestTurn, [this, before = turns_] {
      return is_handed_on_ && turns_ != before;  // not before those who waited already
    });
    --waiting_;
    if (!is_next) return;  // a task may wait for what this thread does next
    is_handed_on_ = false;
  }
  is_flushing_ = true;
  flushing_ = std::this_thread::get_id();
  for (std::size_t own = tasks_.size(); !tasks_.empty() && (own > 0 || waiting_ == 0);
       own -= own > 0 ? 1 : 0) {
    std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    // One wall for all: a subscriber that throws must not take the others with it.
    try {
      task();
    } catch (const std::exception& e) {
      std::fprintf(stderr, "robomosp: a subscriber threw: %s\n", e.what());
    } catch (...) {
      std::fprintf(stderr, "robomosp: a subscriber threw an unknown exception\n");
    }
    task = {};  // what it captured is let go without the mutex
    lock.lock();
  }
  flushing_ = {};
  if (tasks_.empty()) {
    has_tasks_.store(false, std::memory_order_release);
    is_flushing_ = false;
  } else {  // one who waits goes on
    is_handed_on_ = true;
    ++turns_;
    turn_.notify_all();
  }
}

AppLock::Stats AppLock::stats() const {
  std::unique_lock lock(mutex_, std::defer_lock);
  if (held != this) lock.lock();
  return {holds_, long_holds_, longest_, longest_by_, calls_within_};
}

}  // namespace robomosp
