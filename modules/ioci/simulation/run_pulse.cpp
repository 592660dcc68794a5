// SPDX-License-Identifier: Apache-2.0
#include "ioci/simulation/run_pulse.h"

#include <chrono>
#include <utility>

#include "ioci/core/room_parts.h"
#include "ioci/simulation/live_runs.h"

namespace robomosp::ioci {
namespace {

const RoomFile kRunPulsePart({.subscribed = [](Application& app) { app.kept<RunPulse>().wake(); }});

}  // namespace

RunPulse::~RunPulse() {
  {
    const std::lock_guard lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void RunPulse::wake() {
  if (app_.events.run_rate() == 0) return;
  {
    const std::lock_guard lock(mutex_);
    if (is_ending_) return;
    is_woken_ = true;
    if (!thread_.joinable()) thread_ = std::thread([this] { beat(); });
  }
  changed_.notify_all();
}

void RunPulse::beat() {
  using Clock = std::chrono::steady_clock;
  auto next = Clock::now();
  std::unique_lock lock(mutex_);
  while (!is_ending_) {
    const double rate = app_.events.run_rate();
    is_woken_ = false;
    lock.unlock();
    const bool is_playing = rate > 0 && publish_played();
    lock.lock();
    if (!is_playing) {
      changed_.wait(lock, [this] { return is_woken_ || is_ending_; });
      next = Clock::now();
      continue;
    }
    // By the clock, so that the rate is kept; what was missed is left out.
    const auto every =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate));
    next = std::max(next + every, Clock::now());
    changed_.wait_until(lock, next, [this] { return is_ending_; });
  }
}

Map RunPulse::publish(std::uint64_t run, const LiveRunEntry& entry, bool is_pulse) {
  if (app_.events.run_rate() == 0) return live_run_state(app_, entry);
  const std::lock_guard lock(publishing_);
  Map state = live_run_state(app_, entry);
  app_.events.publish(RunState{.run = run, .state = state, .is_pulse = is_pulse});
  return state;
}

bool RunPulse::publish_played() {
  std::set<std::uint64_t> playing;
  for (const auto& [number, entry] : app_.runs->list()) {
    const bool plays = entry->run->is_playing();
    if (plays) playing.insert(number);
    if (plays || played_.contains(number)) (void)publish(number, *entry, true);
  }
  played_ = std::move(playing);
  return !played_.empty();
}

}  // namespace robomosp::ioci
