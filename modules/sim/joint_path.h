// SPDX-License-Identifier: Apache-2.0
// Ways of straight joint motions around obstacles, made shorter and round (layer: application,
// sim).
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp::sim {

/// The length of a way (joint vectors, row-major) in the metric of the problem's weights,
/// sqrt(sum (weight dq)^2).
[[nodiscard]] double path_length(const PlanProblem& problem, std::span<const double> path);

/// A way between the same ends that is no longer: points that can be passed by are left out, and
/// `tries` times two places drawn at random are joined straight where that is free (Geraerts,
/// Overmars, Int. J. Robotics Research 26(8), 2007, 845). Equal seeds give equal ways. `is_late` is
/// asked before each try, and ends it; `tried` counts the tries; both may be left out.
Result<std::vector<double>> shorten(const PlanProblem& problem, std::vector<double> path,
                                    std::size_t tries, Progress& progress,
                                    const std::function<bool()>& is_late = nullptr,
                                    std::size_t* tried = nullptr);

/// The way in small steps, its corners rounded where that is free: each by a Bezier curve of fifth
/// degree over at most `share` (0..1/2, one a corner) of the motions beside it, which leaves and
/// joins them with continuous direction and curvature. It is halved until it is free; a corner
/// without room stays. `is_free_along` answers for a row of configurations, joined straight, with
/// the full clearance or with the reduced one, by which a corner is rounded that has no more room.
struct RoundWay {
  std::vector<double> points;
  std::size_t sharp = 0;  ///< corners that stayed, among those with a share above 0
};
using IsFreeAlong = std::function<bool(std::span<const double> rows, bool is_reduced)>;
RoundWay round_corners(const PlanProblem& problem, std::span<const double> path,
                       std::span<const double> shares, const IsFreeAlong& is_free_along);

}  // namespace robomosp::sim
