// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include "solver.h"

namespace robomosp::ik_numeric {
namespace {

// Steps along the freedom that is left, and how far in each: many for one target, few and short
// along a path so that it stays smooth.
constexpr int kImproveSteps = 60, kFollowSteps = 2;
constexpr double kImproveReach = 0.2, kFollowReach = 0.01;

}  // namespace

GeneralSolver::GeneralSolver(const Mechanism& m, std::span<const IkGoal> goals,
                             const SolverOptions& options, IkObjective objective,
                             const ClearanceField* clearance, Progress& progress)
    : mechanism_(m),
      goals_(goals.begin(), goals.end()),
      options_(options),
      objective_(objective),
      clearance_(clearance),
      progress_(progress),
      aims_(m, goals_),
      search_(aims_, progress) {}

bool GeneralSolver::attempt(std::span<const Pose> targets, const SearchOptions& options,
                            std::vector<double>& q, IkResult& out) {
  const SearchResult r = search_.run(targets, options, q);
  out.iterations += r.iterations;
  cancelled_ |= r.end == SearchEnd::cancelled || progress_.cancelled();
  ended_early_ |= r.end == SearchEnd::out_of_iterations;
  if (best_.empty() || r.cost < best_cost_) best_cost_ = r.cost, best_ = q;
  return r.end == SearchEnd::reached;
}

void GeneralSolver::solve(std::span<const Pose> targets, bool all, std::vector<double>& q,
                          IkResult& out) {
  out = IkResult{};
  best_cost_ = std::numeric_limits<double>::infinity();
  best_.clear();
  ended_early_ = false;
  const std::vector<double> seed = q;
  std::vector<std::vector<double>> found;
  for (int i = 0, idle = 0; idle <= options_.restarts && !cancelled_; ++i, ++idle) {
    if (i > 0) {
      Random random(options_.seed, static_cast<std::uint64_t>(i));
      random_configuration(mechanism_, random, q);
    }
    if (!attempt(targets, options_.search(), q, out)) continue;
    if (objective_ != IkObjective::none)
      search_.improve(targets, options_.search(), objective_, clearance_, kImproveReach,
                      kImproveSteps, q);
    unwind(mechanism_, seed, q);
    if (!all) return finish(targets, q, out);
    if (remember(q, found)) idle = 0;
    if (found.size() >= kMostSolutions) break;
  }
  if (cancelled_) return;
  if (found.empty()) return fail(targets, q, out);
  const auto distance = [&](const std::vector<double>& x) {
    double d = 0;
    for (std::size_t k = 0; k < x.size(); ++k) d += (x[k] - seed[k]) * (x[k] - seed[k]);
    return d;
  };
  std::stable_sort(found.begin(), found.end(),
                   [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  q = found[0];
  finish(targets, q, out);
  for (std::size_t k = 1; k < found.size(); ++k)
    out.q.insert(out.q.end(), found[k].begin(), found[k].end());
}

void GeneralSolver::follow(std::span<const Pose> targets, std::vector<double>& q, IkResult& out) {
  out = IkResult{};
  best_cost_ = std::numeric_limits<double>::infinity();
  best_.clear();
  ended_early_ = false;
  SearchOptions careful = options_.search();
  careful.max_step = 0.25;
  if (!attempt(targets, careful, q, out)) {
    if (!cancelled_) fail(targets, q, out);
    return;
  }
  if (objective_ != IkObjective::none)
    search_.improve(targets, careful, objective_, clearance_, kFollowReach, kFollowSteps, q);
  finish(targets, q, out);
}

// Two quaternions of opposite sign are one rotation; two turns apart is one revolute position.
bool GeneralSolver::remember(const std::vector<double>& q,
                             std::vector<std::vector<double>>& found) const {
  const auto same = [&](const std::vector<double>& other) {
    for (const JointModel& j : mechanism_.model->joints) {
      if (j.is_coupled()) continue;
      const auto first = static_cast<std::size_t>(j.q_index);
      std::size_t k = first;
      if (coordinate_count(j.type) == 1) {
        double d = q[k] - other[k];
        if (j.type == JointType::revolute)
          d -= 2 * std::numbers::pi * std::round(d / (2 * std::numbers::pi));
        if (std::fabs(d) > 1e-4) return false;
        continue;
      }
      if (j.type == JointType::free)
        for (; k < first + 3; ++k)
          if (std::fabs(q[k] - other[k]) > 1e-4 * mechanism_.length) return false;
      double dot = 0;
      for (std::size_t i = 0; i < 4; ++i) dot += q[k + i] * other[k + i];
      if (std::fabs(dot) < 1 - 1e-9) return false;
    }
    return true;
  };
  if (std::any_of(found.begin(), found.end(), same)) return false;
  found.push_back(q);
  return true;
}

void GeneralSolver::finish(std::span<const Pose> targets, const std::vector<double>& q,
                           IkResult& out) {
  aims_.evaluate(targets, q, false);
  out.q = q;
  out.status = IkStatus::solved;
  out.position_error = aims_.miss().position;
  out.rotation_error = aims_.miss().rotation;
}

void GeneralSolver::fail(std::span<const Pose> targets, std::vector<double>& q, IkResult& out) {
  q = best_;
  const Failure failure{mechanism_,    goals_, targets,     options_.search(),
                        options_.seed, 0,      ended_early_};
  const bool found = explain(failure, q, out, progress_);
  cancelled_ |= progress_.cancelled();
  const IkStatus status = out.status;
  finish(targets, q, out);
  if (!found) out.status = status;
}

}  // namespace robomosp::ik_numeric
