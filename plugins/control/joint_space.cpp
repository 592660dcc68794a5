// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "controllers.h"

namespace robomosp::control {
namespace {

/// Gains from how fast an error should vanish: kp = m w^2, kd = 2 z m w.
struct Poles {
  double frequency = 0, damping = 0;
};
Poles poles_of(const Params& params) { return {params.real("frequency"), params.real("damping")}; }

std::vector<double> scaled(std::span<const double> m, double by) {
  std::vector<double> out(m.begin(), m.end());
  for (double& v : out) v *= by;
  return out;
}

}  // namespace

Result<void> ComputedTorque::prepare(const RobotModel& model, const InverseDynamics& dynamics,
                                     const Params& params) {
  RMP_TRY_ASSIGN(plant_, make_plant(model, dynamics));
  const auto [w, z] = poles_of(params);
  const std::vector<double> one(plant_.dof(), 1.0);
  RMP_TRY_ASSIGN(kp_, gains_of(plant_, params, "kp", scaled(one, w * w)));
  RMP_TRY_ASSIGN(kd_, gains_of(plant_, params, "kd", scaled(one, 2 * z * w)));
  overcomes_friction_ = params.boolean("friction");
  return {};
}
std::size_t ComputedTorque::scratch_size() const {
  return 2 * plant_.dof() + plant_.dynamics->scratch_size();
}
Result<void> ComputedTorque::torques(const ControlInput& in, std::span<double> state,
                                     std::span<double> scratch, std::span<double> tau) const {
  RMP_TRY(check_input(plant_, in, state.size(), 0, scratch.size(), scratch_size(), tau.size()));
  const std::size_t n = plant_.dof();
  const auto e = scratch.first(n), wanted = scratch.subspan(n, n);
  configuration_error(*plant_.model, in.q, in.q_desired, e);
  for (std::size_t i = 0; i < n; ++i)
    wanted[i] = in.qdd_desired[i] + kd_[i] * (in.qd_desired[i] - in.qd[i]) + kp_[i] * e[i];
  DynamicsBatch batch;
  batch.count = 1, batch.q = in.q, batch.qd = in.qd, batch.qdd = wanted;
  batch.terms = kGravityTerm | kInertialTerm | kVelocityTerm | kSpringTerm;
  batch.scratch = scratch.subspan(2 * n);
  NoProgress none;
  RMP_TRY(plant_.dynamics->torques(batch, tau, none));
  if (overcomes_friction_) add_friction(*plant_.model, in, tau);
  clear_passive(plant_, tau);
  return {};
}

Result<void> PdGravity::prepare(const RobotModel& model, const InverseDynamics& dynamics,
                                const Params& params) {
  RMP_TRY_ASSIGN(plant_, make_plant(model, dynamics));
  const auto [w, z] = poles_of(params);
  RMP_TRY_ASSIGN(const auto m, own_inertia(plant_));
  RMP_TRY_ASSIGN(kp_, gains_of(plant_, params, "kp", scaled(m, w * w)));
  RMP_TRY_ASSIGN(kd_, gains_of(plant_, params, "kd", scaled(m, 2 * z * w)));
  return {};
}
std::size_t PdGravity::scratch_size() const {
  return plant_.dof() + plant_.dynamics->scratch_size();
}
Result<void> PdGravity::torques(const ControlInput& in, std::span<double> state,
                                std::span<double> scratch, std::span<double> tau) const {
  RMP_TRY(check_input(plant_, in, state.size(), 0, scratch.size(), scratch_size(), tau.size()));
  const std::size_t n = plant_.dof();
  const auto e = scratch.first(n);
  configuration_error(*plant_.model, in.q, in.q_desired, e);
  DynamicsBatch batch;
  batch.count = 1, batch.q = in.q;
  batch.terms = kGravityTerm | kSpringTerm;
  batch.scratch = scratch.subspan(n);
  NoProgress none;
  RMP_TRY(plant_.dynamics->torques(batch, tau, none));
  for (std::size_t i = 0; i < n; ++i)
    tau[i] += kp_[i] * e[i] + kd_[i] * (in.qd_desired[i] - in.qd[i]);
  clear_passive(plant_, tau);
  return {};
}

Result<void> JointPid::prepare(const RobotModel& model, const InverseDynamics& dynamics,
                               const Params& params) {
  RMP_TRY_ASSIGN(plant_, make_plant(model, dynamics));
  const auto [w, z] = poles_of(params);
  RMP_TRY_ASSIGN(const auto m, own_inertia(plant_));
  RMP_TRY_ASSIGN(kp_, gains_of(plant_, params, "kp", scaled(m, w * w)));
  RMP_TRY_ASSIGN(kd_, gains_of(plant_, params, "kd", scaled(m, 2 * z * w)));
  // A third pole well below the other two.
  RMP_TRY_ASSIGN(ki_, gains_of(plant_, params, "ki", scaled(m, w * w * w / 10)));
  limit_.assign(plant_.dof(), std::numeric_limits<double>::infinity());
  for (const JointModel& joint : model.joints)
    if (!joint.is_coupled() && coordinate_count(joint.type) == 1)
      limit_[static_cast<std::size_t>(joint.v_index)] = joint.max_force;
  return {};
}
Result<void> JointPid::torques(const ControlInput& in, std::span<double> state,
                               std::span<double> scratch, std::span<double> tau) const {
  const std::size_t n = plant_.dof();
  RMP_TRY(check_input(plant_, in, state.size(), n, scratch.size(), n, tau.size()));
  const auto e = scratch.first(n);
  configuration_error(*plant_.model, in.q, in.q_desired, e);
  for (std::size_t i = 0; i < n; ++i) {
    const double direct = kp_[i] * e[i] + kd_[i] * (in.qd_desired[i] - in.qd[i]);
    const double grown = state[i] + ki_[i] * e[i] * in.dt;
    const bool winds_up = std::fabs(direct + grown) > limit_[i] && (direct + grown) * e[i] > 0;
    if (!winds_up) state[i] = grown;
    tau[i] = direct + state[i];
  }
  clear_passive(plant_, tau);
  return {};
}

}  // namespace robomosp::control
