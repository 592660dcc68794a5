// SPDX-License-Identifier: Apache-2.0
// Provider "divide_and_conquer": forward dynamics of long serial chains in O(log n) depth on as
// many processors as there are runs of joints, the bound of the paper's section on dynamics (layer:
// plugin). A run of joints is an affine map between the motion of the body before it and the force
// at its last body; neighbouring maps are put together pairwise, as in R. Featherstone, A
// Divide-and-Conquer Articulated-Body Algorithm, IJRR 1999, here by stiffness on one side and
// compliance on the other, so that bodies without mass or inertia do no harm.
#pragma once

#include <robomosp/sdk/dynamics.h>

#include "articulated_body.h"
#include "spatial/parallel.h"

namespace robomosp::articulated {

class DivideAndConquer final : public ForwardDynamics {
 public:
  explicit DivideAndConquer(const rmp_host* host) { spatial::use_threads_of(host); }
  Result<void> prepare(const RobotModel& model, const Params& params) override;
  std::size_t scratch_size() const override;
  Result<void> accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                             Progress& progress) const override;

  struct Node;
  struct Link;

 private:
  struct Work;
  [[nodiscard]] Work work(double* scratch) const;
  [[nodiscard]] std::int32_t one(const DynamicsBatch& batch, std::size_t sample, double* scratch,
                                 double* qdd) const;
  [[nodiscard]] std::size_t nodes_of(std::size_t level) const;

  Articulated articulated_;
  std::vector<std::int32_t> runs_;   ///< first joint of each run, and one past the last
  std::vector<std::size_t> levels_;  ///< first node of each level, runs first
  std::size_t shared_level_ = 0;     ///< its nodes are divided among the threads
  std::size_t threads_ = 1;
};

}  // namespace robomosp::articulated
