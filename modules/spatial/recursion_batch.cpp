// SPDX-License-Identifier: Apache-2.0
#include "spatial/recursion_batch.h"

#include <algorithm>
#include <atomic>
#include <limits>

#include "spatial/parallel.h"

namespace robomosp::spatial::recursions {

const Kernels& kernels(InstructionSet set) {
#if defined(__x86_64__)
#if defined(RMP_HAS_AVX512)
  if (set == InstructionSet::avx512) return avx512::kernels();
#endif
  if (set == InstructionSet::avx2) return avx2::kernels();
#endif
  (void)set;
  return baseline::kernels();
}
const Kernels& derivative_kernels(InstructionSet set) {
#if defined(__x86_64__)
#if defined(RMP_HAS_AVX512)
  if (set == InstructionSet::avx512) return avx512::derivative_kernels();
#endif
  if (set == InstructionSet::avx2) return avx2::derivative_kernels();
#endif
  (void)set;
  return baseline::derivative_kernels();
}

namespace {

// Samples between two looks at Progress: far less than 100 ms of work for any usual mechanism.
constexpr std::size_t kSamplesPerCheck = 256;
// Beyond these, states of several samples fall out of the caches and one sample alone is as quick.
constexpr std::size_t kMostJointsInLanes = 400, kMostVelocitiesInMatrixLanes = 48,
                      kMostVelocitiesInDerivativeLanes = 24;
// Doubles of scratch for derivatives on several threads; long chains take fewer threads for it.
constexpr std::size_t kMostDerivativeScratch = std::size_t{1} << 21;

static_assert(sizeof(TipWrench) == 6 * sizeof(double) && sizeof(BaseMotion) == 12 * sizeof(double));

bool differentiates(Task::What what) {
  return what == Task::What::torque_derivatives || what == Task::What::acceleration_derivatives;
}

// About what a sample costs [ns], to decide on threads.
double cost(const Mechanism& m, const Task& task) {
  const auto n = static_cast<double>(m.velocities), joints = static_cast<double>(m.count);
  if (differentiates(task.what)) {
    const double products = task.what == Task::What::torque_derivatives ? 2 : 2 + 0.4 * n;
    return joints * 60 + n * n * products;
  }
  const double matrix = task.what == Task::What::torques || task.pivots ? 0 : n * n;
  return (joints * (task.pivots ? 60 : 25) + matrix * 8) / (task.lanes ? 8 : 1);
}

Task make_task(Task::What what, const DynamicsBatch& b, double* out) {
  Task t{};
  t.what = what;
  t.terms = b.terms;
  const auto data = [](std::span<const double> s) { return s.empty() ? nullptr : s.data(); };
  t.q = b.q.data();
  t.qd = data(b.qd), t.qdd = data(b.qdd), t.tau = data(b.tau);
  if (!b.tip.empty() && (b.terms & kExternalTerm)) t.wrench = b.tip.data()->force.data();
  if (!b.base.empty()) t.base = b.base.data()->gravity.data();
  t.one_wrench = b.tip.size() == 1;
  t.one_base = b.base.size() == 1;
  t.tip = b.tip_index;
  t.out = out;
  return t;
}

}  // namespace

bool Runner::fits_lanes(const Mechanism& m, Task::What what) const {
  if (differentiates(what)) return m.velocities <= kMostVelocitiesInDerivativeLanes;
  return m.count <= kMostJointsInLanes &&
         (what == Task::What::torques || pivots_ || m.velocities <= kMostVelocitiesInMatrixLanes);
}

std::size_t Runner::scratch_of(const Mechanism& m, Task::What what, bool lanes) const {
  Task task{};
  task.what = what;
  task.lanes = lanes;
  task.pivots = pivots_;
  return of(task).scratch(m, task);
}

std::size_t Runner::most_threads(const Mechanism& m, Task::What what, bool lanes) const {
  if (!differentiates(what)) return spatial::cores();
  return std::clamp(kMostDerivativeScratch / scratch_of(m, what, lanes), std::size_t{1},
                    spatial::cores());
}

std::size_t Runner::scratch_size(const Chain& chain,
                                 std::initializer_list<Task::What> kinds) const {
  const Mechanism& m = chain.mechanism();
  std::size_t most = 0;
  for (const Task::What what : kinds)
    for (const bool lanes : {false, fits_lanes(m, what)})
      most = std::max(most, scratch_of(m, what, lanes) * most_threads(m, what, lanes));
  return most;
}

Result<std::size_t> Runner::run(const Chain& chain, Task::What what, const DynamicsBatch& batch,
                                std::span<double> out, Progress& progress) const {
  return run(chain, make_task(what, batch, out.data()), batch, progress);
}

Result<std::size_t> Runner::differentiate(const Chain& chain, const DynamicsBatch& batch,
                                          std::span<double> by_q, std::span<double> by_qd,
                                          std::span<double> by_tau, Progress& progress) const {
  Task task = make_task(
      by_tau.empty() ? Task::What::torque_derivatives : Task::What::acceleration_derivatives, batch,
      by_q.data());
  task.by_rate = by_qd.data();
  task.by_force = by_tau.data();
  return run(chain, task, batch, progress);
}

Result<std::size_t> Runner::run(const Chain& chain, Task task, const DynamicsBatch& batch,
                                Progress& progress) const {
  const Mechanism& m = chain.mechanism();
  task.columns = columns_;
  task.pivots = pivots_;
  task.lanes = batch.count > 1 && fits_lanes(m, task.what);
  // One sample of derivatives may take as long as many of else.
  const std::size_t grain = differentiates(task.what) && !task.lanes ? 1 : kSamplesPerCheck;
  const std::size_t threads =
      std::min({spatial::worthwhile_threads(batch.count, cost(m, task)),
                most_threads(m, task.what, task.lanes), (batch.count + grain - 1) / grain});
  if (threads == 1 && batch.count <= grain) {
    if (progress.cancelled())
      return error(ErrorCode::cancelled, "the dynamics computation was cancelled");
    return of(task).run(m, task, batch.count, 0, batch.count, batch.scratch.data());
  }
  const std::size_t own = scratch_of(m, task.what, task.lanes);
  std::atomic<std::size_t> first_bad{batch.count};
  std::atomic<bool> stop{false};
  const auto work = [&](std::size_t first, std::size_t last, std::size_t thread) {
    for (std::size_t i = first; i < last; i += grain) {
      if (progress.cancelled()) stop = true;
      if (stop) return;
      const std::size_t end = std::min(last, i + grain);
      const std::size_t bad =
          of(task).run(m, task, batch.count, i, end, batch.scratch.data() + thread * own);
      if (bad == end) continue;
      std::size_t known = first_bad;
      while (bad < known && !first_bad.compare_exchange_weak(known, bad)) {
      }
      return;
    }
  };
  if (threads == 1) work(0, batch.count, 0);
  else spatial::in_parallel(batch.count, grain, threads, work);
  if (stop) return error(ErrorCode::cancelled, "the dynamics computation was cancelled");
  return first_bad.load();
}

}  // namespace robomosp::spatial::recursions
