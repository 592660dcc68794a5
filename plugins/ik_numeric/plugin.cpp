// SPDX-License-Identifier: Apache-2.0
// Provider "numeric" of robomosp.ik/1 (layer: plugin): searches from the seed, then from repeatable
// random starts, and says in words why a target has no answer.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/plugin.h>

#include "solver.h"
#include "spatial/ik_support.h"
#include "spatial/pose.h"

namespace robomosp::ik_numeric {
namespace {

const rmp_param kParams[] = {
    {"max_iterations", "int", "", "Greatest number of steps of one search.", "100", nullptr, 1,
     100000},
    {"restarts", "int", "", "Random starts after the seed has failed.", "100", nullptr, 0, 100000},
    {"damping", "real", "",
     "Damping per squared error; larger is more cautious far from the target.", "0.01", nullptr,
     1e-9, 1e3},
    {"seed", "int", "", "Seed of the random numbers; the same seed gives the same results.", "1",
     nullptr, 0, 4294967295.0},
};

Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

class NumericIk final : public IkSolver {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override {
    const std::string where = "robot \"" + model.name + "\"";
    if (model.joints.empty()) return bad("it has no joints to solve for", "Add a joint.").in(where);
    if (model.tips.empty()) return bad("it has no tip to place", "Add a tool.").in(where);
    for (const JointModel& joint : model.joints)
      if (!(joint.lower <= joint.upper) || !spatial::is_rigid(joint.placement))
        return bad("its limits or its placement are not usable numbers",
                   "Correct the robot's table.")
            .in("joint \"" + joint.name + "\"")
            .in(where);
    model_ = &model;
    mechanism_ = make_mechanism(model);
    chains_.clear();
    tables_.clear();
    options_ = {};
    options_.max_iterations = static_cast<int>(params.integer("max_iterations"));
    options_.damping = params.real("damping");
    options_.restarts = static_cast<int>(params.integer("restarts"));
    options_.seed = static_cast<std::uint64_t>(params.integer("seed"));
    if (!model.is_simple() || !model.loops.empty()) return {};
    for (std::size_t i = 0; i < model.tips.size(); ++i) {
      chains_.push_back(make_chain(model, i));
      tables_.emplace_back(chains_.back(), options_.seed);
    }
    return {};
  }

  Result<void> solve(const IkBatch& batch, std::span<IkResult> results,
                     Progress& progress) const override {
    const IkGoal whole{batch.tip, kIkPose, 1};
    const std::span<const IkGoal> goals = batch.goals.empty() ? std::span(&whole, 1) : batch.goals;
    RMP_TRY(check(batch, goals, results.size()));
    SolverOptions options = options_;
    options.tolerance = batch.tolerance;
    const auto tip = static_cast<std::size_t>(goals[0].tip);
    const bool fast = !chains_.empty() && goals.size() == 1 && goals[0].parts == kIkPose &&
                      batch.objective == IkObjective::none && chains_[tip].size() > 0;
    const spatial::NearTargets near(*model_, batch);
    const bool done = fast ? solve_fast(near.batch(), tip, options, results, progress)
                           : solve_general(near.batch(), goals, options, results, progress);
    if (!done) return error(ErrorCode::cancelled, "inverse kinematics was cancelled");
    near.correct(results);
    return {};
  }

 private:
  static constexpr std::size_t kChunk = 256;  // targets whose attempts are in memory at once

  bool solve_fast(const IkBatch& batch, std::size_t tip, const SolverOptions& options,
                  std::span<IkResult> results, Progress& progress) const {
    FastSolver solver(mechanism_, chains_[tip], tables_[tip], tip, options, progress);
    const std::size_t n = model_->coordinate_count();
    const std::size_t chunk = batch.continuous || batch.all_solutions ? 1 : kChunk;
    std::vector<double> q;
    for (std::size_t i = 0; i < results.size(); i += chunk) {
      if (!tell(progress, i, results.size())) return false;
      const std::size_t count = std::min(chunk, results.size() - i);
      if (batch.continuous && i > 0) {
        solver.follow(batch.targets[i], q, results[i]);
      } else {
        q.resize(count * n);
        for (std::size_t k = 0; k < count; ++k) start(batch, i + k, std::span(q).subspan(k * n, n));
        if (batch.all_solutions) solver.solve_all(batch.targets[i], q, results[i]);
        else solver.solve(batch.targets.subspan(i, count), q, results.subspan(i, count));
        if (batch.continuous && !solver.cancelled())
          q.assign(results[i].q.begin(), results[i].q.begin() + static_cast<std::ptrdiff_t>(n));
      }
      if (solver.cancelled()) return false;
    }
    return true;
  }

  bool solve_general(const IkBatch& batch, std::span<const IkGoal> goals,
                     const SolverOptions& options, std::span<IkResult> results,
                     Progress& progress) const {
    GeneralSolver solver(mechanism_, goals, options, batch.objective, batch.clearance, progress);
    std::vector<double> q(model_->coordinate_count());
    for (std::size_t i = 0; i < results.size(); ++i) {
      if (!tell(progress, i, results.size())) return false;
      const auto targets = batch.targets.subspan(i * goals.size(), goals.size());
      if (batch.continuous && i > 0) {
        solver.follow(targets, q, results[i]);
      } else {
        start(batch, i, q);
        solver.solve(targets, batch.all_solutions, q, results[i]);
      }
      if (solver.cancelled()) return false;
    }
    return true;
  }

  static bool tell(Progress& progress, std::size_t i, std::size_t count) {
    if (progress.cancelled()) return false;
    if (i % 64 == 0)
      progress.report(static_cast<double>(i) / static_cast<double>(count), "inverse kinematics");
    return true;
  }

  [[nodiscard]] Result<void> check(const IkBatch& batch, std::span<const IkGoal> goals,
                                   std::size_t results) const {
    if (!model_) return bad("the solver was not given a robot", "Call prepare first.");
    const std::size_t n = model_->coordinate_count(), count = batch.targets.size();
    if (results * goals.size() != count)
      return bad(std::to_string(results) + " results for " + std::to_string(count) +
                     " targets of " + std::to_string(goals.size()) + " goals",
                 "Give one result per sample and one target per goal and sample.");
    if (!batch.seeds.empty() && batch.seeds.size() != n && batch.seeds.size() != n * results)
      return bad(
          "the seeds have " + std::to_string(batch.seeds.size()) + " values for " +
              std::to_string(results) + " samples and " + std::to_string(n) + " coordinates",
          "Give " + std::to_string(n) + " for all, " + std::to_string(n * results) + ", or none.");
    const std::size_t tips = model_->tips.size();
    for (const IkGoal& g : goals) {
      if (g.tip < 0 || static_cast<std::size_t>(g.tip) >= tips)
        return bad("there is no tip " + std::to_string(g.tip),
                   "The robot has tips 0 to " + std::to_string(tips - 1) + ".");
      if (!(g.parts & kIkPose) || (g.parts & ~static_cast<std::uint32_t>(kIkPose)))
        return bad("a goal's parts are " + std::to_string(g.parts) + ", which select no constraint",
                   "Add 1, 2, 4 for the position and 8, 16, 32 for the rotation.");
      if (!(g.weight > 0) || !std::isfinite(g.weight))
        return bad("a goal's weight is not positive", "Give numbers above 0, such as 1.");
    }
    if (!(batch.tolerance.position > 0) || !(batch.tolerance.rotation > 0))
      return bad("a tolerance is not positive", "Give lengths and angles above 0, such as 1e-9.");
    if (batch.objective == IkObjective::clearance && !batch.clearance)
      return bad("the objective clearance has no obstacles",
                 "Give the clearance field, or choose another objective.");
    for (std::size_t i = 0; i < count; ++i)
      if (!spatial::is_rigid(batch.targets[i], 1e-6))
        return bad("target " + std::to_string(i + 1) + " is not a pose",
                   "Its rotation must be orthonormal and all its numbers finite.");
    for (std::size_t i = 0; i < batch.seeds.size(); ++i)
      if (!std::isfinite(batch.seeds[i]))
        return bad("value " + std::to_string(i + 1) + " of the seeds is not finite",
                   "Correct the seed.");
    return {};
  }

  // The seed within the limits; without one the middle of the limits.
  void start(const IkBatch& batch, std::size_t sample, std::span<double> q) const {
    const std::size_t n = q.size();
    if (batch.seeds.empty()) {
      const std::vector<double> middle = middle_configuration(mechanism_);
      std::copy(middle.begin(), middle.end(), q.begin());
      return;
    }
    const double* seed = batch.seeds.data() + (batch.seeds.size() == n ? 0 : sample * n);
    std::copy_n(seed, n, q.begin());
    mend(mechanism_, q);
  }

  const RobotModel* model_ = nullptr;
  Mechanism mechanism_;
  std::vector<Chain> chains_;       ///< one a tip, when all joints are simple
  std::vector<StartTable> tables_;  ///< one a chain
  SolverOptions options_;
};

}  // namespace
}  // namespace robomosp::ik_numeric

RMP_PLUGIN(
    "org.robomosp.ik_numeric", "0.1.0", "Apache-2.0",
    "Inverse kinematics of any mechanism by a damped search.",
    RMP_PROVIDER(robomosp::ik_numeric::NumericIk, "numeric",
                 "Levenberg-Marquardt search within joint limits, for all tips of any robot.",
                 "serial,tree,redundant,closed,floating,goals,objectives,batch",
                 robomosp::ik_numeric::kParams))
