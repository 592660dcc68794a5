// SPDX-License-Identifier: Apache-2.0
// Runs: the live runs of this session of the program, and how commands become one
// (layer: application).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "document/document.h"
#include "ioci/command.h"
#include "sim/live_run.h"

namespace robomosp::ioci {

struct LiveRunEntry {
  std::string title;               ///< "cell: physics"
  std::string of;                  ///< what is simulated, as it was asked for
  Handle subject;                  ///< the world or robot
  Map with;                        ///< arguments of the simulation, as they were given
  document::SnapshotPtr snapshot;  ///< what it computes with
  std::unique_ptr<sim::LiveRun> run;
};

/// Run state, outside the document and its history. [application thread]
class Runs {
 public:
  std::uint64_t add(LiveRunEntry entry) {
    entries_.emplace(next_, std::move(entry));
    return next_++;
  }
  [[nodiscard]] LiveRunEntry* find(std::uint64_t number) {
    const auto it = entries_.find(number);
    return it == entries_.end() ? nullptr : &it->second;
  }
  bool remove(std::uint64_t number) { return entries_.erase(number) != 0; }
  [[nodiscard]] const std::map<std::uint64_t, LiveRunEntry>& list() const { return entries_; }

 private:
  std::uint64_t next_ = 1;  ///< number of a handle, never reused
  std::map<std::uint64_t, LiveRunEntry> entries_;
};

/// A simulation that computes row by row, and the providers that it asks: (interface id, choice).
struct LiveSource {
  sim::LiveRun::Source source;
  std::vector<std::pair<const char*, model::ProviderChoice>> asks;
};

// From the checked arguments of the commands world.simulate_dynamics, robot.simulate and
// world.simulate_physics. A source owns a snapshot; registry and derived values outlive it.
Result<LiveSource> live_dynamics(CommandContext&, const Map& args);
Result<LiveSource> live_robot(CommandContext&, const Map& args);
Result<LiveSource> live_physics(CommandContext&, const Map& args);

}  // namespace robomosp::ioci
