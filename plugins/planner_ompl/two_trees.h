// SPDX-License-Identifier: Apache-2.0
// Two trees of free motions that grow towards each other, from the start and from the goals
// (layer: plugin).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include <robomosp/sdk/planner.h>

#include "asked.h"

namespace robomosp::planner_ompl {

/// RRT-Connect (J. Kuffner, S. LaValle, RRT-Connect: an efficient approach to single-query path
/// planning, ICRA 2000); the smaller of the two trees grows. Equal seeds give equal paths. One
/// thread.
class TwoTrees {
 public:
  /// `goals`: the free ones, by number. `range`: the longest step, in the problem's distances.
  TwoTrees(const PlanProblem& problem, std::span<const std::size_t> goals, double range);

  /// The path with the number of its goal, or nothing if the search ended without one.
  [[nodiscard]] std::optional<Plan> search(const Asked& asked);

 private:
  struct Tree {
    std::vector<double> q;          ///< rows: as given
    std::vector<double> stretched;  ///< rows: times the weights
    std::vector<std::int32_t> parent;
  };
  /// A step towards a configuration: a new node of the tree, and whether it is the target.
  struct Step {
    std::int32_t node = -1;  ///< -1 = blocked
    bool has_arrived = false;
  };

  void add(Tree& tree, std::span<const double> q, std::int32_t parent) const;
  [[nodiscard]] std::span<const double> at(const Tree& tree, std::int32_t node) const {
    return {tree.q.data() + static_cast<std::size_t>(node) * problem_.dof, problem_.dof};
  }
  [[nodiscard]] std::int32_t nearest(const Tree& tree, std::span<const double> q);
  [[nodiscard]] Step step(Tree& tree, std::int32_t from, std::span<const double> to,
                          const Asked& asked);
  [[nodiscard]] Plan joined(std::int32_t of_start, std::int32_t of_goals) const;

  const PlanProblem& problem_;
  std::vector<std::size_t> goals_;
  double range_;
  std::mt19937_64 random_;
  Tree from_start_, from_goals_;
  std::vector<double> wanted_, next_;
};

}  // namespace robomosp::planner_ompl
