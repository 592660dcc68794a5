// SPDX-License-Identifier: Apache-2.0
// Derivatives of inverse and forward dynamics, compiled by robomosp_lanes().
#include "spatial/recursion_derivatives.h"

#include "spatial/recursion_articulated.h"
#include "spatial/recursion_kernels.h"

namespace robomosp::spatial::recursions::RMP_LANES {
namespace {

using What = Task::What;

bool is_forward(const Task& task) { return task.what == What::acceleration_derivatives; }

/// Sum of 0 * v: 0 where all numbers are finite.
double nothing_of(const double* v, std::size_t count) {
  Lanes sum{};
  std::size_t i = 0;
  for (; i + kLanes <= count; i += kLanes) sum += 0.0 * load(v + i);
  double rest = 0;
  for (; i < count; ++i) rest += 0.0 * v[i];
  for (std::size_t k = 0; k < kLanes; ++k) rest += sum[k];
  return rest;
}

/// The right sides that by_q, by_qd and the unit matrix are, solved; returns what factor() does.
template <class T>
T solve_accelerations(const Mechanism& m, const Task& task, Inputs<T> in, const BaseRow& row,
                      const T* tau, const DerivativeScratch<T>& x) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double);
  const std::size_t n = m.velocities;
  T least = splat<T>(1);
  if (task.pivots) {
    torques(m, task, in, row, true, x.own, x.own.qdd);
    for (std::size_t i = 0; i < n; ++i) x.own.qdd[i] = tau[i] - x.own.qdd[i];
    least = articulated_solve(m, task.pivots, x.own, x.own.qdd);
    in.qdd = x.own.qdd;
  }
  auto* const right = reinterpret_cast<T*>(x.right_sides);
  const std::size_t width = x.width / kWide;
  torque_derivatives<T>(m, task, in, row, true, x, {right, right + n, width, -1}, x.m);
  for (std::size_t r = 0; r < n; ++r) {
    T* to = right + r * width;
    for (std::size_t c = 2 * n; c < width; ++c) to[c] = T{};
    to[2 * n + r] = splat<T>(1);
  }
  const T positive = factor(m, x.m, x.own.diagonal);
  least = select(positive > 0, least, positive);
  solve_all(m, x.m, x.right_sides, x.width, 2 * n);
  return least;
}

std::size_t run_derivative_single(const Mechanism& m, const Task& task, std::size_t first,
                                  std::size_t last, double* scratch) {
  DerivativeScratch<double> x;
  lay_out(m, task, is_forward(task), scratch, x);
  const std::size_t n = m.velocities, square = n * n;
  for (std::size_t i = 0; i < n; ++i) x.own.zeros[i] = 0;
  for (std::size_t i = first; i < last; ++i) {
    const auto of = [&](const double* all) { return all ? all + i * n : x.own.zeros; };
    Inputs<double> in{task.q + i * m.coordinates, of(task.qd), of(task.qdd), nullptr};
    if (task.wrench) in.wrench = task.wrench + (task.one_wrench ? 0 : 6 * i);
    BaseRow row;
    if (task.base) row.first = task.base + (task.one_base ? 0 : 12 * i);
    place(m, in.q, x.own);
    double *by_q = task.out + i * square, *by_rate = task.by_rate + i * square;
    double well = 1;
    if (is_forward(task)) {
      well = solve_accelerations(m, task, in, row, of(task.tau), x);
      double* const to[3] = {by_q, by_rate, task.by_force + i * square};
      for (std::size_t part = 0; part < 3; ++part) {
        for (std::size_t r = 0; r < n; ++r)
          __builtin_memcpy(to[part] + r * n, x.right_sides + r * x.width + part * n,
                           n * sizeof(double));
        well += nothing_of(to[part], square);
      }
    } else {
      torque_derivatives<double>(m, task, in, row, false, x, {by_q, by_rate, n}, nullptr);
      well += nothing_of(by_q, square) + nothing_of(by_rate, square);
    }
    if (!(well > 0)) return i;
  }
  return last;
}

std::size_t run_derivative_lanes(const Mechanism& m, const Task& task, std::size_t samples,
                                 std::size_t first, std::size_t last, double* scratch) {
  DerivativeScratch<Lanes> x;
  lay_out(m, task, is_forward(task), scratch, x);
  const std::size_t n = m.velocities, square = n * n;
  for (std::size_t i = 0; i < n; ++i) x.own.zeros[i] = Lanes{};
  if (task.wrench && task.one_wrench)
    for (std::size_t k = 0; k < 6; ++k) x.own.wrench[k] = splat<Lanes>(task.wrench[k]);
  for (std::size_t i = first; i < last; i += kLanes) {
    const std::size_t left = samples - i, here = last - i < kLanes ? last - i : kLanes;
    const auto loaded = [&](const double* all, Lanes* to) -> const Lanes* {
      if (!all) return x.own.zeros;
      load_samples(all + i * n, n, left, to);
      return to;
    };
    load_samples(task.q + i * m.coordinates, m.coordinates, left, x.own.q);
    Inputs<Lanes> in{x.own.q, loaded(task.qd, x.own.qd), x.own.zeros, nullptr};
    const Lanes* tau = x.own.zeros;
    if (is_forward(task)) tau = loaded(task.tau, x.own.tau);
    if (!task.pivots) in.qdd = loaded(task.qdd, x.own.qdd);
    if (task.wrench) {
      if (!task.one_wrench) load_samples(task.wrench + 6 * i, 6, left, x.own.wrench);
      in.wrench = x.own.wrench;
    }
    BaseRow row;
    if (task.base && task.one_base) row = {task.base, 0, 0};
    else if (task.base) row = {task.base + 12 * i, 12, left - 1};
    place(m, in.q, x.own);
    Lanes well = splat<Lanes>(1);
    const auto put = [&](const Lanes* from, double* to) {
      for (std::size_t k = 0; k < square; ++k) well += 0.0 * from[k];
      store_samples(from, square, here, to + i * square);
    };
    if (is_forward(task)) {
      well = solve_accelerations(m, task, in, row, tau, x);
      const auto* right = reinterpret_cast<const Lanes*>(x.right_sides);
      double* const to[3] = {task.out, task.by_rate, task.by_force};
      for (std::size_t part = 0; part < 3; ++part) {
        for (std::size_t r = 0; r < n; ++r)
          for (std::size_t c = 0; c < n; ++c) x.by_q[r * n + c] = right[(3 * r + part) * n + c];
        put(x.by_q, to[part]);
      }
    } else {
      torque_derivatives<Lanes>(m, task, in, row, false, x, {x.by_q, x.by_rate, n}, nullptr);
      put(x.by_q, task.out);
      put(x.by_rate, task.by_rate);
    }
    if (__builtin_expect(any(~(well > 0)), 0)) {
      double each[kLanes];
      __builtin_memcpy(each, &well, sizeof well);
      for (std::size_t k = 0; k < here; ++k)
        if (!(each[k] > 0)) return i + k;
    }
  }
  return last;
}

std::size_t run_derivatives(const Mechanism& m, const Task& task, std::size_t samples,
                            std::size_t first, std::size_t last, double* scratch) {
  if (!task.lanes) return run_derivative_single(m, task, first, last, scratch);
  return run_derivative_lanes(m, task, samples, first, last, scratch);
}

std::size_t derivative_scratch_size(const Mechanism& m, const Task& task) {
  DerivativeScratch<double> one;
  DerivativeScratch<Lanes> several;
  return task.lanes ? lay_out(m, task, is_forward(task), nullptr, several)
                    : lay_out(m, task, is_forward(task), nullptr, one);
}

constexpr Kernels kDerivativesTable{run_derivatives, derivative_scratch_size, kLanes};

}  // namespace

const Kernels& derivative_kernels() { return kDerivativesTable; }

}  // namespace robomosp::spatial::recursions::RMP_LANES
