// SPDX-License-Identifier: Apache-2.0
#include "sim/motion_planning.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>

#include <robomosp/sdk/planner.h>

#include "collision/search_check.h"
#include "kernel/quiet_progress.h"
#include "kernel/text.h"
#include "motion/provider_params.h"
#include "robotics/closure.h"
#include "robotics/joint_label.h"
#include "robotics/joint_sampler.h"
#include "robotics/kinematics.h"
#include "robotics/single_joints.h"
#include "sim/ik_reason.h"
#include "sim/joint_path.h"
#include "sim/member_axes.h"
#include "sim/provider_answer.h"
#include "sim/simulate.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::sim {
namespace {

using collision::CollisionBody;
using collision::CollisionModel;
using collision::CollisionRobot;
using collision::Contact;
using collision::PathContact;
using recording::Column;
using recording::Recording;

/// Configurations from which solvers that search start, besides the robot's own.
constexpr std::size_t kSeeds = 16;
/// Goals closer than this in every joint are one [rad or m].
constexpr double kSameGoal = 1e-6;
/// The least weight of a joint, as a share of the greatest.
constexpr double kLeastWeight = 0.05;
/// Share of the motions beside a corner that rounding may take at first, by how much less where the
/// sampled motion is not free, and how often.
constexpr double kRounding = 0.5, kLessRounding = 0.3;
constexpr int kMostRoundings = 12;
/// The clearance that the curve of a corner keeps at least, as a share of what was asked for, where
/// there is no more room; and what the sampled motion keeps.
constexpr double kCornerClearance = 0.75, kSampledClearance = 0.5;
/// Configurations of the rounded path are timed down to this distance, of the whole path.
constexpr double kLeastRoundStep = 2e-5;
/// Between samples of motions that a planner asks for no point moves farther than this [m]; it is
/// halved each time that a way was not free between them.
constexpr double kSearchStep = 0.02;
/// Searches of ways that prove not to be free between samples; the next one proves each motion.
constexpr std::size_t kQuickSearches = 4;

/// Time that this thread has computed [s], which does not depend on what else the machine does.
double thread_seconds() {
  std::timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Adds the time of its life to a sum [s].
class Stopwatch {
 public:
  explicit Stopwatch(double& sum) : sum_(sum) {}
  ~Stopwatch() {
    sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& sum_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// One robot's joint space among the obstacles. A failure of the engine makes everything occupied
/// and is kept.
class RobotSpace {
 public:
  RobotSpace(const CollisionModel& model, const PlanTask& task, Progress& progress)
      : model_(model),
        robot_(model.robots()[task.robot]),
        clearance_(task.clearance),
        progress_(progress),
        shown_(model.shown()) {
    const RobotModel& m = *robot_.model;
    weight.assign(m.dof(), 0);
    for (const CollisionBody& body : model.bodies())
      if (body.robot == static_cast<std::int32_t>(task.robot)) weigh(body.joint, body.reach);
    for (const TipModel& tip : m.tips) weigh(tip.joint, spatial::norm(tip.tool.p));
    const double most = *std::max_element(weight.begin(), weight.end());
    for (double& w : weight) w = most > 0 ? std::max(w, kLeastWeight * most) : 1;
    for (std::size_t j = 0; j < m.dof(); ++j) {
      const JointModel& joint = m.joints[j];
      const double turns = 2 * std::numbers::pi;
      lower.push_back(std::isfinite(joint.lower) ? joint.lower : task.start[j] - turns);
      upper.push_back(std::isfinite(joint.upper) ? joint.upper : task.start[j] + turns);
    }
    quick_ = std::make_unique<collision::SearchCheck>(model, task.robot, lower, upper);
  }

  /// Waypoints of all robots, from rows of this one.
  [[nodiscard]] std::vector<double> all(std::span<const double> rows) const {
    const std::size_t dof = weight.size();
    std::vector<double> out;
    for (std::size_t i = 0; i < rows.size() / dof; ++i) {
      const auto at = out.insert(out.end(), shown_.begin(), shown_.end());
      std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(i * dof), dof,
                  at + static_cast<std::ptrdiff_t>(robot_.first));
    }
    return out;
  }
  /// The first pair that is too near.
  [[nodiscard]] std::optional<Contact> contact(std::span<const double> q) {
    const auto near = model_.near(all(q), clearance_, progress_);
    if (!near.ok()) {
      fail(near.error());
      return Contact{{-1, -1}, {}};
    }
    if (near->empty()) return std::nullopt;
    return *std::min_element(near->begin(), near->end(), [](const auto& a, const auto& b) {
      return a.at.distance < b.at.distance;
    });
  }
  [[nodiscard]] bool is_free(std::span<const double> q) {
    if (failure || !is_inside(q)) return false;
    return value(quick_->is_free(q, clearance_, progress_), false);
  }
  /// Whether samples of the straight motion are free that are `step` [m] apart at most.
  [[nodiscard]] bool seems_free(std::span<const double> a, std::span<const double> b, double step) {
    if (failure || !is_inside(a) || !is_inside(b)) return false;
    return value(quick_->seems_free(a, b, clearance_, step, progress_), false);
  }
  /// Whether the straight motions from row to row keep the share of the clearance for certain.
  [[nodiscard]] bool is_free_along(std::span<const double> rows, double share = 1) {
    using collision::MotionFound;
    if (failure) return false;
    const double room = share * clearance_;
    switch (value(quick_->check_rows(rows, room, progress_), MotionFound::blocked)) {
      case MotionFound::free: return true;
      case MotionFound::blocked: return false;
      case MotionFound::unsure: break;
    }
    return !failure && !contact_along(rows, room);
  }
  /// Whether the straight motion is free for certain; what is not mostly shows in the samples.
  [[nodiscard]] bool is_free_between(std::span<const double> a, std::span<const double> b,
                                     double step) {
    if (!seems_free(a, b, step)) return false;
    std::vector<double> rows(a.begin(), a.end());
    rows.insert(rows.end(), b.begin(), b.end());
    return is_free_along(rows);
  }
  [[nodiscard]] const collision::SearchCheck::Counts& counts() const { return quick_->counts(); }
  [[nodiscard]] std::optional<PathContact> contact_along(std::span<const double> rows,
                                                         double tolerance) {
    const auto found = model_.check_path(all(rows), tolerance, progress_);
    if (found.ok()) return *found;
    fail(found.error());
    return PathContact{};
  }
  [[nodiscard]] std::string describe(const Contact& c) const {
    if (c.at.distance <= 0) return model_.describe(c.pair) + " touch";
    return model_.describe(c.pair) + " are " + text::print_rounded(c.at.distance, 3) +
           " m apart, less than the clearance of " + text::print_rounded(clearance_) + " m";
  }

  std::vector<double> lower, upper, weight;
  std::optional<Error> failure;

 private:
  void fail(const Error& e) {
    if (!failure) failure = e;
  }
  template <class T>
  T value(Result<T> found, T of_failure) {
    if (found.ok()) return *found;
    fail(found.error());
    return of_failure;
  }
  [[nodiscard]] bool is_inside(std::span<const double> q) const {
    for (std::size_t j = 0; j < q.size(); ++j)
      if (q[j] < lower[j] || q[j] > upper[j]) return false;
    return true;
  }
  /// What is carried by `joint` and reaches `arm` from its origin: joints up to the base move it.
  void weigh(std::int32_t joint, double arm) {
    for (std::int32_t i = joint; i >= 0;) {
      const auto k = static_cast<std::size_t>(i);
      const JointModel& j = robot_.model->joints[k];
      weight[k] = std::max(weight[k], j.type == JointType::prismatic ? 1 : arm);
      arm += spatial::norm(j.placement.p);
      i = j.parent;
    }
  }

  const CollisionModel& model_;
  const CollisionRobot& robot_;
  double clearance_;
  QuietProgress progress_;  ///< looks at single configurations say nothing of the search
  std::vector<double> shown_;
  std::unique_ptr<collision::SearchCheck> quick_;
};

/// A configuration with a joint beyond its limits, at the start or the goal.
Error outside_limits(const RobotModel& m, const PlanTask& task, std::int32_t j,
                     std::span<const double> q, const std::string& at, const std::string& hint) {
  const auto i = static_cast<std::size_t>(j);
  const std::string axis =
      task.axes ? task.axes->before_place(static_cast<std::size_t>(m.joints[i].q_index), q)
                : std::string();
  return error(ErrorCode::invalid_argument,
               axis + robotics::joint_label(m, i) + " is outside its limits at the " + at, hint);
}

Result<void> check(const CollisionRobot& robot, const PlanTask& task) {
  const RobotModel& m = *robot.model;
  if (m.dof() == 0)
    return error(ErrorCode::unsupported, "no path can be planned for it: it has no moving joints",
                 "Plan for a robot with joints.");
  if (const std::string why = robotics::why_not_single_joints(m); !why.empty())
    return error(ErrorCode::unsupported, "no path can be planned for it yet: " + why,
                 "Plan for a robot without followers, closed loops, ball and free joints.");
  if (!(task.clearance > 0) || !std::isfinite(task.clearance))
    return error(ErrorCode::invalid_argument, "the clearance is not above 0",
                 "Give a length such as 2 mm.");
  if (const std::int32_t j = robotics::joint_outside_limits(m, task.start, 0); j >= 0)
    return outside_limits(m, task, j, task.start, "start", "Start within them.");
  return {};
}

/// Turns by whole revolutions to what is nearest to the start.
void unwind(const RobotModel& m, std::span<const double> start, std::span<double> q) {
  constexpr double kTurn = 2 * std::numbers::pi;
  for (std::size_t j = 0; j < q.size(); ++j) {
    if (m.joints[j].type != JointType::revolute) continue;
    const double near = q[j] + kTurn * std::round((start[j] - q[j]) / kTurn);
    if (near >= m.joints[j].lower && near <= m.joints[j].upper) q[j] = near;
  }
}

/// Configurations that reach one of the targets.
Result<std::vector<double>> solutions(const Registry& registry, const CollisionRobot& robot,
                                      const PlanTask& task, Progress& progress) {
  const RobotModel& m = *robot.model;
  const std::size_t dof = m.dof();
  RMP_TRY_ASSIGN(const auto ik, bind_ik(registry, robot.model, task.ik));
  std::vector<double> seeds = task.start, out;
  auto sampler = robotics::JointSampler::make(m, 0, task.start, task.seed);
  if (sampler.ok())
    for (std::size_t i = 0; i < kSeeds; ++i) {
      seeds.resize(seeds.size() + dof);
      sampler->sample(2 * i, std::span(seeds).last(dof));  // odd ones lie on limits
    }
  std::string reason;
  for (const Pose& target : task.targets) {
    const Pose base_T_tip = spatial::compose(spatial::inverse(robot.world_T_base), target);
    const std::vector<Pose> targets(seeds.size() / dof, base_T_tip);
    IkBatch batch;
    batch.targets = targets;
    batch.seeds = seeds;
    batch.all_solutions = true;
    RMP_TRY_ASSIGN(const auto results, solve_ik(ik, batch, progress));
    for (const IkResult& r : results) {
      if (r.status != IkStatus::solved) {
        if (reason.empty())
          reason = task.axes ? ik_reason(registry, ik, task.ik, r, base_T_tip, task.start,
                                         *task.axes, progress)
                             : r.detail;
        continue;
      }
      for (std::size_t k = 0; k < r.q.size() / dof; ++k) {
        std::vector<double> q(r.q.begin() + static_cast<std::ptrdiff_t>(k * dof),
                              r.q.begin() + static_cast<std::ptrdiff_t>((k + 1) * dof));
        unwind(m, task.start, q);
        bool is_new = true;
        for (std::size_t i = 0; i < out.size() && is_new; i += dof) {
          double most = 0;
          for (std::size_t j = 0; j < dof; ++j) most = std::max(most, std::fabs(out[i + j] - q[j]));
          is_new = most > kSameGoal;
        }
        if (is_new) out.insert(out.end(), q.begin(), q.end());
      }
    }
  }
  if (out.empty())
    return error(ErrorCode::unreachable,
                 "the target cannot be reached: " +
                     (reason.empty() ? "no joint values were found for it" : reason),
                 "Choose another target.");
  return out;
}

/// The goals that are free; an error names what is in the way of all.
Result<std::vector<double>> free_goals(RobotSpace& space, const std::vector<double>& goals,
                                       std::size_t dof) {
  std::vector<double> out;
  std::string first;
  for (std::size_t i = 0; i < goals.size(); i += dof) {
    const std::span<const double> q(&goals[i], dof);
    const auto contact = space.contact(q);
    if (space.failure) return *space.failure;
    if (!contact) out.insert(out.end(), q.begin(), q.end());
    else if (first.empty()) first = space.describe(*contact);
  }
  if (!out.empty()) return out;
  const std::size_t count = goals.size() / dof;
  return error(ErrorCode::invalid_argument,
               count == 1
                   ? "at the goal " + first
                   : "at all " + std::to_string(count) +
                         " configurations of the goal there is a contact; at the first " + first,
               "Choose another goal, give a smaller clearance, or allow the pair.");
}

Result<void> check_plan(const Plan& plan, const PlanProblem& p, const std::string& provider) {
  const std::size_t n = p.dof;
  if (plan.points.size() < n || plan.points.size() % n != 0 || !all_finite(plan.points))
    return broken(provider, "returned a path that is not a sequence of joint vectors");
  if (!std::equal(p.start.begin(), p.start.end(), plan.points.begin()) ||
      plan.goal >= p.goals.size() / n ||
      !std::equal(plan.points.end() - static_cast<std::ptrdiff_t>(n), plan.points.end(),
                  p.goals.begin() + static_cast<std::ptrdiff_t>(plan.goal * n)))
    return broken(provider, "returned a path that does not lead from the start to a goal");
  for (std::size_t i = n; i < plan.points.size(); i += n)
    if (!p.is_free_between({&plan.points[i - n], n}, {&plan.points[i], n}))
      return broken(provider, "returned a path with a contact");
  return {};
}

/// The robot's limits, and the task's where it has none; `notes` names those.
RobotModel limited(const RobotModel& model, const PlanTask& task, std::vector<std::string>& notes) {
  RobotModel out = model;
  for (std::size_t j = 0; j < out.joints.size(); ++j) {
    JointModel& joint = out.joints[j];
    const bool has_velocity = std::isfinite(joint.max_velocity),
               has_acceleration = std::isfinite(joint.max_acceleration);
    if (has_velocity && has_acceleration) continue;
    if (!has_velocity) joint.max_velocity = task.velocity;
    if (!has_acceleration) joint.max_acceleration = joint.max_velocity / task.ramp;
    const std::string unit = joint.type == JointType::revolute ? " rad/s" : " m/s";
    const std::string axis = task.axes ? task.axes->before_joint(j) : std::string();
    notes.push_back(axis + (axis.empty() ? "Joint " : "joint ") + std::to_string(j + 1) + " (" +
                    joint.name + ") has no limit for " +
                    (has_velocity       ? ""
                     : has_acceleration ? "the velocity"
                                        : "velocity and acceleration") +
                    (has_velocity ? "the acceleration" : "") + "; it is moved with at most " +
                    text::print_rounded(joint.max_velocity) + unit + " and " +
                    text::print_rounded(joint.max_acceleration) + unit + "^2.");
  }
  return out;
}

/// The corner of the way that is nearest to a sample of the motion along it, from 0.
std::size_t nearest_corner(const PlanProblem& p, std::span<const double> way,
                           std::span<const double> motion, std::size_t sample) {
  const double* q = &motion[std::min(sample, motion.size() / p.dof - 1) * p.dof];
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; (i + 1) * p.dof < way.size(); ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < p.dof; ++j)
      sum += std::pow(p.weight[j] * (way[i * p.dof + j] - q[j]), 2);
    if (sum < least) least = sum, nearest = i - 1;
  }
  return nearest;
}

/// Gives a corner less room; the third time none.
void lessen(double& share) {
  share = share > kRounding * kLessRounding * kLessRounding ? share * kLessRounding : 0;
}

/// The way as a motion in time that is free as it is sampled.
Result<void> run_along(const Registry& registry, const CollisionRobot& robot, const PlanTask& task,
                       const PlanProblem& p, RobotSpace& space, PlannedMotion& out,
                       Progress& progress) {
  RobotModel model = limited(*robot.model, task, out.notes);
  model.gravity = spatial::rotate_back(robot.world_T_base, task.gravity);
  std::optional<Bound<InverseDynamics>> dynamics;
  if (task.timing.has_torques &&
      std::any_of(model.joints.begin(), model.joints.end(),
                  [](const JointModel& j) { return std::isfinite(j.max_force); })) {
    RMP_TRY_ASSIGN(dynamics,
                   bind_inverse_dynamics(registry, std::make_shared<const RobotModel>(model),
                                         task.inverse_dynamics));
  }
  std::vector<double> shares(out.waypoints.size() / p.dof - 2, kRounding);
  for (int i = 0; i <= kMostRoundings; ++i) {
    progress.report(1, "rounding and timing the path");
    const RoundWay round =
        round_corners(p, out.waypoints, shares, [&](std::span<const double> rows, bool is_reduced) {
          return space.is_free_along(rows, is_reduced ? kCornerClearance : 1);
        });
    if (space.failure) return *space.failure;
    RobotMotion path;
    path.q = round.points;
    for (std::size_t k = 0; k < path.q.size() / p.dof; ++k)
      path.times.push_back(static_cast<double>(k));
    RetimeOptions timing = task.timing;
    timing.least_step = kLeastRoundStep;
    RMP_TRY_ASSIGN(out.motion, retime(registry, model, path, dynamics ? &*dynamics : nullptr,
                                      timing, "", progress));
    if (!space.is_free_along(out.motion.q, kSampledClearance)) {
      if (space.failure) return *space.failure;
      const auto contact = space.contact_along(out.motion.q, kSampledClearance * task.clearance);
      if (space.failure) return *space.failure;
      if (contact) {
        // The corner where it comes too near is rounded less; in the end the robot stops at all.
        if (std::all_of(shares.begin(), shares.end(), [](double x) { return x == 0; })) break;
        const std::size_t corner = nearest_corner(p, out.waypoints, out.motion.q, contact->segment);
        if (i + 1 >= kMostRoundings || shares[corner] == 0)
          std::fill(shares.begin(), shares.end(), 0.0);
        else lessen(shares[corner]);
        continue;
      }
    }
    out.notes.insert(out.notes.end(), out.motion.notes.begin(), out.motion.notes.end());
    return {};
  }
  return error(ErrorCode::unreachable, "a path was found, but it is too narrow for a smooth motion",
               "Give a larger clearance or a shorter sample time.");
}

/// A way that is free for certain. Planners ask for samples of motions; a way that is not free
/// between them is searched again with samples that are nearer to each other, in the end with each
/// motion proved.
Result<std::vector<double>> find_way(const Registry& registry, const std::string& where,
                                     const PlanTask& task, RobotSpace& space, PlanProblem& p,
                                     const std::function<double()>& left, PlannedMotion& out,
                                     Progress& progress) {
  PlanWork& work = out.work;
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 registry.find(Planner::kInterfaceId, task.planner.name).in(where));
  out.planner = info.name;
  RMP_TRY_ASSIGN(const auto planner, registry.create<Planner>(info.name).in(where));
  RMP_TRY_ASSIGN(
      const auto params,
      motion::checked_params(info, task.planner, where + ", provider " + text::quote(info.name)));
  double step = kSearchStep;
  p.is_free = [&](std::span<const double> q) { return space.is_free(q); };
  p.is_free_between = [&](std::span<const double> a, std::span<const double> b) {
    ++work.motions;
    return work.searches <= kQuickSearches ? space.seems_free(a, b, step)
                                           : space.is_free_between(a, b, step);
  };
  for (;; ++work.searches, step *= 0.5) {
    p.seconds = std::max(left(), 1e-3);
    auto planned = [&] {
      const Stopwatch watch(work.search_seconds);
      return guarded(info.name, [&] { return planner->plan(p, *params, progress); });
    }();
    if (space.failure) return *space.failure;
    if (!planned.ok()) return in_robot(std::move(planned).error(), where);
    const Stopwatch watch(work.proof_seconds);
    auto checked = check_plan(*planned, p, info.name);
    if (space.failure) return *space.failure;  // nobody can tell whether the way is free
    if (!checked.ok()) return std::move(checked).in(where).error();
    const bool is_free = work.searches > kQuickSearches || space.is_free_along(planned->points);
    if (space.failure) return *space.failure;
    if (is_free) return std::move(planned->points);
  }
}

Result<PlannedMotion> find_motion(const Registry& registry, const CollisionModel& model,
                                  const PlanTask& task, Progress& progress) {
  const CollisionRobot& robot = model.robots()[task.robot];
  const std::string where = "robot " + text::quote(robot.name);
  RMP_TRY(check(robot, task).in(where));
  const std::size_t dof = robot.model->dof();
  PlannedMotion out;
  PlanWork& work = out.work;
  const double begin = thread_seconds();
  const auto left = [&] { return task.seconds - (thread_seconds() - begin); };
  RobotSpace space(model, task, progress);
  std::vector<double> goals = task.goals;
  {
    const Stopwatch watch(work.goals_seconds);
    if (const auto contact = space.contact(task.start)) {
      if (space.failure) return *space.failure;
      return error(ErrorCode::invalid_argument, "at the start " + space.describe(*contact),
                   "Start elsewhere, give a smaller clearance, or allow the pair.", where);
    }
    if (!task.targets.empty()) {
      RMP_TRY_ASSIGN(const auto found, solutions(registry, robot, task, progress).in(where));
      goals.insert(goals.end(), found.begin(), found.end());
    }
    for (std::size_t i = 0; i < goals.size(); i += dof) {
      const auto goal = std::span<const double>(goals).subspan(i, dof);
      if (const std::int32_t j = robotics::joint_outside_limits(*robot.model, goal, 0); j >= 0)
        return outside_limits(*robot.model, task, j, goal, "goal", "Choose a goal within them.")
            .in(where);
    }
    RMP_TRY_ASSIGN(goals, free_goals(space, goals, dof).in(where));
  }
  out.goals = goals.size() / dof;

  PlanProblem p;
  p.dof = dof;
  p.lower = space.lower, p.upper = space.upper, p.weight = space.weight;
  p.start = task.start, p.goals = goals;
  p.seed = task.seed;
  RMP_TRY_ASSIGN(const std::vector<double> found,
                 find_way(registry, where, task, space, p, left, out, progress));
  out.found = path_length(p, found);
  if (!(out.found > 0))
    return error(ErrorCode::invalid_argument, "the start is already the goal",
                 "Choose another goal.", where);
  {
    const Stopwatch watch(work.shortcut_seconds);
    p.is_free_between = [&](std::span<const double> a, std::span<const double> b) {
      return space.is_free_between(a, b, kSearchStep);
    };
    RMP_TRY_ASSIGN(out.waypoints,
                   shorten(
                       p, found, task.tries, progress, [&] { return left() <= 0; }, &work.shortcuts)
                       .in(where));
    if (space.failure) return *space.failure;
  }
  out.length = path_length(p, out.waypoints);
  if (work.shortcuts < task.tries && left() <= 0 && out.waypoints.size() > 2 * dof)
    out.notes.push_back(
        "The time limit was reached after " + std::to_string(work.shortcuts) + " of " +
        std::to_string(task.tries) +
        " shortcuts: give more seconds for a shorter path that is reproducible from the seed.");
  if (task.is_timed) {
    const Stopwatch watch(work.timing_seconds);
    RMP_TRY(run_along(registry, robot, task, p, space, out, progress).in(where));
  }
  work.configurations = space.counts().configurations;
  work.distances = space.counts().distances;
  return out;
}

}  // namespace

Result<PlannedMotion> plan_motion(const Registry& registry, const CollisionModel& model,
                                  const PlanTask& task, Progress& progress) {
  auto out = find_motion(registry, model, task, progress);
  if (!task.axes) return out;
  // Planners, retimers and solvers know joints only.
  const RobotModel& robot = *model.robots()[task.robot].model;
  if (!out.ok()) return task.axes->in_error(robot, std::move(out).error());
  for (std::string& note : out->notes) note = task.axes->in_text(robot, note);
  return out;
}

Recording planned_recording(const CollisionRobot& robot, WorldId world, const PlannedMotion& plan,
                            const robotics::MakerAxes& axes) {
  const RobotModel& model = *robot.model;
  const RobotMotion& t = plan.motion;
  const std::size_t dof = model.dof();
  Recording out;
  out.title = robot.name + ": planned path";
  out.world = world;
  out.robot = robot.name;
  out.dof = dof;
  out.notes = plan.notes;
  out.columns.push_back({"time", "s", "time along the path", t.times});
  const auto add = [&](const char* stem, const char* what, const char* per,
                       const std::vector<double>& table) {
    for (std::size_t j = 0; j < dof; ++j) {
      const JointModel& joint = model.joints[j];
      Column c{stem + std::to_string(j + 1),
               (joint.type == JointType::revolute ? std::string("rad") : std::string("m")) + per,
               std::string(what) + " of " + robotics::joint_label(model, j),
               {}};
      for (std::size_t i = j; i < table.size(); i += dof) c.values.push_back(table[i]);
      out.columns.push_back(std::move(c));
    }
  };
  add("q", "position", "", t.q);
  add("qd", "velocity", "/s", t.qd);
  add("qdd", "acceleration", "/s^2", t.qdd);
  std::vector<Pose> frames(model.joints.size());
  std::array<Column, 3> tip;
  for (std::size_t k = 0; k < 3; ++k)
    tip[k] = {std::string(1, static_cast<char>('x' + k)), "m", "tool position in the world", {}};
  for (std::size_t i = 0; i < t.times.size(); ++i) {
    robotics::forward_kinematics(model, std::span<const double>(t.q).subspan(i * dof, dof), frames);
    const Vec3 at = spatial::transform(robot.world_T_base, robotics::tip_pose(model, 0, frames).p);
    for (std::size_t k = 0; k < 3; ++k) tip[k].values.push_back(at[k]);
  }
  for (Column& c : tip) out.columns.push_back(std::move(c));
  name_axes(out, model, axes);
  return out;
}

}  // namespace robomosp::sim
