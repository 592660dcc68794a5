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
  if (is_flushing_) return;  // whoever is at it calls the new ones too
  is_flushing_ = true;
  while (!tasks_.empty()) {
    const std::function<void()> task = std::move(tasks_.front());
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
    lock.lock();
  }
  has_tasks_.store(false, std::memory_order_release);
  is_flushing_ = false;
}

AppLock::Stats AppLock::stats() const {
  std::unique_lock lock(mutex_, std::defer_lock);
  if (held != this) lock.lock();
  return {holds_, long_holds_, longest_, longest_by_, calls_within_};
}

}  // namespace robomosp
