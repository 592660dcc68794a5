// SPDX-License-Identifier: Apache-2.0
// A roadmap of free configurations with motions that are checked only when a path would use them
// (layer: plugin).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include <robomosp/sdk/planner.h>

#include "asked.h"

namespace robomosp::planner_ompl {

/// Lazy PRM (R. Bohlin, L. Kavraki, Path planning using lazy PRM, ICRA 2000): configurations are
/// checked when they are drawn, motions in the order of the shortest path that may be free; half of
/// the configurations are drawn near blocked motions. Equal seeds give equal paths. One thread.
class LazyRoadmap {
 public:
  /// `goals`: the free ones, by number. `range`: longest motion, in the problem's distances.
  LazyRoadmap(const PlanProblem& problem, std::span<const std::size_t> goals,
              std::size_t neighbours, double range);

  /// The path with the number of its goal, or nothing if the search ended without one.
  [[nodiscard]] std::optional<Plan> search(const Asked& asked);

 private:
  enum class Known : std::uint8_t { nothing, free, blocked };
  struct Edge {
    std::uint32_t a, b;
    double length;
    Known known = Known::nothing;
  };

  [[nodiscard]] std::span<const double> at(std::size_t node) const {
    return {q_.data() + node * problem_.dof, problem_.dof};
  }
  [[nodiscard]] double distance(std::size_t a, std::size_t b) const;
  [[nodiscard]] double share();  ///< 0 <= .. < 1
  /// Draws a configuration from the whole space, or near a blocked motion.
  void draw(std::vector<double>& q);
  void add(std::span<const double> q);
  void join(std::uint32_t node);
  /// Nodes from the start to a goal along edges not known to be blocked; empty = none.
  [[nodiscard]] std::vector<std::uint32_t> shortest();

  const PlanProblem& problem_;
  std::vector<std::size_t> goals_;
  std::size_t neighbours_;
  double range_;
  std::mt19937_64 random_;
  std::vector<double> q_, stretched_;  ///< rows: as given, and times the weights
  std::vector<double> to_goal_;        ///< the distance to the nearest goal
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> blocked_;  ///< edges
  std::vector<std::vector<std::uint32_t>> edges_of_;
  // Memory of shortest().
  std::vector<double> cost_;
  std::vector<std::uint32_t> through_;
  std::vector<std::pair<double, std::uint32_t>> near_;
};

}  // namespace robomosp::planner_ompl
