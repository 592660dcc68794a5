// SPDX-License-Identifier: Apache-2.0
#include "constrained.h"

#include <algorithm>
#include <string>

#include "samples.h"
#include "spatial/loops.h"
#include "spatial/semidefinite.h"

namespace robomosp::articulated {
namespace {

using namespace spatial;

constexpr double kRank = 1e-10;  // a loop's direction weaker than this is implied by others

}  // namespace

Result<void> Constrained::prepare(const RobotModel& model, const Params& params) {
  RMP_TRY_ASSIGN(tree_, make_body_tree(model));
  stabilization_ = params.real("stabilization");
  rows_ = loop_rows(tree_.loops);
  // The loops hold nowhere at random places, but the inertia alone decides.
  std::vector<double> scratch(scratch_size());
  const std::size_t n = tree_.velocities;
  return refuse_singular(tree_, [&](DynamicsBatch b, double*) -> std::int32_t {
    const TreeScratch s = take_scratch(tree_, scratch.data());
    TreeState state;
    state.q = b.q.data();
    sweep(tree_, state, s.bodies, s.columns);
    gather(tree_, s.bodies, true);
    const std::span<double> m(s.rest, n * n);
    tree_inertia(tree_, s.bodies, s.columns, m);
    const std::ptrdiff_t bad = cholesky(m, n);
    return bad < 0 ? -1 : joint_of(tree_, static_cast<std::size_t>(bad));
  });
}

std::size_t Constrained::scratch_size() const {
  const std::size_t n = tree_.velocities, c = rows_;
  return tree_scratch(tree_) + n * n + 2 * n + 2 * c * n + 3 * c * c + 9 * c;
}

Result<void> Constrained::one(const DynamicsBatch& batch, std::size_t sample, double* qdd,
                              double* forces) const {
  const std::size_t n = tree_.velocities, c = rows_;
  const TreeScratch s = take_scratch(tree_, batch.scratch.data());
  double* at = s.rest;
  const auto take = [&](std::size_t size) {
    const std::span<double> part(at, size);
    at += size;
    return part;
  };
  const std::span<double> m = take(n * n), bias = take(n), jacobian = take(c * n),
                          response = take(c * n), a = take(c * c), gap = take(c), rate = take(c),
                          drift = take(c), lambda = take(c), rest = take(2 * c * c + 5 * c);
  tree_torques(tree_, batch, sample, batch.terms, true, s.bodies, s.columns, bias);
  tree_inertia(tree_, s.bodies, s.columns, m);
  for (std::size_t k = 0; k < n; ++k)
    qdd[k] = (batch.tau.empty() ? 0.0 : batch.tau[sample * n + k]) - bias[k];
  if (!all_finite(qdd, n)) return not_finite("the forces", sample);
  if (const std::ptrdiff_t bad = cholesky(m, n); bad >= 0)
    return std::move(singular(tree_, joint_of(tree_, static_cast<std::size_t>(bad))))
        .in(sample_name(sample));
  cholesky_solve(m, n, qdd);
  if (c == 0) return {};
  loop_constraints(tree_, s.bodies, s.columns, state_of(tree_, batch, sample, batch.terms, true),
                   {jacobian, drift, rate, gap});
  std::copy(jacobian.begin(), jacobian.end(), response.begin());
  for (std::size_t i = 0; i < c; ++i) {
    cholesky_solve(m, n, response.data() + i * n);  // M^-1 J^T, a row a direction
    const double w = stabilization_;
    lambda[i] = -(drift[i] + 2 * w * rate[i] + w * w * gap[i]);
    for (std::size_t k = 0; k < n; ++k) lambda[i] -= jacobian[i * n + k] * qdd[k];
  }
  for (std::size_t i = 0; i < c; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0;
      for (std::size_t k = 0; k < n; ++k) sum += jacobian[i * n + k] * response[j * n + k];
      a[i * c + j] = a[j * c + i] = sum;
    }
  solve_semidefinite(a, c, kRank, lambda, rest.data());
  for (std::size_t i = 0; i < c; ++i)
    for (std::size_t k = 0; k < n; ++k) qdd[k] += lambda[i] * response[i * n + k];
  if (forces) std::copy(lambda.begin(), lambda.end(), forces);
  return {};
}

Result<void> Constrained::run(const DynamicsBatch& batch, std::span<double> qdd, double* forces,
                              Progress& progress) const {
  const std::size_t n = tree_.velocities;
  RMP_TRY(check_batch(tree_, batch, scratch_size(), qdd.size(), n));
  for (std::size_t i = 0; i < batch.count; ++i) {
    if (i % kSamplesPerCheck == 0 && progress.cancelled()) return cancelled();
    RMP_TRY(one(batch, i, qdd.data() + i * n, forces ? forces + i * rows_ : nullptr));
  }
  return {};
}

Result<void> Constrained::accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                                        Progress& progress) const {
  return run(batch, qdd, nullptr, progress);
}

Result<void> Constrained::constrained(const DynamicsBatch& batch, std::span<double> qdd,
                                      std::span<double> forces, Progress& progress) const {
  if (forces.size() != batch.count * rows_)
    return error(ErrorCode::invalid_argument,
                 "the forces have " + std::to_string(forces.size()) + " values for " +
                     std::to_string(batch.count) + " samples of " + tree_.where(),
                 "Give " + std::to_string(batch.count * rows_) + ".");
  return run(batch, qdd, forces.data(), progress);
}

}  // namespace robomosp::articulated
