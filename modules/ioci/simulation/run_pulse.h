// SPDX-License-Identifier: Apache-2.0
// Run pulse: while live runs play, their states become events, as often as subscribers want them
// (layer: application).
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <set>
#include <thread>

#include "kernel/value.h"

namespace robomosp::ioci {

class Application;
struct LiveRunEntry;

/// One thread a program, from the first time that somebody listens while a run plays; else it
/// sleeps. A run that comes to rest is published once more. Kept with the application.
class RunPulse {
 public:
  explicit RunPulse(Application& app) : app_(app) {}
  ~RunPulse();
  RunPulse(const RunPulse&) = delete;
  RunPulse& operator=(const RunPulse&) = delete;
  /// A run was played, or somebody subscribed. [any thread]
  void wake();
  /// Publishes the state of a run if somebody listens, and returns it: no older state of a run is
  /// published after a newer one. [any thread]
  Map publish(std::uint64_t run, const LiveRunEntry&, bool is_pulse = false);

 private:
  void beat();
  /// Publishes what plays, and what played before; whether anything does. [its thread]
  bool publish_played();

  Application& app_;
  std::set<std::uint64_t> played_;  ///< runs, at the last beat. Its thread's
  std::mutex publishing_;           ///< while a state is computed and published
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_woken_ = false, is_ending_ = false;  // guarded by mutex_
  std::thread thread_;                         // guarded by mutex_
};

}  // namespace robomosp::ioci
