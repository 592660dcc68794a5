// SPDX-License-Identifier: Apache-2.0
// Optional results of dynamics providers besides torques and accelerations, checked like all their
// results: energy, regressor, constraint forces; derivatives, by differences if a provider has none
// (layer: application, sim).
#pragma once

#include <span>
#include <vector>

#include "sim/simulate.h"

namespace robomosp::sim {

/// A robot's forward dynamics; a mechanism with closed loops and no selected solver gets
/// "constrained", which supports them.
[[nodiscard]] model::ProviderChoice forward_choice(const RobotModel&, model::ProviderChoice own);

/// One entry per sample. Gravity is the model's, or from the batch's base motion.
Result<std::vector<Energy>> energies(const Bound<InverseDynamics>&, DynamicsBatch, Progress&);

/// count matrices of dof rows and 10 columns per joint of the model: InverseDynamics::regressor.
Result<std::vector<double>> regressor(const Bound<InverseDynamics>&, DynamicsBatch, Progress&);

/// count matrices of dof * dof each, row-major, row = entry of the differentiated vector.
struct DynamicsDerivatives {
  std::vector<double> by_q;    ///< by small motions of the joints
  std::vector<double> by_qd;   ///< by rates
  std::vector<double> by_tau;  ///< of accelerations only
  bool numerical = false;      ///< by central differences of order four, since the provider has
                               ///< none
};
/// Of the torques of the batch's terms; refused for closed loops.
Result<DynamicsDerivatives> derivatives(const Bound<InverseDynamics>&, const DynamicsBatch&,
                                        Progress&);
/// Of the accelerations.
Result<DynamicsDerivatives> derivatives(const Bound<ForwardDynamics>&, const DynamicsBatch&,
                                        Progress&);

/// Accelerations (count * dof) and the forces that keep the loops closed: one number per fixed
/// direction, in order of LoopDirection, loop after loop, sample after sample.
struct ConstrainedMotion {
  std::vector<double> qdd, forces;
};
Result<ConstrainedMotion> constrained(const Bound<ForwardDynamics>&, DynamicsBatch, Progress&);

}  // namespace robomosp::sim
