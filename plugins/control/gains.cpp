// SPDX-License-Identifier: Apache-2.0
#include "gains.h"

#include <algorithm>
#include <cmath>

#include "spatial/pose.h"
#include "spatial/rest.h"
#include "spatial/rotation.h"

namespace robomosp::control {
namespace {

std::size_t at(std::int32_t index) { return static_cast<std::size_t>(index); }

/// Rotation vector, in the axes of the first, from one quaternion to another.
Vec3 turn_between(const double* from, const double* to) {
  Pose a, b;
  a.R = spatial::quaternion_rotation(from);
  b.R = spatial::quaternion_rotation(to);
  return spatial::rotation_log(spatial::compose(spatial::inverse(a), b).R);
}

}  // namespace

Result<Plant> make_plant(const RobotModel& model, const InverseDynamics& dynamics) {
  if (model.dof() == 0)
    return error(ErrorCode::invalid_argument, "it has no joints to control",
                 "Give it at least one joint.", "robot \"" + model.name + "\"");
  Plant plant{&model, &dynamics, std::vector<bool>(model.dof(), true)};
  for (const JointModel& joint : model.joints)
    if (joint.passive && !joint.is_coupled())
      for (std::int32_t k = 0; k < velocity_count(joint.type); ++k)
        plant.has_motor[at(joint.v_index + k)] = false;
  return plant;
}

Result<std::vector<double>> gains_of(const Plant& plant, const Params& params,
                                     std::string_view name, std::span<const double> otherwise) {
  const auto given = params.reals(name);
  if (given.empty()) return std::vector<double>(otherwise.begin(), otherwise.end());
  for (const double g : given)
    if (!(g >= 0) || !std::isfinite(g))
      return error(ErrorCode::invalid_argument, "a gain is negative or not finite",
                   "Give gains of at least 0.", std::string(name));
  if (given.size() == 1) return std::vector<double>(plant.dof(), given[0]);
  if (given.size() != plant.dof())
    return error(ErrorCode::invalid_argument,
                 std::to_string(given.size()) + " gains are given for " +
                     std::to_string(plant.dof()) + " joint velocities",
                 "Give one for each, or one for all.", std::string(name));
  return std::vector<double>(given.begin(), given.end());
}

Result<std::vector<double>> own_inertia(const Plant& plant) {
  const std::size_t n = plant.dof();
  std::vector<double> q(plant.model->coordinate_count()), m(n * n),
      scratch(plant.dynamics->scratch_size()), diagonal(n);
  for (const JointModel& joint : plant.model->joints)
    if (const std::int32_t count = coordinate_count(joint.type); count > 1)
      q[at(joint.q_index + count - 4)] = 1;
  DynamicsBatch batch;
  batch.count = 1, batch.q = q, batch.scratch = scratch;
  NoProgress none;
  RMP_TRY(plant.dynamics->inertia(batch, m, none));
  for (std::size_t i = 0; i < n; ++i) diagonal[i] = m[i * n + i];
  return diagonal;
}

Result<void> check_input(const Plant& plant, const ControlInput& in, std::size_t state,
                         std::size_t needs_state, std::size_t scratch, std::size_t needs_scratch,
                         std::size_t tau) {
  const std::size_t n = plant.dof(), c = plant.model->coordinate_count();
  const auto wrong = [](const char* what, std::size_t is, std::size_t should) {
    return error(ErrorCode::invalid_argument,
                 std::string(what) + " has " + std::to_string(is) + " numbers instead of " +
                     std::to_string(should),
                 "Give one for each coordinate or velocity.");
  };
  if (in.q.size() != c) return wrong("q", in.q.size(), c);
  if (in.qd.size() != n) return wrong("qd", in.qd.size(), n);
  if (in.q_desired.size() != c) return wrong("q_desired", in.q_desired.size(), c);
  if (in.qd_desired.size() != n) return wrong("qd_desired", in.qd_desired.size(), n);
  if (in.qdd_desired.size() != n) return wrong("qdd_desired", in.qdd_desired.size(), n);
  if (tau != n) return wrong("tau", tau, n);
  if (state < needs_state) return wrong("the state", state, needs_state);
  if (scratch < needs_scratch) return wrong("the scratch", scratch, needs_scratch);
  return {};
}

void configuration_error(const RobotModel& model, std::span<const double> q,
                         std::span<const double> q_desired, std::span<double> e) {
  for (const JointModel& joint : model.joints) {
    if (joint.is_coupled()) continue;
    const double *is = &q[at(joint.q_index)], *want = &q_desired[at(joint.q_index)];
    double* out = &e[at(joint.v_index)];
    if (coordinate_count(joint.type) == 1) {
      out[0] = want[0] - is[0];
      continue;
    }
    if (joint.type == JointType::free) {
      Pose turned;
      turned.R = spatial::quaternion_rotation(is + 3);
      const Vec3 way =
          spatial::rotate_back(turned, Vec3{want[0] - is[0], want[1] - is[1], want[2] - is[2]});
      std::copy(way.begin(), way.end(), out);
      out += 3, is += 3, want += 3;
    }
    const Vec3 turn = turn_between(is, want);
    std::copy(turn.begin(), turn.end(), out);
  }
}

void add_friction(const RobotModel& model, const ControlInput& in, std::span<double> tau) {
  for (const JointModel& joint : model.joints) {
    if (coordinate_count(joint.type) != 1) continue;
    const double ratio = joint.is_coupled() ? joint.coupling.ratio : 1;
    const double qd = ratio * in.qd[at(joint.v_index)],
                 wanted = ratio * in.qd_desired[at(joint.v_index)];
    const double coulomb = wanted > spatial::kRestSpeed    ? joint.friction.coulomb_positive
                           : wanted < -spatial::kRestSpeed ? joint.friction.coulomb_negative
                                                           : 0;
    tau[at(joint.v_index)] += ratio * (joint.friction.viscous * qd + coulomb);
  }
}

void clear_passive(const Plant& plant, std::span<double> tau) {
  for (std::size_t i = 0; i < tau.size(); ++i)
    if (!plant.has_motor[i]) tau[i] = 0;
}

}  // namespace robomosp::control
