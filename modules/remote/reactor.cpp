// SPDX-License-Identifier: Apache-2.0
#include "remote/reactor.h"

#include <algorithm>

#include "kernel/turns.h"

namespace robomosp::remote {
namespace {

using namespace std::chrono_literals;

/// How often the watch looks while commands run, and for how many looks it goes on after.
constexpr auto kReactorLook = 2ms;
constexpr int kQuietLooks = 50;

}  // namespace

thread_local Reactor::Worker* Reactor::current_ = nullptr;

Reactor::Reactor(std::size_t most)
    : guard_(io_.get_executor()),
      most_(std::max<std::size_t>(most, 2)),
      wanted_(std::min<std::size_t>(std::max(2U, std::thread::hardware_concurrency()), most_)) {
  turns::serve();
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < wanted_; ++i) start_one();
  watch_ = std::thread([this] { watch(); });
}

Reactor::~Reactor() { stop(); }

void Reactor::stop() {
  {
    const std::lock_guard lock(mutex_);
    if (is_ending_) return;
    is_ending_ = true;
  }
  wake_.notify_all();
  watch_.join();
  guard_.reset();
  io_.stop();
  for (const auto& worker : workers_)
    if (worker->thread.joinable()) worker->thread.join();
  workers_.clear();
}

std::size_t Reactor::threads() const {
  const std::lock_guard lock(mutex_);
  return workers_.size();
}

void Reactor::start_one() {
  auto worker = std::make_unique<Worker>();
  Worker& self = *worker;
  try {
    self.thread = std::thread([this, &self] { work(self); });
  } catch (const std::system_error&) {
    return;  // the system gives no more; those that are there go on
  }
  workers_.push_back(std::move(worker));
}

void Reactor::work(Worker& self) {
  current_ = &self;
  turns::answer();
  while (!io_.stopped()) {
    if (io_.run_one() == 0) break;
    std::size_t over = too_many_.load(std::memory_order_relaxed);
    while (over > 0 && !too_many_.compare_exchange_weak(over, over - 1)) {
    }
    if (over > 0) break;
  }
  self.is_done.store(true);
}

void Reactor::watch() {
  int quiet = 0;
  std::unique_lock lock(mutex_);
  while (!is_ending_) {
    if (quiet > kQuietLooks) {
      is_quiet_.store(true);
      wake_.wait(lock, [this] { return is_ending_ || !is_quiet_.load(); });
      quiet = 0;
      continue;
    }
    wake_.wait_for(lock, kReactorLook, [this] { return is_ending_; });
    std::size_t busy = 0;
    bool has_run = false;
    for (auto it = workers_.begin(); it != workers_.end();) {
      Worker& w = **it;
      if (w.is_done.load()) {
        w.thread.join();
        it = workers_.erase(it);
        continue;
      }
      const std::uint64_t count = w.count.load(std::memory_order_relaxed);
      has_run = has_run || count != w.seen || count % 2 == 1;
      if (count % 2 == 1 && count == w.seen) ++busy;
      w.seen = count;
      ++it;
    }
    quiet = has_run ? 0 : quiet + 1;
    const std::size_t free = workers_.size() - busy;
    if (free < wanted_ && workers_.size() < most_) start_one();
    else if (free > wanted_ + 2 && busy == 0 && too_many_.load() == 0)
      too_many_.store(free - wanted_);  // they end when they wake next
  }
}

Reactor::Running::Running(Reactor& reactor) : reactor_(reactor) {
  if (current_) current_->count.fetch_add(1, std::memory_order_relaxed);
  if (reactor_.is_quiet_.load(std::memory_order_relaxed) && reactor_.is_quiet_.exchange(false)) {
    { const std::lock_guard lock(reactor_.mutex_); }
    reactor_.wake_.notify_all();
  }
}

Reactor::Running::~Running() {
  if (current_) current_->count.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace robomosp::remote
