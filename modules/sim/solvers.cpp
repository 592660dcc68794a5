// SPDX-License-Identifier: Apache-2.0
// Providers bound to a model, with everything they return checked before it is used.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "kernel/text.h"
#include "motion/provider_params.h"
#include "robotics/batch_kinematics.h"
#include "robotics/closure.h"
#include "robotics/kinematics.h"
#include "sim/batches.h"
#include "sim/closed_dynamics.h"
#include "sim/dynamics_choice.h"
#include "sim/ik_choice.h"
#include "sim/provider_answer.h"
#include "sim/simulate.h"
#include "spatial/magnitudes.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::sim {
namespace {

template <class Solver>
Result<Bound<Solver>> bind(const Registry& registry, std::shared_ptr<const RobotModel> model,
                           const model::ProviderChoice& choice) {
  const std::string where = "robot " + text::quote(model->name);
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 registry.find(Solver::kInterfaceId, choice.name).in(where));
  RMP_TRY_ASSIGN(auto solver, registry.create<Solver>(info.name).in(where));
  RMP_TRY_ASSIGN(auto params, motion::checked_params(
                                  info, choice, where + ", provider " + text::quote(info.name)));
  auto prepared = guarded(info.name, [&] { return solver->prepare(*model, *params); });
  if (!prepared.ok()) return in_robot(std::move(prepared).error(), where);
  return Bound<Solver>{std::move(model), std::move(solver), info.name};
}

/// Limits are met up to this rounding slack [rad or m].
constexpr double kLimitSlack = 1e-9;

/// What is left of a goal's parts at `reached`: of the position [m] and of the rotation [rad]. Two
/// turns are the direction of the axis that is left; else the parts of the rotation vector.
std::array<double, 2> goal_errors(std::uint32_t parts, const Pose& reached, const Pose& target) {
  const Vec3 p = spatial::rotate_back(target, spatial::sub(reached.p, target.p));
  Pose turn;
  turn.R = spatial::compose(spatial::inverse(target), reached).R;
  Vec3 r = spatial::rotation_log(turn.R);
  const std::uint32_t turns = parts & kIkRotation;
  if (std::popcount(turns) == 2) {
    const std::size_t k = !(turns & kIkRotX) ? 0 : !(turns & kIkRotY) ? 1 : 2;
    const Vec3 a = spatial::axis(turn, k);
    const double across = std::hypot(a[(k + 1) % 3], a[(k + 2) % 3]);
    r = {};
    r[(k + 1) % 3] = std::atan2(across, a[k]);
  }
  double position = 0, rotation = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (parts & (kIkX << k)) position = std::hypot(position, p[k]);
    if (parts & (kIkRotX << k)) rotation += r[k] * r[k];
  }
  return {position, std::sqrt(rotation)};
}

/// The same of a whole pose.
std::array<double, 2> pose_errors(const Pose& reached, const Pose& target) {
  double square = 0;  // |R - S|^2 of two rotations is 8 sin^2 of half the angle between them
  for (std::size_t k = 0; k < 9; ++k)
    square += (reached.R[k] - target.R[k]) * (reached.R[k] - target.R[k]);
  return {spatial::distance(reached.p, target.p),
          2 * std::asin(std::min(1.0, std::sqrt(square / 8)))};
}

Error misses(const Bound<IkSolver>& ik, double position, double rotation) {
  return broken(ik.provider, "claimed a solution that misses the target by " +
                                 text::print_rounded(position, 3) + " m and " +
                                 text::print_rounded(rotation, 3) + " rad");
}

Result<void> check_limits(const Bound<IkSolver>& ik, std::span<const double> q) {
  const std::int32_t j = robotics::joint_outside_limits(*ik.model, q, kLimitSlack);
  if (j < 0) return {};
  return broken(ik.provider, "claimed a solution outside the limits of joint " +
                                 std::to_string(j + 1) + " (\"" +
                                 ik.model->joints[static_cast<std::size_t>(j)].name + "\")");
}

/// Refuses targets whose distance from the tool is beyond what numbers hold.
Result<void> check_targets(const IkBatch& batch) {
  constexpr double kFarthest = 1e300;
  for (const Pose& target : batch.targets)
    for (const double x : target.p)
      if (!(std::fabs(x) <= kFarthest))
        return error(ErrorCode::invalid_argument,
                     "a target has the coordinate " + text::print_rounded(x, 3) +
                         " m, too large to compute distances",
                     "Give coordinates within 1e300 m.");
  return {};
}

/// The size of a target's numbers, 1 at least.
double size_of(const Pose& target) {
  return std::max({1.0, std::fabs(target.p[0]), std::fabs(target.p[1]), std::fabs(target.p[2])});
}
/// What may be left of numbers of that size: the tolerance, or, where that is finer than numbers
/// are, what rounding leaves of a solution.
double allowed(double tolerance, double size) { return tolerance * 1.001 + 1e-13 * size; }

/// What the spacing of doubles leaves of a pose that joint values of this size give: a joint that
/// has turned 1e9 rad is known to 1e-7 rad.
struct Spacing {
  double position = 0;  ///< [m]
  double rotation = 0;  ///< [rad]
};
Spacing spacing_of(const RobotModel& model, std::span<const double> q) {
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  Spacing left;
  double reach = 1;
  for (const JointModel& j : model.joints) {
    reach += spatial::norm(j.placement.p);
    if (j.is_coupled() || coordinate_count(j.type) != 1) continue;
    const double size = std::fabs(q[static_cast<std::size_t>(j.q_index)]);
    (j.type == JointType::revolute ? left.rotation : left.position) += kEpsilon * size;
  }
  left.position += left.rotation * reach;
  return left;
}

/// Whether a configuration that claims to meet its targets does; where only the spacing of its own
/// large joint values keeps it from the tolerance, the result says so.
Result<void> check_miss(const Bound<IkSolver>& ik, const IkBatch& batch, double size,
                        std::span<const double> q, double position, double rotation, IkResult& r) {
  const double p = allowed(batch.tolerance.position, size);
  const double w = allowed(batch.tolerance.rotation, 1);
  if (position <= p && rotation <= w) return {};
  const Spacing left = spacing_of(*ik.model, q);
  if (!(position <= p + left.position) || !(rotation <= w + left.rotation))
    return misses(ik, position, rotation);
  r.detail = "its joint values are so large that rounding leaves an error of " +
             text::print_rounded(position, 2) + " m and " + text::print_rounded(rotation, 2) +
             " rad";
  return {};
}

/// Samples whose single configuration reaches one whole pose, checked many at once.
class PlainCheck {
 public:
  PlainCheck(const Bound<IkSolver>& ik, const IkBatch& batch)
      : ik_(ik),
        batch_(batch),
        size_(ik.model->coordinate_count()),
        applies_(batch.goals.empty() && ik.model->is_simple() && ik.model->loops.empty()) {
    if (!applies_) return;
    kinematics_ = robotics::BatchKinematics(*ik.model);
    scratch_.resize(kinematics_.scratch_size());
    q_.resize(kTogether * size_);
  }
  static constexpr std::size_t kTogether = 64;
  [[nodiscard]] bool covers(const IkResult& r) const {
    return applies_ && r.status == IkStatus::solved && r.q.size() == size_ && all_finite(r.q);
  }
  /// Of at most kTogether results that it covers.
  Result<void> operator()(std::span<const Pose> targets, std::span<IkResult> results) {
    for (std::size_t i = 0; i < results.size(); ++i)
      for (std::size_t j = 0; j < size_; ++j) q_[i * size_ + j] = results[i].q[j];
    const std::span<Pose> reached = std::span(poses_).first(results.size());
    kinematics_.tip_poses(static_cast<std::size_t>(batch_.tip),
                          std::span(q_).first(results.size() * size_), reached, scratch_);
    for (std::size_t i = 0; i < results.size(); ++i) {
      IkResult& r = results[i];
      const auto [position, rotation] = pose_errors(reached[i], targets[i]);
      r.position_error = position, r.rotation_error = rotation;
      RMP_TRY(check_miss(ik_, batch_, size_of(targets[i]), r.q, position, rotation, r));
      RMP_TRY(check_limits(ik_, r.q));
    }
    return {};
  }

 private:
  const Bound<IkSolver>& ik_;
  const IkBatch& batch_;
  std::size_t size_;
  bool applies_;
  robotics::BatchKinematics kinematics_;
  std::vector<double> scratch_, q_;
  std::array<Pose, kTogether> poses_;
};

/// Checks one sample's answer against its targets, one a goal.
Result<void> check_answer(const Bound<IkSolver>& ik, const IkBatch& batch,
                          std::span<const Pose> targets, std::vector<Pose>& frames, IkResult& r) {
  const RobotModel& model = *ik.model;
  const std::size_t n = model.coordinate_count();
  if (r.q.empty() || r.q.size() % n != 0) {
    if (r.q.empty() && r.status != IkStatus::solved) return {};
    return broken(ik.provider, "returned " + std::to_string(r.q.size()) +
                                   " joint values for a robot with " + std::to_string(n) +
                                   (model.is_simple() ? " joints" : " coordinates"));
  }
  if (!all_finite(r.q)) return broken(ik.provider, "returned a joint value that is not a number");
  const IkGoal whole{batch.tip, kIkPose, 1};
  const std::span<const IkGoal> goals = batch.goals.empty() ? std::span(&whole, 1) : batch.goals;
  std::vector<double> open(robotics::loop_rows(model));
  for (std::size_t k = 0; k < r.q.size() / n; ++k) {
    const std::span<const double> q(&r.q[k * n], n);
    robotics::forward_kinematics(model, q, frames);
    double position = 0, rotation = 0, size = 1;
    for (std::size_t g = 0; g < goals.size(); ++g) {
      size = std::max(size, size_of(targets[g]));
      const Pose reached =
          robotics::tip_pose(model, static_cast<std::size_t>(goals[g].tip), frames);
      const auto [p, w] = goal_errors(goals[g].parts, reached, targets[g]);
      position = std::max(position, p);
      rotation = std::max(rotation, w);
    }
    if (k == 0) {
      if (!std::isfinite(position) || !std::isfinite(rotation))
        return error(ErrorCode::invalid_argument,
                     "the remaining error is beyond the range of numbers",
                     "Give joint values, lengths and targets of ordinary size.");
      r.position_error = position;
      r.rotation_error = rotation;
    }
    if (r.status != IkStatus::solved) break;
    RMP_TRY(check_miss(ik, batch, size, q, position, rotation, r));
    RMP_TRY(check_limits(ik, q));
    robotics::loop_residual(model, frames, open);
    for (const double x : open)
      if (std::fabs(x) >
          allowed(std::max(batch.tolerance.position, batch.tolerance.rotation), size) +
              spacing_of(model, q).position)
        return broken(ik.provider, "claimed a solution with loops open by " +
                                       text::print_rounded(std::fabs(x), 3));
  }
  return {};
}

/// What a provider leaves out is not seen here but by its guard.
template <class Call>
Result<void> checked(const std::string& provider, const RobotModel& model, std::span<double> out,
                     Call&& call) {
  const std::string where = "robot " + text::quote(model.name);
  auto done = guarded(provider, [&]() -> Result<void> { return call(out); });
  if (!done.ok()) return in_robot(std::move(done).error(), where);
  if (spatial::first_beyond(out, std::numeric_limits<double>::max()) != out.size())
    return broken(provider, kNotANumber).in(where);
  return {};
}
template <class Dynamics, class Into>
Result<std::vector<double>> of_vector(const Dynamics& dynamics, const DynamicsBatch& batch,
                                      std::size_t size, Progress& progress, Into&& into) {
  std::vector<double> out(size, std::nan(""));
  RMP_TRY(into(dynamics, batch, std::span<double>(out), progress));
  return out;
}

}  // namespace

Result<Bound<IkSolver>> bind_ik(const Registry& registry, std::shared_ptr<const RobotModel> model,
                                const model::ProviderChoice& choice) {
  if (!choice.name.empty() || !choice.params.empty())
    return bind<IkSolver>(registry, std::move(model), choice);
  RMP_TRY_ASSIGN(const AutomaticIk automatic,
                 automatic_ik(registry, *model).in("robot " + text::quote(model->name)));
  return bind<IkSolver>(registry, std::move(model), {automatic.provider, {}});
}
model::ProviderChoice ik_with_tag(const Registry& registry, const model::ProviderChoice& own,
                                  std::string_view tag) {
  const auto has_tag = [&](const ProviderInfo& info) {
    return info.enabled && std::find(info.tags.begin(), info.tags.end(), tag) != info.tags.end();
  };
  // By its name: a robot that names none may be served by a closed form.
  const auto chosen = registry.find(IkSolver::kInterfaceId, own.name);
  if (chosen.ok() && has_tag(*chosen)) return {chosen->name, own.params};
  model::ProviderChoice other;
  const auto common = registry.find(IkSolver::kInterfaceId, "");
  if (common.ok() && has_tag(*common)) return {common->name, {}};
  for (const ProviderInfo& info : registry.list(IkSolver::kInterfaceId))
    if (has_tag(info)) {
      other.name = info.name;
      return other;
    }
  return own;
}
Result<Bound<InverseDynamics>> bind_inverse_dynamics(const Registry& registry,
                                                     std::shared_ptr<const RobotModel> model,
                                                     const model::ProviderChoice& choice) {
  RMP_TRY_ASSIGN(auto bound, bind_tree_dynamics(registry, std::move(model), choice));
  if (bound.model->loops.empty()) return bound;
  RMP_TRY_ASSIGN(bound.solver, close_dynamics(bound.model, std::move(bound.solver)));
  return bound;
}
Result<Bound<InverseDynamics>> bind_tree_dynamics(const Registry& registry,
                                                  std::shared_ptr<const RobotModel> model,
                                                  const model::ProviderChoice& choice) {
  return bind<InverseDynamics>(registry, std::move(model), choice);
}

namespace {

/// Its time grows with the number of joints, that of the program's default with its cube.
constexpr const char* kLinear = "articulated_body";

}  // namespace

bool is_long_chain(const Registry& registry, const RobotModel& model,
                   const model::ProviderChoice& choice) {
  const auto follows = [](const JointModel& j) { return j.is_coupled(); };
  return choice.name.empty() && choice.params.empty() && model.dof() >= kLongChain &&
         model.loops.empty() && std::none_of(model.joints.begin(), model.joints.end(), follows) &&
         !registry.chosen().contains(ForwardDynamics::kInterfaceId);
}

Result<Bound<ForwardDynamics>> bind_forward_dynamics(const Registry& registry,
                                                     std::shared_ptr<const RobotModel> model,
                                                     const model::ProviderChoice& choice) {
  if (is_long_chain(registry, *model, choice))
    if (auto linear = sim::bind<ForwardDynamics>(registry, model, {kLinear, {}}); linear.ok())
      return linear;
  auto bound = sim::bind<ForwardDynamics>(registry, model, choice);
  // The program's default is not made for very long chains; who has chosen gets what was chosen.
  if (bound.ok() || !choice.name.empty() || bound.error().code != ErrorCode::unsupported ||
      !model->loops.empty())
    return bound;
  auto linear = sim::bind<ForwardDynamics>(registry, std::move(model), {kLinear, {}});
  return linear.ok() ? std::move(linear) : std::move(bound);
}

Result<std::vector<IkResult>> solve_ik(const Bound<IkSolver>& ik, const IkBatch& batch,
                                       Progress& progress) {
  const std::string where = "robot " + text::quote(ik.model->name);
  RMP_TRY(check_targets(batch).in(where));
  std::vector<IkResult> results(batch.samples());
  auto done = guarded(ik.provider, [&] { return ik.solver->solve(batch, results, progress); });
  if (!done.ok()) return in_robot(std::move(done).error(), where);
  std::vector<Pose> frames(ik.model->joints.size());
  const std::size_t goals = std::max<std::size_t>(1, batch.goals.size());
  PlainCheck plain(ik, batch);
  for (std::size_t i = 0; i < results.size();) {
    std::size_t end = i;
    while (end < results.size() && end < i + PlainCheck::kTogether && plain.covers(results[end]))
      ++end;
    if (end > i) {
      const std::size_t count = end - i;
      RMP_TRY(
          plain(batch.targets.subspan(i, count), std::span(results).subspan(i, count)).in(where));
      i = end;
      continue;
    }
    RMP_TRY(check_answer(ik, batch, batch.targets.subspan(i * goals, goals), frames, results[i])
                .in(where));
    ++i;
  }
  return results;
}

Result<void> torques(const Bound<InverseDynamics>& dynamics, DynamicsBatch batch,
                     std::span<double> out, Progress& progress) {
  std::vector<double> scratch(dynamics.solver->scratch_size());
  batch.scratch = scratch;
  return checked(dynamics.provider, *dynamics.model, out, [&](std::span<double> tau) {
    return dynamics.solver->torques(batch, tau, progress);
  });
}

Result<void> inertia(const Bound<InverseDynamics>& dynamics, DynamicsBatch batch,
                     std::span<double> out, Progress& progress) {
  std::vector<double> scratch(dynamics.solver->scratch_size());
  batch.scratch = scratch;
  return checked(dynamics.provider, *dynamics.model, out,
                 [&](std::span<double> m) { return dynamics.solver->inertia(batch, m, progress); });
}

Result<void> accelerations(const Bound<ForwardDynamics>& dynamics, DynamicsBatch batch,
                           std::span<double> out, Progress& progress) {
  std::vector<double> scratch(dynamics.solver->scratch_size());
  batch.scratch = scratch;
  return checked(dynamics.provider, *dynamics.model, out, [&](std::span<double> qdd) {
    return dynamics.solver->accelerations(batch, qdd, progress);
  });
}

Result<std::vector<double>> torques(const Bound<InverseDynamics>& dynamics, DynamicsBatch batch,
                                    Progress& progress) {
  const std::size_t dof = dynamics.model->dof();
  return of_vector(dynamics, batch, batch.count * dof, progress,
                   [](auto&&... given) { return torques(given...); });
}

Result<std::vector<double>> inertia(const Bound<InverseDynamics>& dynamics, DynamicsBatch batch,
                                    Progress& progress) {
  const std::size_t dof = dynamics.model->dof();
  return of_vector(dynamics, batch, batch.count * dof * dof, progress,
                   [](auto&&... given) { return inertia(given...); });
}

Result<std::vector<double>> accelerations(const Bound<ForwardDynamics>& dynamics,
                                          DynamicsBatch batch, Progress& progress) {
  const std::size_t dof = dynamics.model->dof();
  return of_vector(dynamics, batch, batch.count * dof, progress,
                   [](auto&&... given) { return accelerations(given...); });
}

}  // namespace robomosp::sim
