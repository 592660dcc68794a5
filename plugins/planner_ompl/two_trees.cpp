// SPDX-License-Identifier: Apache-2.0
#include "two_trees.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace robomosp::planner_ompl {

TwoTrees::TwoTrees(const PlanProblem& problem, std::span<const std::size_t> goals, double range)
    : problem_(problem),
      goals_(goals.begin(), goals.end()),
      range_(range),
      random_(problem.seed),
      wanted_(problem.dof),
      next_(problem.dof) {
  add(from_start_, problem.start, -1);
  for (const std::size_t g : goals_)
    add(from_goals_, problem.goals.subspan(g * problem.dof, problem.dof), -1);
}

void TwoTrees::add(Tree& tree, std::span<const double> q, std::int32_t parent) const {
  tree.q.insert(tree.q.end(), q.begin(), q.end());
  for (std::size_t j = 0; j < q.size(); ++j) tree.stretched.push_back(q[j] * problem_.weight[j]);
  tree.parent.push_back(parent);
}

std::int32_t TwoTrees::nearest(const Tree& tree, std::span<const double> q) {
  const std::size_t dof = problem_.dof;
  for (std::size_t j = 0; j < dof; ++j) wanted_[j] = q[j] * problem_.weight[j];
  double least = std::numeric_limits<double>::infinity();
  std::int32_t found = 0;
  const double* row = tree.stretched.data();
  for (std::size_t i = 0; i < tree.parent.size(); ++i, row += dof) {
    double sum = 0;
    for (std::size_t j = 0; j < dof && sum < least; ++j)
      sum += (row[j] - wanted_[j]) * (row[j] - wanted_[j]);
    if (sum < least) least = sum, found = static_cast<std::int32_t>(i);
  }
  return found;
}

TwoTrees::Step TwoTrees::step(Tree& tree, std::int32_t from, std::span<const double> to,
                              const Asked& asked) {
  const std::span<const double> here = at(tree, from);
  double squared = 0;
  for (std::size_t j = 0; j < problem_.dof; ++j)
    squared += std::pow(problem_.weight[j] * (to[j] - here[j]), 2);
  const double distance = std::sqrt(squared);
  Step out;
  out.has_arrived = distance <= range_;
  for (std::size_t j = 0; j < problem_.dof; ++j)
    next_[j] = out.has_arrived ? to[j] : here[j] + range_ / distance * (to[j] - here[j]);
  if (!asked.is_free_between(here, next_)) return {};
  out.node = static_cast<std::int32_t>(tree.parent.size());
  add(tree, next_, from);
  return out;
}

Plan TwoTrees::joined(std::int32_t of_start, std::int32_t of_goals) const {
  std::vector<std::int32_t> nodes;
  for (std::int32_t i = of_start; i >= 0; i = from_start_.parent[static_cast<std::size_t>(i)])
    nodes.push_back(i);
  Plan plan;
  for (auto i = nodes.rbegin(); i != nodes.rend(); ++i)
    plan.points.insert(plan.points.end(), at(from_start_, *i).begin(), at(from_start_, *i).end());
  // The node of the other tree is the same configuration.
  std::int32_t root = of_goals;
  for (std::int32_t i = from_goals_.parent[static_cast<std::size_t>(of_goals)]; i >= 0;
       i = from_goals_.parent[static_cast<std::size_t>(i)]) {
    plan.points.insert(plan.points.end(), at(from_goals_, i).begin(), at(from_goals_, i).end());
    root = i;
  }
  plan.goal = goals_[static_cast<std::size_t>(root)];
  return plan;
}

std::optional<Plan> TwoTrees::search(const Asked& asked) {
  std::vector<double> drawn(problem_.dof), reached(problem_.dof);
  for (bool is_first = true; !asked.is_over(); is_first = false) {
    const bool from_start = from_start_.parent.size() <= from_goals_.parent.size();
    Tree &own = from_start ? from_start_ : from_goals_,
         &other = from_start ? from_goals_ : from_start_;
    // The first wish is the nearest goal itself: where nothing is in the way, the way is straight.
    if (is_first) {
      const auto goal = at(from_goals_, nearest(from_goals_, problem_.start));
      drawn.assign(goal.begin(), goal.end());
    } else {
      for (std::size_t j = 0; j < drawn.size(); ++j) {
        const double share = static_cast<double>(random_() >> 11) * 0x1p-53;
        drawn[j] = std::clamp(problem_.lower[j] + share * (problem_.upper[j] - problem_.lower[j]),
                              problem_.lower[j], problem_.upper[j]);
      }
    }
    const Step grown = step(own, nearest(own, drawn), drawn, asked);
    if (grown.node < 0) continue;
    const auto there = at(own, grown.node);
    reached.assign(there.begin(), there.end());
    Step towards{nearest(other, reached), false};
    while (towards.node >= 0 && !towards.has_arrived && !asked.is_over())
      towards = step(other, towards.node, reached, asked);
    if (towards.node < 0 || !towards.has_arrived) continue;
    return from_start ? joined(grown.node, towards.node) : joined(towards.node, grown.node);
  }
  return std::nullopt;
}

}  // namespace robomosp::planner_ompl
