// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>

#include "controllers.h"
#include "spatial/loops.h"
#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "spatial/semidefinite.h"
#include "tip_motion.h"

namespace robomosp::control {
namespace {

/// Damping begins where a pivot of the tip's mobility, scaled to a unit diagonal, falls below
/// kNear, and grows to kDamping where it vanishes, so that directions in which the tip hardly moves
/// ask for bounded forces (after Nakamura, Hanafusa, J. Dyn. Sys. Meas. Control 108, 1986).
constexpr double kNear = 1e-4, kDamping = 1e-4;

/// Cholesky factor of a symmetric positive matrix in its lower triangle. Returns the least pivot
/// (before its root); not above 0 = it is not positive, and unfinished.
double factor(std::span<double> m, std::size_t n) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t k = 0; k < j; ++k)
      for (std::size_t i = j; i < n; ++i) m[i * n + j] -= m[i * n + k] * m[j * n + k];
    least = std::min(least, m[j * n + j]);
    if (!(least > 0)) return 0;
    const double root = std::sqrt(m[j * n + j]);
    for (std::size_t i = j; i < n; ++i) m[i * n + j] /= root;
  }
  return least;
}

/// Directions of loops weaker than this part are implied by others. A tip with less than this part
/// of the greatest mobility (of the tree, and of position or rotation alike) does not move that
/// way.
constexpr double kLostDirection = 1e-10;

/// Doubles that the loops of a mechanism take, `rows` of the tip beside them.
std::size_t loop_scratch(const spatial::BodyTree& tree, std::size_t c, std::size_t rows) {
  if (c == 0) return 0;
  return spatial::tree_scratch(tree) + 2 * c * tree.velocities + 3 * c * c + (rows + 1) * c + 8 * c;
}

double dot(const double* a, const double* b, std::size_t n) {
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

Result<void> OperationalSpace::prepare(const RobotModel& model, const InverseDynamics& dynamics,
                                       const Params& params) {
  RMP_TRY_ASSIGN(plant_, make_plant(model, dynamics));
  loop_rows_ = 0;
  if (!model.loops.empty()) {
    RMP_TRY_ASSIGN(tree_, spatial::make_body_tree(model));
    loop_rows_ = spatial::loop_rows(tree_.loops);
  }
  if (model.tips.empty() || model.tips.front().joint < 0)
    return error(ErrorCode::invalid_argument, "its first tip does not move",
                 "Put the tool on a link that a joint moves.", "robot \"" + model.name + "\"");
  const double w = params.real("frequency"), z = params.real("damping"),
               posture = params.real("posture_frequency");
  kp_ = w * w;
  kd_ = 2 * z * w;
  posture_kp_ = posture * posture;
  posture_kd_ = 2 * z * posture;
  rows_ = params.text("task") == "position" ? 3 : 6;
  overcomes_friction_ = params.boolean("friction");
  return {};
}

std::size_t OperationalSpace::scratch_size() const {
  const std::size_t n = plant_.dof();
  // Two Jacobians, M^-1 J^T, M, three joint vectors, the tip's motion; then either the loops' or
  // the dynamics' own.
  return 18 * n + n * n + 3 * n + tip_motion_scratch(*plant_.model) +
         std::max(loop_scratch(tree_, loop_rows_, rows_), plant_.dynamics->scratch_size());
}

void OperationalSpace::hold_loops(const ControlInput& in, std::span<const double> factored,
                                  std::span<double> mobility, std::span<double> held,
                                  std::span<double> scratch) const {
  const std::size_t n = plant_.dof(), c = loop_rows_, sides = rows_ + 1;
  const spatial::TreeScratch s = spatial::take_scratch(tree_, scratch.data());
  double* at = s.rest;
  const auto take = [&at](std::size_t size) {
    const std::span<double> part(at, size);
    at += size;
    return part;
  };
  const auto jacobian = take(c * n), response = take(c * n), a = take(c * c),
             lambda = take(sides * c), bias = take(c), rate = take(c), gap = take(c),
             rest = take(2 * c * c + 5 * c);
  spatial::TreeState state;
  state.q = in.q.data(), state.qd = in.qd.data();
  spatial::sweep(tree_, state, s.bodies, s.columns);
  spatial::loop_constraints(tree_, s.bodies, s.columns, state, {jacobian, bias, rate, gap});
  std::copy(jacobian.begin(), jacobian.end(), response.begin());
  for (std::size_t i = 0; i < c; ++i) spatial::cholesky_solve(factored, n, &response[i * n]);
  for (std::size_t i = 0; i < c; ++i) {
    for (std::size_t k = 0; k <= i; ++k)
      a[i * c + k] = a[k * c + i] = dot(&jacobian[i * n], &response[k * n], n);
    for (std::size_t r = 0; r < rows_; ++r)
      lambda[r * c + i] = dot(&jacobian[i * n], &mobility[r * n], n);
    lambda[rows_ * c + i] = bias[i];
  }
  spatial::solve_semidefinite(a, c, kLostDirection, lambda, rest.data());
  std::fill(held.begin(), held.end(), 0.0);
  for (std::size_t r = 0; r < sides; ++r) {
    double* row = r < rows_ ? &mobility[r * n] : held.data();
    for (std::size_t i = 0; i < c; ++i)
      for (std::size_t k = 0; k < n; ++k) row[k] -= lambda[r * c + i] * response[i * n + k];
  }
}

Result<void> OperationalSpace::torques(const ControlInput& in, std::span<double> state,
                                       std::span<double> scratch, std::span<double> tau) const {
  RMP_TRY(check_input(plant_, in, state.size(), 0, scratch.size(), scratch_size(), tau.size()));
  const RobotModel& model = *plant_.model;
  const std::size_t n = plant_.dof(), rows = rows_;
  const auto take = [&scratch](std::size_t count) {
    const auto out = scratch.first(count);
    scratch = scratch.subspan(count);
    return out;
  };
  const auto jacobian = take(6 * n), wanted_jacobian = take(6 * n), mobility = take(6 * n),
             m = take(n * n), posture = take(n), solved = take(n), held = take(n),
             tip_scratch = take(tip_motion_scratch(model));
  const TipMotion is = tip_motion(model, in.q, in.qd, jacobian, tip_scratch);

  // The reference of the tip; of a reference in joint space, its own.
  Pose pose;
  std::array<double, 6> velocity = in.tip_velocity_desired,
                        acceleration = in.tip_acceleration_desired;
  if (in.tip_desired) {
    pose = *in.tip_desired;
  } else {
    const TipMotion want =
        tip_motion(model, in.q_desired, in.qd_desired, wanted_jacobian, tip_scratch);
    pose = want.pose;
    velocity = want.velocity;
    acceleration = want.bias;
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t k = 0; k < 6; ++k)
        acceleration[k] += wanted_jacobian[6 * j + k] * in.qdd_desired[j];
  }
  const Vec3 way = spatial::sub(pose.p, is.pose.p),
             turn = spatial::rotation_difference(is.pose.R, pose.R);
  std::array<double, 6> force{};  // first the acceleration that the joints have to add
  for (std::size_t k = 0; k < rows; ++k)
    force[k] = acceleration[k] - is.bias[k] + kd_ * (velocity[k] - is.velocity[k]) +
               kp_ * (k < 3 ? way[k] : turn[k - 3]);

  DynamicsBatch batch;
  batch.count = 1, batch.q = in.q, batch.scratch = scratch;
  NoProgress none;
  RMP_TRY(plant_.dynamics->inertia(batch, m, none));
  // The posture's torques: M times an acceleration towards q_desired.
  configuration_error(model, in.q, in.q_desired, solved);
  for (std::size_t j = 0; j < n; ++j)
    solved[j] =
        in.qdd_desired[j] + posture_kd_ * (in.qd_desired[j] - in.qd[j]) + posture_kp_ * solved[j];
  for (std::size_t i = 0; i < n; ++i) posture[i] = dot(&m[i * n], solved.data(), n);
  if (!(factor(m, n) > 0))
    return error(ErrorCode::invalid_argument, "its inertia matrix is not positive",
                 "Give every moving body a mass.", "robot \"" + model.name + "\"");
  // Row k of `mobility` is M^-1 times the k-th row of J.
  std::array<double, 36> inverse{};
  for (std::size_t k = 0; k < rows; ++k) {
    double* row = &mobility[k * n];
    for (std::size_t j = 0; j < n; ++j) row[j] = jacobian[6 * j + k];
    spatial::cholesky_solve(m, n, row);
  }
  const auto along = [&](std::size_t r, const double* rates) {
    double sum = 0;
    for (std::size_t j = 0; j < n; ++j) sum += jacobian[6 * j + r] * rates[j];
    return sum;
  };
  std::array<double, 2> least{};  // mobility that counts as none, of position and of rotation
  for (std::size_t k = 0; k < rows; ++k)
    least[k / 3] = std::max(least[k / 3], kLostDirection * along(k, &mobility[k * n]));
  if (loop_rows_ > 0) {
    hold_loops(in, m, mobility, held, scratch);
    for (std::size_t k = 0; k < rows; ++k) force[k] -= along(k, held.data());
  }
  std::array<double, 6> scale{};
  for (std::size_t k = 0; k < rows; ++k) {
    const double sum = along(k, &mobility[k * n]);
    scale[k] = sum > least[k / 3] ? 1 / std::sqrt(sum) : 0;  // 0: the tip never moves that way
  }
  std::array<double, 36> unit{};
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < rows; ++c) {
      const double sum = along(r, &mobility[c * n]);
      unit[r * rows + c] = r == c ? (scale[r] > 0 ? 1 : 0) : sum * scale[r] * scale[c];
    }
  inverse = unit;
  const std::span<double> l(inverse.data(), rows * rows);
  const double pivot = factor(l, rows);
  if (pivot < kNear) {
    const double missing = 1 - std::max(pivot, 0.0) / kNear;
    inverse = unit;
    for (std::size_t r = 0; r < rows; ++r) inverse[r * rows + r] += kDamping * missing * missing;
    if (!(factor(l, rows) > 0))
      return error(ErrorCode::invalid_argument, "its tip cannot move", "Check its joints.",
                   "robot \"" + model.name + "\"");
  }
  // F = L (a - Jbar^T tau_0 in accelerations): J^T F + tau_0 moves the tip by `force` exactly.
  // Near a singular configuration the inertia is damped in the scaled directions.
  for (std::size_t k = 0; k < rows; ++k)
    force[k] = scale[k] * (force[k] - dot(&mobility[k * n], posture.data(), n));
  spatial::cholesky_solve(l, rows, force.data());
  for (std::size_t k = 0; k < rows; ++k) force[k] *= scale[k];

  batch.qd = in.qd;
  batch.terms = kGravityTerm | kVelocityTerm | kSpringTerm;
  RMP_TRY(plant_.dynamics->torques(batch, tau, none));
  for (std::size_t j = 0; j < n; ++j)
    tau[j] += posture[j] + dot(&jacobian[6 * j], force.data(), rows);
  if (overcomes_friction_) add_friction(model, in, tau);
  clear_passive(plant_, tau);
  return {};
}

}  // namespace robomosp::control
