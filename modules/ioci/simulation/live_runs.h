// SPDX-License-Identifier: Apache-2.0
// Creation of live runs by commands, and their state as values (layer: application).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "document/document.h"
#include "ioci/core/command.h"
#include "ioci/core/runs.h"
#include "sim/live_run.h"
#include "sim/pulls.h"
#include "task/run.h"

namespace robomosp::ioci {

/// What run.state gives. [any thread]
[[nodiscard]] Map live_run_state(const Application&, const LiveRunEntry&);

/// A simulation that computes row by row, and the providers that it asks: (interface id, choice).
struct LiveSource {
  sim::LiveRun::Source source;
  std::vector<std::pair<const char*, model::ProviderChoice>> asks;
  std::shared_ptr<task::ProgramWatch> watch = {};  ///< of programs
  /// Where the source gets the pulls of its run from, set before it starts; null = no forces act.
  std::shared_ptr<sim::Pulls> pulls = {};
};

/// Names of the robots that run.pull can pull. `head`: the run's columns.
[[nodiscard]] std::vector<std::string> pullable_robots(const LiveRunEntry&,
                                                       const recording::Recording& head);

/// 1 = real time, "max" = as fast as it computes, negative = backwards.
Result<double> speed_of(const Value&);

/// Most values returned by run.rows at once: rows times columns.
inline constexpr std::size_t kMostRunValues = 1'000'000;
/// The result of run.rows. `from` counts from 0; `restarts`: see sim::LiveRun::piece. Returns at
/// least one row, and no more than fit in `values` values. [any thread]
[[nodiscard]] Result<Map> live_run_rows(const LiveRunEntry&, std::size_t from,
                                        std::optional<std::size_t> restarts, std::size_t most,
                                        std::size_t values, std::span<const std::string> columns);

// From the checked arguments of the commands world.simulate_dynamics, robot.simulate and
// world.simulate_physics. A source owns a snapshot; registry and derived values must outlive it.
Result<LiveSource> live_dynamics(CommandContext&, const Map& args);
Result<LiveSource> live_robot(CommandContext&, const Map& args);
Result<LiveSource> live_physics(CommandContext&, const Map& args);
/// The source for world.run_task if programs are among its tasks; else empty.
Result<LiveSource> live_tasks(CommandContext&, const Map& args);

}  // namespace robomosp::ioci
