// SPDX-License-Identifier: Apache-2.0
// Runs a kernel over a batch: in lanes or one by one, on one core or several, with cancellation
// (layer: data processing, spatial).
#pragma once

#include <algorithm>

#include <robomosp/sdk/dynamics.h>

#include "spatial/recursion_chain.h"

namespace robomosp::spatial::recursions {

/// The kernel for a mechanism: its mode of computation, and its scratch.
class Runner {
 public:
  Runner() = default;
  /// `set` must be supported by this processor.
  /// A single sample gains nothing from the widest vectors.
  Runner(spatial::InstructionSet set, bool columns)
      : kernels_(&kernels(set)),
        single_(&kernels(std::min(set, spatial::InstructionSet::avx2))),
        derivatives_(&derivative_kernels(set)),
        columns_(columns) {}
  /// Forward dynamics by articulated bodies, of mechanisms with single_joints; `pivots` as in Task,
  /// which the caller keeps.
  Runner(spatial::InstructionSet set, const double* pivots) : Runner(set, false) {
    pivots_ = pivots;
  }

  /// Number of doubles that run needs for the kinds of task, on all cores.
  [[nodiscard]] std::size_t scratch_size(const Chain& chain,
                                         std::initializer_list<Task::What> kinds) const;
  /// Returns the first sample with an invalid result, or batch.count. The result of a sample in a
  /// batch of two or more depends neither on the other samples nor on the number of threads; for a
  /// single sample it may differ by rounding. Spans were checked by check_batch.
  Result<std::size_t> run(const Chain& chain, Task::What what, const DynamicsBatch& batch,
                          std::span<double> out, Progress& progress) const;
  /// The same for derivatives: of torques, or with by_tau of accelerations: for the batch's tau, or
  /// without pivots at the batch's qdd.
  Result<std::size_t> differentiate(const Chain& chain, const DynamicsBatch& batch,
                                    std::span<double> by_q, std::span<double> by_qd,
                                    std::span<double> by_tau, Progress& progress) const;

 private:
  [[nodiscard]] bool fits_lanes(const Mechanism& m, Task::What what) const;
  [[nodiscard]] std::size_t scratch_of(const Mechanism& m, Task::What what, bool lanes) const;
  [[nodiscard]] std::size_t most_threads(const Mechanism& m, Task::What what, bool lanes) const;

  [[nodiscard]] const Kernels& of(const Task& task) const {
    const bool differentiates = task.what == Task::What::torque_derivatives ||
                                task.what == Task::What::acceleration_derivatives;
    return differentiates ? *derivatives_ : task.lanes ? *kernels_ : *single_;
  }
  Result<std::size_t> run(const Chain& chain, Task task, const DynamicsBatch& batch,
                          Progress& progress) const;

  const Kernels *kernels_ = nullptr, *single_ = nullptr, *derivatives_ = nullptr;
  bool columns_ = false;
  const double* pivots_ = nullptr;
};

}  // namespace robomosp::spatial::recursions
