// SPDX-License-Identifier: Apache-2.0
// Why a target has no answer: limits, distance, orientation or a singular direction (layer:
// plugin).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "search.h"

namespace robomosp::ik_numeric {

/// One question without an answer.
struct Failure {
  const Mechanism& mechanism;
  std::span<const IkGoal> goals;
  std::span<const Pose> targets;  ///< one a goal
  SearchOptions options;
  std::uint64_t seed = 1;
  double certain_gap = 0;    ///< [m]
  bool ended_early = false;  ///< a search ran out of iterations
};

/// `q` is the closest configuration found. Fills status, detail, shortfall, limiting_joint and
/// lost_direction; true when it comes upon an answer after all, which is then in q.
bool explain(const Failure& failure, std::vector<double>& q, IkResult& out,
             const Progress& progress);

/// The twist that a goal's tip has lost at q, zeros when it has lost none.
[[nodiscard]] std::array<double, 6> lost_direction(const Mechanism& m, const IkGoal& goal,
                                                   std::span<const double> q);

/// Chooses the turn of every revolute joint that is nearest to `near` within the limits.
void unwind(const Mechanism& m, std::span<const double> near, std::span<double> q);

}  // namespace robomosp::ik_numeric
