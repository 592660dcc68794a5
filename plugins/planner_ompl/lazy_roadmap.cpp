// SPDX-License-Identifier: Apache-2.0
#include "lazy_roadmap.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>

namespace robomosp::planner_ompl {
namespace {

/// Free configurations with which a roadmap begins; it grows by half of what it has.
constexpr std::size_t kFirstNodes = 100;
constexpr std::uint32_t kNoEdge = std::numeric_limits<std::uint32_t>::max();

}  // namespace

LazyRoadmap::LazyRoadmap(const PlanProblem& problem, std::span<const std::size_t> goals,
                         std::size_t neighbours, double range)
    : problem_(problem),
      goals_(goals.begin(), goals.end()),
      neighbours_(neighbours),
      range_(range),
      random_(problem.seed) {
  // The start is node 0, the goals come next.
  add(problem.start);
  for (const std::size_t g : goals_) add(problem.goals.subspan(g * problem.dof, problem.dof));
}

double LazyRoadmap::distance(std::size_t a, std::size_t b) const {
  const double *x = &stretched_[a * problem_.dof], *y = &stretched_[b * problem_.dof];
  double sum = 0;
  for (std::size_t j = 0; j < problem_.dof; ++j) sum += (x[j] - y[j]) * (x[j] - y[j]);
  return std::sqrt(sum);
}

double LazyRoadmap::share() { return static_cast<double>(random_() >> 11) * 0x1p-53; }

void LazyRoadmap::draw(std::vector<double>& q) {
  q.resize(problem_.dof);
  const auto put = [&](std::size_t j, double x) {
    q[j] = std::clamp(x, problem_.lower[j], problem_.upper[j]);
  };
  // Every other one beside a motion that turned out to be blocked: there is what has to be passed.
  if (!blocked_.empty() && random_() % 2 == 0) {
    const Edge& edge = edges_[blocked_[random_() % blocked_.size()]];
    const std::span<const double> end = at(random_() % 2 == 0 ? edge.a : edge.b);
    const double reach = share() * edge.length;
    for (std::size_t j = 0; j < q.size(); ++j)
      put(j, end[j] + (2 * share() - 1) * reach / problem_.weight[j]);
    return;
  }
  for (std::size_t j = 0; j < q.size(); ++j)
    put(j, problem_.lower[j] + share() * (problem_.upper[j] - problem_.lower[j]));
}

void LazyRoadmap::add(std::span<const double> q) {
  const auto node = static_cast<std::uint32_t>(edges_of_.size());
  q_.insert(q_.end(), q.begin(), q.end());
  for (std::size_t j = 0; j < q.size(); ++j) stretched_.push_back(q[j] * problem_.weight[j]);
  edges_of_.emplace_back();
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t g = 1; g <= goals_.size() && g < edges_of_.size(); ++g)
    nearest = std::min(nearest, distance(node, g));
  to_goal_.push_back(node == 0 ? 0 : nearest);
  join(node);
}

/// With the nearest ones within the range; goals with the start, however far.
void LazyRoadmap::join(std::uint32_t node) {
  near_.clear();  // a heap, the farthest first
  const std::size_t dof = problem_.dof;
  const double* own = &stretched_[node * dof];
  double most = range_ * range_;
  for (std::uint32_t other = 0; other < node; ++other) {
    const bool is_direct = other == 0 && node <= goals_.size();
    const double* row = &stretched_[other * dof];
    double sum = 0;
    for (std::size_t j = 0; j < dof && (sum <= most || is_direct); ++j)
      sum += (row[j] - own[j]) * (row[j] - own[j]);
    if (sum > most && !is_direct) continue;
    near_.emplace_back(sum, other);
    std::push_heap(near_.begin(), near_.end());
    if (near_.size() > neighbours_) {
      std::pop_heap(near_.begin(), near_.end());
      near_.pop_back();
    }
    if (near_.size() == neighbours_) most = std::min(most, near_.front().first);
  }
  std::sort_heap(near_.begin(), near_.end());
  for (const auto& [squared, other] : near_) {
    const auto edge = static_cast<std::uint32_t>(edges_.size());
    edges_.push_back({other, node, std::sqrt(squared)});
    edges_of_[node].push_back(edge);
    edges_of_[other].push_back(edge);
  }
}

std::vector<std::uint32_t> LazyRoadmap::shortest() {
  const std::size_t n = edges_of_.size();
  cost_.assign(n, std::numeric_limits<double>::infinity());
  through_.assign(n, kNoEdge);
  using Entry = std::pair<double, std::uint32_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  cost_[0] = 0;
  open.emplace(to_goal_[0], 0U);
  while (!open.empty()) {
    const auto [estimate, node] = open.top();
    open.pop();
    if (estimate > cost_[node] + to_goal_[node] + 1e-12 * estimate)
      continue;  // found shorter since
    if (node > 0 && node <= goals_.size()) {
      std::vector<std::uint32_t> way;
      for (std::uint32_t at = node; at != 0;) {
        way.push_back(through_[at]);
        at = edges_[through_[at]].a == at ? edges_[through_[at]].b : edges_[through_[at]].a;
      }
      std::reverse(way.begin(), way.end());
      return way;
    }
    for (const std::uint32_t e : edges_of_[node]) {
      const Edge& edge = edges_[e];
      if (edge.known == Known::blocked) continue;
      const std::uint32_t other = edge.a == node ? edge.b : edge.a;
      const double cost = cost_[node] + edge.length;
      if (!(cost < cost_[other])) continue;
      cost_[other] = cost;
      through_[other] = e;
      open.emplace(cost + to_goal_[other], other);
    }
  }
  return {};
}

std::optional<Plan> LazyRoadmap::search(const Asked& asked) {
  std::vector<double> q;
  std::size_t wanted = 0;  // the straight motions to the goals are tried before any is drawn
  for (;; wanted = wanted == 0 ? kFirstNodes : wanted + wanted / 2) {
    const std::size_t given = 1 + goals_.size();
    while (edges_of_.size() < given + wanted) {
      if (asked.is_over()) return std::nullopt;
      draw(q);
      if (asked.is_free(q)) add(q);
    }
    for (auto way = shortest(); !way.empty(); way = shortest()) {
      bool is_free = true;
      for (const std::uint32_t e : way) {
        Edge& edge = edges_[e];
        if (edge.known == Known::free) continue;
        if (asked.is_over()) return std::nullopt;
        edge.known = asked.is_free_between(at(edge.a), at(edge.b)) ? Known::free : Known::blocked;
        if (edge.known == Known::blocked) blocked_.push_back(e), is_free = false;
      }
      if (!is_free) continue;
      Plan plan;
      plan.points.assign(problem_.start.begin(), problem_.start.end());
      std::uint32_t node = 0;
      for (const std::uint32_t e : way) {
        node = edges_[e].a == node ? edges_[e].b : edges_[e].a;
        plan.points.insert(plan.points.end(), at(node).begin(), at(node).end());
      }
      plan.goal = goals_[node - 1];
      return plan;
    }
  }
}

}  // namespace robomosp::planner_ompl
