// SPDX-License-Identifier: Apache-2.0
// The two solution methods (layer: plugin): FastSolver for the whole pose of one tip of a chain of
// simple joints, GeneralSolver for everything else. One object per solve call; nothing is shared
// between threads.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "attempts.h"
#include "explain.h"

namespace robomosp::ik_numeric {

struct SolverOptions {
  int max_iterations = 100, restarts = 100;
  double damping = 1e-2;
  std::uint64_t seed = 1;
  IkTolerance tolerance;
  [[nodiscard]] SearchOptions search() const {
    return {max_iterations, damping, 0.6, true, tolerance};
  }
};

/// Most solutions searched for.
inline constexpr std::size_t kMostSolutions = 64;

class FastSolver {
 public:
  FastSolver(const Mechanism& m, const Chain& chain, const StartTable& table, std::size_t tip,
             const SolverOptions& options, Progress& progress);
  /// Independent targets; `seeds` has one configuration per target, within the limits.
  void solve(std::span<const Pose> targets, std::span<const double> seeds, std::span<IkResult> out);
  /// All solutions for one target.
  void solve_all(const Pose& target, std::span<const double> seed, IkResult& out);
  /// The next sample of a path: from q, on its branch; q becomes the solution.
  void follow(const Pose& target, std::span<double> q, IkResult& out);
  [[nodiscard]] bool cancelled() const { return cancelled_; }

 private:
  [[nodiscard]] LaneOptions lanes() const;
  [[nodiscard]] double gap(const Pose& target) const;
  bool walk(const Pose& target, const AttemptOptions& options, std::span<double> path,
            IkResult& out);
  void finish(const Pose& target, std::span<const double> path, std::span<const double> seed,
              IkResult& out);
  void fail(const Pose& target, const Attempted& a, std::span<const double> seed, IkResult& out);
  void measure(const Pose& target, IkResult& out);

  const Mechanism& mechanism_;
  const Chain& chain_;
  const StartTable& table_;
  IkGoal goal_;
  SolverOptions options_;
  Progress& progress_;
  std::vector<double> path_;
  std::vector<Pose> frames_;
  std::vector<Attempted> attempted_;
  std::vector<int> restarts_;
  bool cancelled_ = false;
};

class GeneralSolver {
 public:
  GeneralSolver(const Mechanism& m, std::span<const IkGoal> goals, const SolverOptions& options,
                IkObjective objective, const ClearanceField* clearance, Progress& progress);
  /// One target per goal; q is the seed and becomes the first solution.
  void solve(std::span<const Pose> targets, bool all, std::vector<double>& q, IkResult& out);
  void follow(std::span<const Pose> targets, std::vector<double>& q, IkResult& out);
  [[nodiscard]] bool cancelled() const { return cancelled_; }

 private:
  bool attempt(std::span<const Pose> targets, const SearchOptions& options, std::vector<double>& q,
               IkResult& out);
  bool remember(const std::vector<double>& q, std::vector<std::vector<double>>& found) const;
  void finish(std::span<const Pose> targets, const std::vector<double>& q, IkResult& out);
  void fail(std::span<const Pose> targets, std::vector<double>& q, IkResult& out);

  const Mechanism& mechanism_;
  std::vector<IkGoal> goals_;
  SolverOptions options_;
  IkObjective objective_;
  const ClearanceField* clearance_;
  Progress& progress_;
  Aims aims_;
  Search search_;
  std::vector<double> best_;
  double best_cost_ = 0;
  bool cancelled_ = false, ended_early_ = false;
};

}  // namespace robomosp::ik_numeric
