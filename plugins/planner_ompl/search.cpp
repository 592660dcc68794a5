// SPDX-License-Identifier: Apache-2.0
// Searches of our own, and the one file that knows OMPL: its planner in the space of joint values
// stretched by their weights (layer: plugin).
//
// bit_star: J. Gammell, S. Srinivasa, T. Barfoot, Batch informed trees, ICRA 2015.
#include "search.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <ompl/base/MotionValidator.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include "lazy_roadmap.h"
#include "two_trees.h"

namespace robomosp::planner_ompl {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using Space = ob::RealVectorStateSpace;
using Clock = std::chrono::steady_clock;

/// Time that this thread has computed [s]: how far a search comes must not depend on what else runs
/// on the machine.
double computed() {
  std::timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Error bad(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

Result<void> check(const PlanProblem& p) {
  const char* const kHint = "Report it to the caller's author.";
  if (p.dof == 0) return bad("the problem has no joints", kHint);
  if (p.lower.size() != p.dof || p.upper.size() != p.dof || p.weight.size() != p.dof ||
      p.start.size() != p.dof || p.goals.size() % p.dof != 0)
    return bad("the tables of the problem do not match its " + std::to_string(p.dof) + " joints",
               kHint);
  if (p.goals.empty()) return bad("there is no goal", "Give at least one.");
  if (!p.is_free || !p.is_free_between) return bad("the problem has no checks", kHint);
  if (!(p.seconds > 0)) return bad("there is no time to search", "Give more than 0 s.");
  for (std::size_t j = 0; j < p.dof; ++j) {
    const std::string joint = "joint " + std::to_string(j + 1);
    if (!std::isfinite(p.lower[j]) || !std::isfinite(p.upper[j]) || !(p.lower[j] < p.upper[j]))
      return bad(joint + " has no range", "Give it finite limits, the lower one first.");
    if (!(p.weight[j] > 0) || !std::isfinite(p.weight[j]))
      return bad("the weight of " + joint + " is not above 0", kHint);
    const auto outside = [&](double q) { return !(q >= p.lower[j] && q <= p.upper[j]); };
    if (outside(p.start[j]))
      return bad(joint + " is outside its limits at the start", "Start within them.");
    for (std::size_t g = 0; g < p.goals.size() / p.dof; ++g)
      if (outside(p.goals[g * p.dof + j]))
        return bad(joint + " is outside its limits at goal " + std::to_string(g + 1),
                   "Choose a goal within them.");
  }
  return {};
}

/// The problem's functions as OMPL asks for them, and what it costs so far.
class Checks {
 public:
  explicit Checks(const PlanProblem& p) : p_(p), a_(p.dof), b_(p.dof) {}
  bool is_free(const ob::State* s) {
    ++states;
    read(s, a_);
    return p_.is_free(a_);
  }
  bool is_free_between(const ob::State* from, const ob::State* to) {
    ++motions;
    read(from, a_);
    read(to, b_);
    return p_.is_free_between(a_, b_);
  }
  void read(const ob::State* s, std::span<double> q) const {
    const double* x = s->as<Space::StateType>()->values;
    for (std::size_t j = 0; j < p_.dof; ++j)  // rounding of the stretch must not leave the limits
      q[j] = std::clamp(x[j] / p_.weight[j], p_.lower[j], p_.upper[j]);
  }
  void write(std::span<const double> q, ob::State* s) const {
    double* x = s->as<Space::StateType>()->values;
    for (std::size_t j = 0; j < p_.dof; ++j) x[j] = q[j] * p_.weight[j];
  }
  [[nodiscard]] std::size_t count() const { return states + motions; }
  std::size_t states = 0, motions = 0;

 private:
  const PlanProblem& p_;
  std::vector<double> a_, b_;
};

class Motions final : public ob::MotionValidator {
 public:
  Motions(const ob::SpaceInformationPtr& si, Checks& checks)
      : ob::MotionValidator(si), checks_(checks) {}
  bool checkMotion(const ob::State* a, const ob::State* b) const override {
    return checks_.is_free_between(a, b);
  }
  bool checkMotion(const ob::State* a, const ob::State* b,
                   std::pair<ob::State*, double>& last) const override {
    const bool is_free = checks_.is_free_between(a, b);
    if (!is_free) {
      last.second = 0;
      if (last.first) si_->copyState(last.first, a);
    }
    return is_free;
  }

 private:
  Checks& checks_;
};

/// A planner and what it is to solve: a way from the start to one of the goals `to`.
struct Search {
  ob::ProblemDefinitionPtr problem;
  ob::PlannerPtr planner;
};
Search make_search(const ob::SpaceInformationPtr& si, const Checks& checks, const PlanProblem& p,
                   std::span<const std::size_t> to, const Params& params) {
  const auto planner = std::make_shared<og::BITstar>(si);
  planner->setSamplesPerBatch(static_cast<unsigned>(params.integer("batch")));
  Search out{std::make_shared<ob::ProblemDefinition>(si), planner};
  ob::ScopedState<Space> state(si->getStateSpace());
  checks.write(p.start, state.get());
  out.problem->addStartState(state);
  const auto goals = std::make_shared<ob::GoalStates>(si);
  for (const std::size_t g : to) {
    checks.write(p.goals.subspan(g * p.dof, p.dof), state.get());
    goals->addState(state);
  }
  out.problem->setGoal(goals);
  const auto length = std::make_shared<ob::PathLengthOptimizationObjective>(si);
  length->setCostThreshold(ob::Cost(0));  // none is short enough
  out.problem->setOptimizationObjective(length);
  out.planner->setProblemDefinition(out.problem);
  out.planner->setup();
  return out;
}

/// Whether a search has come to its end, asked between its steps.
class End {
 public:
  End(const PlanProblem& p, const Checks& checks, Progress& progress)
      : p_(p), checks_(checks), progress_(progress) {}
  [[nodiscard]] bool is_cancelled() const { return is_cancelled_; }
  bool is_over() {
    if (is_cancelled_ || is_late_ || (is_cancelled_ = progress_.cancelled())) return true;
    // Asking the clock takes as long as a check.
    if (calls_++ % 16 != 0) return false;
    const double seconds = computed() - begin_;
    const Clock::time_point time = Clock::now();
    if (time - told_ > std::chrono::milliseconds(100)) {
      told_ = time;
      progress_.report(
          std::min(1.0, seconds / p_.seconds),
          "searching for a path, " + std::to_string(checks_.motions) + " motions checked");
    }
    return is_late_ = seconds > p_.seconds;
  }

 private:
  const PlanProblem& p_;
  const Checks& checks_;
  Progress& progress_;
  double begin_ = computed();
  Clock::time_point told_ = Clock::now();
  bool is_cancelled_ = false, is_late_ = false;
  std::size_t calls_ = 0;
};

Error without_way(const End& end, const Checks& checks) {
  if (end.is_cancelled()) return error(ErrorCode::cancelled, "the search for a path was cancelled");
  return error(ErrorCode::unreachable,
               "no path was found in time, in " + std::to_string(checks.states) +
                   " configurations and " + std::to_string(checks.motions) + " motions checked",
               "Give it more time, use another planner, or check whether the goal is reachable.");
}

/// The numbers of the goals that are free.
Result<std::vector<std::size_t>> free_goals(const PlanProblem& p) {
  if (!p.is_free(p.start))
    return bad("the start is not free", "Move the start away from the obstacle.");
  const std::size_t count = p.goals.size() / p.dof;
  std::vector<std::size_t> free;
  for (std::size_t g = 0; g < count; ++g)
    if (p.is_free(p.goals.subspan(g * p.dof, p.dof))) free.push_back(g);
  if (free.empty())
    return bad(count == 1 ? "the goal is not free"
                          : "none of the " + std::to_string(count) + " goals is free",
               "Choose one without contact.");
  return free;
}

/// By a search of our own.
Result<Plan> by_own(Method method, const PlanProblem& p, std::span<const std::size_t> free,
                    const Params& params, Progress& progress) {
  Checks checks(p);
  End end(p, checks, progress);
  double extent = 0;
  for (std::size_t j = 0; j < p.dof; ++j)
    extent += std::pow(p.weight[j] * (p.upper[j] - p.lower[j]), 2);
  const double range = params.real("range") * std::sqrt(extent);
  Asked asked;
  asked.is_free = [&](std::span<const double> q) { return ++checks.states, p.is_free(q); };
  asked.is_free_between = [&](std::span<const double> a, std::span<const double> b) {
    return ++checks.motions, p.is_free_between(a, b);
  };
  asked.is_over = [&] { return end.is_over(); };
  auto plan =
      method == Method::prm
          ? LazyRoadmap(p, free, static_cast<std::size_t>(params.integer("neighbours")), range)
                .search(asked)
          : TwoTrees(p, free, range).search(asked);
  if (!plan) return without_way(end, checks);
  return std::move(*plan);
}

Result<Plan> by_ompl(const PlanProblem& p, std::span<const std::size_t> free, const Params& params,
                     Progress& progress) {
  Checks checks(p);
  const auto space = std::make_shared<Space>(static_cast<unsigned>(p.dof));
  ob::RealVectorBounds bounds(static_cast<unsigned>(p.dof));
  for (std::size_t j = 0; j < p.dof; ++j) {
    bounds.setLow(static_cast<unsigned>(j), p.lower[j] * p.weight[j]);
    bounds.setHigh(static_cast<unsigned>(j), p.upper[j] * p.weight[j]);
  }
  space->setBounds(bounds);
  const auto si = std::make_shared<ob::SpaceInformation>(space);
  si->setStateValidityChecker([&](const ob::State* s) { return checks.is_free(s); });
  si->setMotionValidator(std::make_shared<Motions>(si, checks));
  si->setup();

  const Search now = make_search(si, checks, p, free, params);
  const auto most = static_cast<std::size_t>(params.integer("checks"));
  bool is_found = false;
  now.problem->setIntermediateSolutionCallback(
      [&](const ob::Planner*, const std::vector<const ob::State*>&, const ob::Cost) {
        is_found = true;  // the problem itself is reported at the end only
      });
  End end(p, checks, progress);
  const ob::PlannerTerminationCondition ends(
      [&] { return end.is_over() || (is_found && checks.count() >= most); });
  // A planner may come back before its time, such as one whose start was judged when the search was
  // being cancelled.
  do now.planner->solve(ends);
  while (!now.problem->hasExactSolution() && !end.is_over());
  if (end.is_cancelled() || !now.problem->hasExactSolution()) return without_way(end, checks);
  const auto* path = now.problem->getSolutionPath()->as<og::PathGeometric>();
  Plan plan;
  plan.points.resize(path->getStateCount() * p.dof);
  for (std::size_t i = 0; i < path->getStateCount(); ++i)
    checks.read(path->getState(static_cast<unsigned>(i)),
                std::span(plan.points).subspan(i * p.dof, p.dof));
  // Ends as they were given, not as they came back from the stretch.
  double nearest = -1;
  const double* last = plan.points.data() + plan.points.size() - p.dof;
  for (const std::size_t g : free) {
    double sum = 0;
    for (std::size_t j = 0; j < p.dof; ++j) sum += std::fabs(last[j] - p.goals[g * p.dof + j]);
    if (nearest < 0 || sum < nearest) nearest = sum, plan.goal = g;
  }
  std::copy(p.start.begin(), p.start.end(), plan.points.begin());
  std::copy_n(p.goals.data() + plan.goal * p.dof, p.dof,
              plan.points.end() - static_cast<std::ptrdiff_t>(p.dof));
  return plan;
}

/// OMPL draws the seeds of its generators from one generator of the process, also in the midst of a
/// search: equal seeds give equal plans as long as one search runs at a time.
std::timed_mutex& one_at_a_time() {
  static std::timed_mutex mutex;
  return mutex;
}

}  // namespace

Result<Plan> search(Method method, const PlanProblem& problem, const Params& params,
                    Progress& progress) {
  RMP_TRY(check(problem));
  RMP_TRY_ASSIGN(const auto free, free_goals(problem));
  for (const std::size_t g : free)
    if (std::equal(problem.start.begin(), problem.start.end(),
                   problem.goals.data() + g * problem.dof))
      return Plan{{problem.start.begin(), problem.start.end()}, g};
  try {
    if (method != Method::bit_star) return by_own(method, problem, free, params, progress);
    std::unique_lock lock(one_at_a_time(), std::defer_lock);
    while (!lock.try_lock_for(std::chrono::milliseconds(20)))
      if (progress.cancelled())
        return error(ErrorCode::cancelled, "the search for a path was cancelled");
    ompl::msg::noOutputHandler();
    // Its seeds are numbers of 32 bits above 0; a seed given anew holds for generators made later.
    constexpr std::uint64_t kSeeds = 4294967291;
    ompl::RNG::setSeed(static_cast<std::uint_fast32_t>(1 + problem.seed % kSeeds));
    return by_ompl(problem, free, params, progress);
  } catch (const std::exception& e) {
    return error(ErrorCode::plugin_failed, std::string("the planner failed: ") + e.what(),
                 "Choose another planner.");
  }
}

}  // namespace robomosp::planner_ompl
