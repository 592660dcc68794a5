// SPDX-License-Identifier: Apache-2.0
#include "sim/dynamics.h"

#include <algorithm>
#include <cmath>

#include "kernel/text.h"
#include "robotics/closure.h"
#include "sim/closed_dynamics.h"
#include "sim/provider_answer.h"

namespace robomosp::sim {
namespace {

std::string robot_of(const RobotModel& model) { return "robot " + text::quote(model.name); }
Error not_a_number(const std::string& provider, const RobotModel& model) {
  return broken(provider, kNotANumber).in(robot_of(model));
}
template <class Call>
Result<void> called(const std::string& provider, const RobotModel& model, Call&& call) {
  auto done = guarded(provider, [&]() -> Result<void> { return call(); });
  if (!done.ok()) return in_robot(std::move(done).error(), robot_of(model));
  return {};
}

/// Changes of joints and rates for central differences [rad or m, and per second]: what rounding
/// (1e-16 / h) and the fourth order (h^4) leave are alike.
constexpr double kDifferenceStep = 1e-3;

enum class By { q, qd, tau };

/// Central differences of order four of `evaluate(batch) -> count * dof numbers`.
template <class Evaluate>
Result<std::vector<double>> differences(const RobotModel& model, const DynamicsBatch& batch, By by,
                                        Evaluate&& evaluate) {
  const std::size_t n = model.dof(), width = model.coordinate_count();
  std::vector<double> out(batch.count * n * n), step(n);
  const auto given = [&](std::span<const double> v) {
    return v.empty() ? std::vector<double>(batch.count * n)
                     : std::vector<double>(v.begin(), v.end());
  };
  for (std::size_t k = 0; k < n; ++k)
    for (const auto& [at, weight] :
         {std::pair(1.0, 8.0), std::pair(-1.0, -8.0), std::pair(2.0, -1.0), std::pair(-2.0, 1.0)}) {
      DynamicsBatch moved = batch;
      std::vector<double> changed;
      if (by == By::q) {
        changed.assign(batch.q.begin(), batch.q.end());
        step.assign(n, 0.0);
        step[k] = at * kDifferenceStep;
        for (std::size_t i = 0; i < batch.count; ++i)
          robotics::move_configuration(model, step, std::span(changed).subspan(i * width, width));
        moved.q = changed;
      } else {
        changed = given(by == By::qd ? batch.qd : batch.tau);
        for (std::size_t i = 0; i < batch.count; ++i) changed[i * n + k] += at * kDifferenceStep;
        (by == By::qd ? moved.qd : moved.tau) = changed;
      }
      RMP_TRY_ASSIGN(const std::vector<double> value, evaluate(moved));
      for (std::size_t i = 0; i < batch.count; ++i)
        for (std::size_t r = 0; r < n; ++r)
          out[(i * n + r) * n + k] += weight * value[i * n + r] / (12 * kDifferenceStep);
    }
  return out;
}

}  // namespace

model::ProviderChoice forward_choice(const RobotModel& model, model::ProviderChoice own) {
  if (own.name.empty() && !model.loops.empty()) own.name = "constrained";
  return own;
}

Result<std::vector<Energy>> energies(const Bound<InverseDynamics>& dynamics, DynamicsBatch batch,
                                     Progress& progress) {
  std::vector<double> scratch(dynamics.solver->scratch_size());
  std::vector<Energy> out(batch.count);
  batch.scratch = scratch;
  RMP_TRY(called(dynamics.provider, *dynamics.model,
                 [&] { return dynamics.solver->energy(batch, out, progress); }));
  for (const Energy& e : out)
    if (!std::isfinite(e.kinetic) || !std::isfinite(e.potential) || !all_finite(e.momentum) ||
        !all_finite(e.angular_momentum) || !all_finite(e.com))
      return not_a_number(dynamics.provider, *dynamics.model);
  return out;
}

Result<std::vector<double>> regressor(const Bound<InverseDynamics>& dynamics, DynamicsBatch batch,
                                      Progress& progress) {
  std::vector<double> scratch(dynamics.solver->scratch_size());
  const RobotModel& m = *dynamics.model;
  std::vector<double> out(batch.count * m.dof() * 10 * m.joints.size(), std::nan(""));
  batch.scratch = scratch;
  RMP_TRY(called(dynamics.provider, m,
                 [&] { return dynamics.solver->regressor(batch, out, progress); }));
  if (!all_finite(out)) return not_a_number(dynamics.provider, m);
  return out;
}

Result<DynamicsDerivatives> derivatives(const Bound<InverseDynamics>& dynamics,
                                        const DynamicsBatch& given, Progress& progress) {
  const RobotModel& m = *dynamics.model;
  // Changes of single joints would open the loops.
  if (is_closed(*dynamics.solver))
    return error(ErrorCode::unsupported,
                 "derivatives of torques with closed loops are not computed",
                 "Use differences of robot.inverse_dynamics with close = true, or derivatives of "
                 "the accelerations; tree = true returns those of the open tree.",
                 robot_of(m));
  std::vector<double> scratch(dynamics.solver->scratch_size());
  DynamicsBatch batch = given;
  batch.scratch = scratch;
  DynamicsDerivatives d;
  d.by_q.assign(batch.count * m.dof() * m.dof(), std::nan(""));
  d.by_qd = d.by_q;
  auto done = called(dynamics.provider, m, [&] {
    return dynamics.solver->derivatives(batch, d.by_q, d.by_qd, progress);
  });
  if (done.ok()) {
    if (!all_finite(d.by_q) || !all_finite(d.by_qd)) return not_a_number(dynamics.provider, m);
    return d;
  }
  if (done.error().code != ErrorCode::unsupported) return std::move(done).error();
  d.numerical = true;
  const auto evaluate = [&](const DynamicsBatch& b) { return torques(dynamics, b, progress); };
  RMP_TRY_ASSIGN(d.by_q, differences(m, given, By::q, evaluate));
  RMP_TRY_ASSIGN(d.by_qd, differences(m, given, By::qd, evaluate));
  return d;
}

Result<DynamicsDerivatives> derivatives(const Bound<ForwardDynamics>& dynamics,
                                        const DynamicsBatch& given, Progress& progress) {
  const RobotModel& m = *dynamics.model;
  std::vector<double> scratch(dynamics.solver->scratch_size());
  DynamicsBatch batch = given;
  batch.scratch = scratch;
  DynamicsDerivatives d;
  d.by_q.assign(batch.count * m.dof() * m.dof(), std::nan(""));
  d.by_qd = d.by_tau = d.by_q;
  auto done = called(dynamics.provider, m, [&] {
    return dynamics.solver->derivatives(batch, d.by_q, d.by_qd, d.by_tau, progress);
  });
  if (done.ok()) {
    if (!all_finite(d.by_q) || !all_finite(d.by_qd) || !all_finite(d.by_tau))
      return not_a_number(dynamics.provider, m);
    return d;
  }
  if (done.error().code != ErrorCode::unsupported) return std::move(done).error();
  d.numerical = true;
  const auto evaluate = [&](const DynamicsBatch& b) {
    return accelerations(dynamics, b, progress);
  };
  RMP_TRY_ASSIGN(d.by_q, differences(m, given, By::q, evaluate));
  RMP_TRY_ASSIGN(d.by_qd, differences(m, given, By::qd, evaluate));
  RMP_TRY_ASSIGN(d.by_tau, differences(m, given, By::tau, evaluate));
  return d;
}

Result<ConstrainedMotion> constrained(const Bound<ForwardDynamics>& dynamics, DynamicsBatch batch,
                                      Progress& progress) {
  const RobotModel& m = *dynamics.model;
  std::vector<double> scratch(dynamics.solver->scratch_size());
  batch.scratch = scratch;
  ConstrainedMotion out;
  out.qdd.assign(batch.count * m.dof(), std::nan(""));
  out.forces.assign(batch.count * robotics::loop_rows(m), std::nan(""));
  RMP_TRY(called(dynamics.provider, m, [&] {
    return dynamics.solver->constrained(batch, out.qdd, out.forces, progress);
  }));
  if (!all_finite(out.qdd) || !all_finite(out.forces)) return not_a_number(dynamics.provider, m);
  return out;
}

}  // namespace robomosp::sim
