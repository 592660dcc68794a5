// SPDX-License-Identifier: Apache-2.0
// Providers bound to a model, with everything they return checked before it is used.
#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "motion/path.h"
#include "robotics/kinematics.h"
#include "sim/simulate.h"
#include "spatial/rotation.h"
#include "spatial/vec.h"

namespace robomosp::sim {
namespace {

/// Adds the robot to an error whose provider has not named it.
Error in_robot(Error e, const std::string& robot) {
  if (e.where == robot || e.where.starts_with(robot + ", ")) return e;
  return std::move(e).in(robot);
}

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

Error broken(const std::string& provider, const std::string& what) {
  return error(ErrorCode::plugin_failed, "provider \"" + provider + "\" " + what,
               "Report it to the provider's author or choose another provider.");
}

bool all_finite(std::span<const double> v) {
  return std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
}

/// Limits are met up to this rounding slack [rad or m].
constexpr double kLimitSlack = 1e-9;

Result<void> check_answer(const Bound<IkSolver>& ik, const IkBatch& batch, const Pose& target,
                          std::vector<Pose>& frames, IkResult& r) {
  const RobotModel& model = *ik.model;
  const std::size_t dof = model.dof();
  if (r.q.empty() || r.q.size() % dof != 0) {
    if (r.q.empty() && r.status != IkStatus::solved) return {};
    return broken(ik.provider, "returned " + std::to_string(r.q.size()) +
                                   " joint values for a robot with " + std::to_string(dof) +
                                   " joints");
  }
  if (!all_finite(r.q)) return broken(ik.provider, "returned a joint value that is not a number");
  for (std::size_t k = 0; k < r.q.size() / dof; ++k) {
    const std::span<const double> q(&r.q[k * dof], dof);
    robotics::forward_kinematics(model, q, frames);
    const Pose reached = robotics::tip_pose(model, static_cast<std::size_t>(batch.tip), frames);
    const double position = spatial::distance(reached.p, target.p);
    const double rotation = spatial::norm(spatial::rotation_difference(reached.R, target.R));
    if (k == 0) {
      r.position_error = position;
      r.rotation_error = rotation;
    }
    if (r.status != IkStatus::solved) break;
    if (position > batch.tolerance.position * 1.001 || rotation > batch.tolerance.rotation * 1.001)
      return broken(ik.provider, "claimed a solution that misses the target by " +
                                     text::print_rounded(position, 3) + " m and " +
                                     text::print_rounded(rotation, 3) + " rad");
    for (std::size_t j = 0; j < dof; ++j)
      if (q[j] < model.joints[j].lower - kLimitSlack || q[j] > model.joints[j].upper + kLimitSlack)
        return broken(ik.provider, "claimed a solution outside the limits of joint " +
                                       std::to_string(j + 1) + " (\"" + model.joints[j].name +
                                       "\")");
  }
  return {};
}

template <class Call>
Result<std::vector<double>> checked_numbers(const std::string& provider, const RobotModel& model,
                                            std::size_t size, Call&& call) {
  std::vector<double> out(size, std::nan(""));
  auto done = guarded(provider, [&]() -> Result<void> { return call(std::span<double>(out)); });
  if (!done.ok()) return in_robot(std::move(done).error(), "robot " + text::quote(model.name));
  if (!all_finite(out))
    return broken(provider, "returned a value that is not a number")
        .in("robot " + text::quote(model.name));
  return out;
}

}  // namespace

Result<Bound<IkSolver>> bind_ik(const Registry& registry, std::shared_ptr<const RobotModel> model,
                                const model::ProviderChoice& choice) {
  return bind<IkSolver>(registry, std::move(model), choice);
}
Result<Bound<InverseDynamics>> bind_inverse_dynamics(const Registry& registry,
                                                     std::shared_ptr<const RobotModel> model,
                                                     const model::ProviderChoice& choice) {
  return bind<InverseDynamics>(registry, std::move(model), choice);
}
Result<Bound<ForwardDynamics>> bind_forward_dynamics(const Registry& registry,
                                                     std::shared_ptr<const RobotModel> model,
                                                     const model::ProviderChoice& choice) {
  return bind<ForwardDynamics>(registry, std::move(model), choice);
}

Result<std::vector<IkResult>> solve_ik(const Bound<IkSolver>& ik, const IkBatch& batch,
                                       Progress& progress) {
  const std::string where = "robot " + text::quote(ik.model->name);
  std::vector<IkResult> results(batch.targets.size());
  auto done = guarded(ik.provider, [&] { return ik.solver->solve(batch, results, progress); });
  if (!done.ok()) return in_robot(std::move(done).error(), where);
  std::vector<Pose> frames(ik.model->joints.size());
  for (std::size_t i = 0; i < results.size(); ++i)
    RMP_TRY(check_answer(ik, batch, batch.targets[i], frames, results[i]).in(where));
  return results;
}

Result<std::vector<double>> torques(const Bound<InverseDynamics>& dynamics, DynamicsBatch batch,
                                    Progress& progress) {
  std::vector<double> scratch(dynamics.solver->scratch_size());
  batch.scratch = scratch;
  return checked_numbers(
      dynamics.provider, *dynamics.model, batch.count * dynamics.model->dof(),
      [&](std::span<double> out) { return dynamics.solver->torques(batch, out, progress); });
}

Result<std::vector<double>> inertia(const Bound<InverseDynamics>& dynamics, DynamicsBatch batch,
                                    Progress& progress) {
  std::vector<double> scratch(dynamics.solver->scratch_size());
  batch.scratch = scratch;
  const std::size_t dof = dynamics.model->dof();
  return checked_numbers(
      dynamics.provider, *dynamics.model, batch.count * dof * dof,
      [&](std::span<double> out) { return dynamics.solver->inertia(batch, out, progress); });
}

Result<std::vector<double>> accelerations(const Bound<ForwardDynamics>& dynamics,
                                          DynamicsBatch batch, Progress& progress) {
  std::vector<double> scratch(dynamics.solver->scratch_size());
  batch.scratch = scratch;
  return checked_numbers(
      dynamics.provider, *dynamics.model, batch.count * dynamics.model->dof(),
      [&](std::span<double> out) { return dynamics.solver->accelerations(batch, out, progress); });
}

}  // namespace robomosp::sim
