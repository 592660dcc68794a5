// SPDX-License-Identifier: Apache-2.0
#include "kernel/executor.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <system_error>
#include <utility>

#include "kernel/call_queue.h"
#include "kernel/permit.h"

namespace robomosp {

/// Shared with helpers, of which some may come when all is done.
struct Executor::Spread {
  // Both live as long as a part is left to be taken.
  const std::function<void(std::size_t)>* part = nullptr;
  const Permit* permit = nullptr;
  std::size_t parts = 0;
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t done = 0;  // guarded by mutex

  std::size_t take_all() {
    std::size_t taken = 0;
    const PermitScope permitted(permit);
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
  std::vector<std::thread> threads;
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
    threads.swap(threads_);
  }
  wake_.notify_all();
  for (std::thread& t : threads) t.join();
}

Executor& Executor::of_process() {
  // The cores are the process's, and so is this.
  static Executor executor;
  return executor;
}

void Executor::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    ++idle_;
    wake_.wait(lock, [this] { return is_ending_ || !tasks_.empty(); });
    --idle_;
    if (tasks_.empty()) return;
    std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    task = {};  // what it captured is let go without the lock
    lock.lock();
  }
}

void Executor::run(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    bool has_thread = idle_ > tasks_.size();
    if (!has_thread) {
      try {
        threads_.emplace_back([this] { work(); });
        has_thread = true;
      } catch (const std::system_error&) {
        has_thread = false;
      }
    }
    if (has_thread) tasks_.push_back(std::exchange(task, {}));
  }
  if (task) task();
  else wake_.notify_one();
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
  shared->parts = parts;
  for (std::size_t h = 0; h < helpers; ++h)
    run([this, shared] {
      const std::size_t taken = shared->take_all();
      {
        const std::lock_guard lock(mutex_);
        --helpers_;
      }
      shared->count(taken);
    });
  shared->count(shared->take_all());
  std::unique_lock lock(shared->mutex);
  wait_serving(lock, shared->changed, [&] { return shared->done == parts; });
}

}  // namespace robomosp
