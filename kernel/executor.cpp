// SPDX-License-Identifier: Apache-2.0
#include "kernel/executor.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <system_error>
#include <utility>

#include "kernel/call_queue.h"
#include "kernel/permit.h"
#include "kernel/turns.h"

namespace robomosp {

/// Shared with helpers, of which some may come when all is done.
struct Executor::Spread {
  // Both live as long as a part is left to be taken.
  const std::function<void(std::size_t)>* part = nullptr;
  const Permit* permit = nullptr;
  CallQueue::Context calls;
  std::size_t parts = 0;
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t done = 0;  // guarded by mutex

  std::size_t take_all() {
    std::size_t taken = 0;
    const PermitScope permitted(permit);
    const CallQueue::ContextScope as_caller(calls);
    for (std::size_t i = next.fetch_add(1); i < parts; i = next.fetch_add(1)) {
      (*part)(i);
      ++taken;
    }
    return taken;
  }
  void count(std::size_t taken) {
    if (taken == 0) return;
    const std::lock_guard lock(mutex);
    done += taken;
    if (done == parts) changed.notify_all();
  }
};

Executor::Executor(std::size_t cores)
    : cores_(cores > 0 ? cores : std::max(1U, std::thread::hardware_concurrency())) {}

Executor::~Executor() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  wake_.ring();
  for (std::size_t i = 0;; ++i) {  // a task may have started another one
    std::thread thread;
    {
      const std::lock_guard lock(mutex_);
      if (i == threads_.size()) return;
      thread = std::move(threads_[i]);
    }
    thread.join();
  }
}

Executor& Executor::of_process() {
  // The cores are the process's, and so is this.
  static Executor executor;
  return executor;
}

void Executor::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return is_ending_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    ++busy_;
    lock.unlock();
    turns::compute();
    task.work();
    task.work = {};  // what it captured is let go without the lock
    lock.lock();
    --busy_;
    if (task.is_helper) --helpers_;
  }
}

void Executor::run(std::function<void()> task) { start({std::move(task), false}); }

void Executor::start(Task task) {
  bool has_thread = false;
  {
    const std::lock_guard lock(mutex_);
    // Also those that are about to wait for the next task, or that have just been started.
    has_thread = threads_.size() > busy_ + tasks_.size();
    if (!has_thread) {
      try {
        threads_.emplace_back([this] { work(); });
        has_thread = true;
      } catch (const std::system_error&) {
        has_thread = false;
      }
    }
    if (has_thread) tasks_.push_back(std::move(task));
    else if (task.is_helper) --helpers_;
  }
  if (has_thread) wake_.ring_one();
  else task.work();
}

void Executor::spread(std::size_t parts, std::size_t threads,
                      const std::function<void(std::size_t)>& part) {
  std::size_t helpers = 0;
  if (parts > 1 && threads > 1) {
    const std::lock_guard lock(mutex_);
    const std::size_t left = cores_ - 1 > helpers_ ? cores_ - 1 - helpers_ : 0;
    helpers = std::min({threads - 1, parts - 1, left});
    helpers_ += helpers;
  }
  if (helpers == 0) {
    for (std::size_t i = 0; i < parts; ++i) part(i);
    return;
  }
  const auto shared = std::make_shared<Spread>();
  shared->part = &part;
  shared->permit = current_permit();
  shared->calls = CallQueue::Context::here();
  shared->parts = parts;
  for (std::size_t h = 0; h < helpers; ++h)
    start({[shared] { shared->count(shared->take_all()); }, true});
  shared->count(shared->take_all());
  std::unique_lock lock(shared->mutex);
  wait_serving(lock, shared->changed, [&] { return shared->done == parts; });
}

}  // namespace robomosp
