// SPDX-License-Identifier: Apache-2.0
// Inverse dynamics, inertia and forward dynamics of batches, compiled by robomosp_lanes().
#include "spatial/recursion_kernels.h"

#include "spatial/recursion_articulated.h"
#include "spatial/recursion_inertia.h"

namespace robomosp::spatial::recursions::RMP_LANES {
namespace {

// One evaluation; results in out (torques, inertia, accelerations). Returns a number that is
// positive when all is well, lane by lane.
template <class T>
T evaluate(const Mechanism& m, const Task& task, const Inputs<T>& in, const BaseRow& row,
           const T* tau, const Scratch<T>& x, T* out) {
  place(m, in.q, x);
  std::size_t count = m.velocities;
  T least = splat<T>(1);
  switch (task.what) {
    case Task::What::torques: torques(m, task, in, row, false, x, out); break;
    case Task::What::inertia:
      inertia(m, task, x, out);
      count *= count;
      break;
    case Task::What::accelerations:
      torques(m, task, in, row, true, x, out);
      for (std::size_t i = 0; i < count; ++i) out[i] = tau[i] - out[i];
      if (task.pivots) {
        least = articulated_solve(m, task.pivots, x, out);
      } else {
        inertia(m, task, x, x.m);
        least = factor(m, x.m, x.diagonal);
        solve(m, x.m, out);
      }
      break;
    case Task::What::torque_derivatives:
    case Task::What::acceleration_derivatives: break;  // recursion_derivatives.cpp
  }
  T none{};  // 0 * v is NaN for infinities and NaN, else 0
  for (std::size_t i = 0; i < count; ++i) none += 0.0 * out[i];
  return least + none;
}

template <class T>
std::size_t output_width(const Mechanism& m, const Task& task) {
  return task.what == Task::What::inertia ? m.velocities * m.velocities : m.velocities;
}

[[maybe_unused]] std::size_t run_single(const Mechanism& m, const Task& task, std::size_t first,
                                        std::size_t last, double* scratch) {
  Scratch<double> x;
  lay_out(m, task, scratch, x);
  const std::size_t n = m.velocities, width = output_width<double>(m, task);
  for (std::size_t i = 0; i < n; ++i) x.zeros[i] = 0;
  for (std::size_t i = first; i < last; ++i) {
    const auto of = [&](const double* all) { return all ? all + i * n : x.zeros; };
    Inputs<double> in{task.q + i * m.coordinates, of(task.qd), of(task.qdd), nullptr};
    if (task.wrench) in.wrench = task.wrench + (task.one_wrench ? 0 : 6 * i);
    BaseRow row;
    if (task.base) row.first = task.base + (task.one_base ? 0 : 12 * i);
    if (!(evaluate(m, task, in, row, of(task.tau), x, task.out + i * width) > 0)) return i;
  }
  return last;
}

template <class T>
std::size_t run_lanes(const Mechanism& m, const Task& task, std::size_t samples, std::size_t first,
                      std::size_t last, double* scratch) {
  constexpr std::size_t kSamples = sizeof(T) / sizeof(double);
  Scratch<T> x;
  lay_out(m, task, scratch, x);
  const std::size_t n = m.velocities, width = output_width<T>(m, task);
  for (std::size_t i = 0; i < n; ++i) x.zeros[i] = T{};
  // tau of forward dynamics shares the room of qdd, which forward dynamics does not read.
  T* out = task.what == Task::What::inertia ? x.m : x.tau;
  if (task.wrench && task.one_wrench)
    for (std::size_t k = 0; k < 6; ++k) x.wrench[k] = splat<T>(task.wrench[k]);
  for (std::size_t i = first; i < last; i += kSamples) {
    const std::size_t left = samples - i, here = last - i < kSamples ? last - i : kSamples;
    const auto loaded = [&](const double* all, T* to) -> const T* {
      if (!all) return x.zeros;
      load_samples(all + i * n, n, left, to);
      return to;
    };
    load_samples(task.q + i * m.coordinates, m.coordinates, left, x.q);
    Inputs<T> in{x.q, loaded(task.qd, x.qd), x.zeros, nullptr};
    const T* tau = x.zeros;
    if (task.what == Task::What::accelerations) tau = loaded(task.tau, x.qdd);
    else if (task.what == Task::What::torques) in.qdd = loaded(task.qdd, x.qdd);
    if (task.wrench) {
      if (!task.one_wrench) load_samples(task.wrench + 6 * i, 6, left, x.wrench);
      in.wrench = x.wrench;
    }
    BaseRow row;
    if (task.base && task.one_base) row = {task.base, 0, 0};
    else if (task.base) row = {task.base + 12 * i, 12, left - 1};
    const T well = evaluate(m, task, in, row, tau, x, out);
    store_samples(out, width, here, task.out + i * width);
    if (__builtin_expect(any(~(well > 0)), 0)) {
      double each[kSamples];
      __builtin_memcpy(each, &well, sizeof well);
      for (std::size_t k = 0; k < here; ++k)
        if (!(each[k] > 0)) return i + k;
    }
  }
  return last;
}

// Two vectors pay where there are registers for them and the matrix stays in the nearest cache.
[[maybe_unused]] bool side_by_side(const Mechanism& m, const Task& task) {
  return task.what == Task::What::torques || task.pivots || m.velocities <= 10;
}

std::size_t run(const Mechanism& m, const Task& task, std::size_t samples, std::size_t first,
                std::size_t last, double* scratch) {
  if constexpr (kHasWide) {
    if (side_by_side(m, task)) return run_lanes<Wide>(m, task, samples, first, last, scratch);
  } else {
    // Runner gives single samples to narrower sets.
    if (!task.lanes) return run_single(m, task, first, last, scratch);
  }
  return run_lanes<Lanes>(m, task, samples, first, last, scratch);
}

std::size_t scratch_size(const Mechanism& m, const Task& task) {
  Scratch<Lanes> several;
  if constexpr (kHasWide) {
    Scratch<Wide> many;
    if (side_by_side(m, task)) return lay_out(m, task, nullptr, many);
  } else {
    Scratch<double> one;
    if (!task.lanes) return lay_out(m, task, nullptr, one);
  }
  return lay_out(m, task, nullptr, several);
}

constexpr Kernels kTable{run, scratch_size, kLanes};

}  // namespace

const Kernels& kernels() { return kTable; }

}  // namespace robomosp::spatial::recursions::RMP_LANES
