// SPDX-License-Identifier: Apache-2.0
// Provider "constrained": forward dynamics of mechanisms with closed loops by Lagrange's
// multipliers (layer: plugin). M qdd + h = tau + J^T lambda with J qdd + J' qd = -2 w r' - w^2 r
// (Baumgarte, Stabilization of Constraints and Integrals of Motion, CMAME 1972); r the gaps.
// Redundant loops share their forces; coupled joints and floating bases are part of the tree.
#pragma once

#include <robomosp/sdk/dynamics.h>

#include "spatial/body_tree.h"

namespace robomosp::articulated {

class Constrained final : public ForwardDynamics {
 public:
  Result<void> prepare(const RobotModel& model, const Params& params) override;
  std::size_t scratch_size() const override;
  Result<void> accelerations(const DynamicsBatch& batch, std::span<double> qdd,
                             Progress& progress) const override;
  Result<void> constrained(const DynamicsBatch& batch, std::span<double> qdd,
                           std::span<double> forces, Progress& progress) const override;

 private:
  Result<void> run(const DynamicsBatch& batch, std::span<double> qdd, double* forces,
                   Progress& progress) const;
  Result<void> one(const DynamicsBatch& batch, std::size_t sample, double* qdd,
                   double* forces) const;
  spatial::BodyTree tree_;
  std::size_t rows_ = 0;      ///< fixed directions of all loops
  double stabilization_ = 0;  ///< rate at which gaps close [1/s]
};

}  // namespace robomosp::articulated
