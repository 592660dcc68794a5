// SPDX-License-Identifier: Apache-2.0
// Shortens and rounds paths of straight joint motions around obstacles (layer: application, sim).
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

namespace robomosp::sim {

/// The length of a path (joint vectors, row-major) in the metric of the problem's weights, sqrt(sum
/// (weight dq)^2).
[[nodiscard]] double path_length(const PlanProblem& problem, std::span<const double> path);

/// Returns a path between the same ends that is no longer: removable points are left out, and
/// `tries` times two random points are connected straight if that is free (Geraerts, Overmars, Int.
/// J. Robotics Research 26(8), 2007, 845). Equal seeds give equal paths. `is_late` is polled before
/// each try, and ends it; `tried` counts the tries; both may be omitted.
Result<std::vector<double>> shorten(const PlanProblem& problem, std::vector<double> path,
                                    std::size_t tries, Progress& progress,
                                    const std::function<bool()>& is_late = nullptr,
                                    std::size_t* tried = nullptr);

/// The path in small steps, with its corners rounded where that is free: each by a quintic Bezier
/// curve over at most `share` (0..1/2, one per corner) of the adjacent motions, with continuous
/// direction and curvature at its ends. The share is halved until the curve is free; a corner
/// without sufficient clearance stays. `is_free_along` checks a sequence of configurations,
/// connected straight, with the full clearance or with the reduced one, used for corners in narrow
/// places.
struct RoundWay {
  std::vector<double> points;
  std::size_t sharp = 0;  ///< corners left sharp, among those with a share above 0
};
using IsFreeAlong = std::function<bool(std::span<const double> rows, bool is_reduced)>;
RoundWay round_corners(const PlanProblem& problem, std::span<const double> path,
                       std::span<const double> shares, const IsFreeAlong& is_free_along);

}  // namespace robomosp::sim
