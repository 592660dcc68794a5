// SPDX-License-Identifier: Apache-2.0
// What providers of dynamics may compute beside torques and accelerations, checked as all that they
// return: energy, regressor, constraint forces; derivatives, by differences where a provider has
// none (layer: application, sim).
#pragma once

#include <span>
#include <vector>

#include "sim/simulate.h"

namespace robomosp::sim {

/// A robot's choice of forward dynamics; a mechanism with closed loops whose robot chooses none
/// gets "constrained", which knows them.
[[nodiscard]] model::ProviderChoice forward_choice(const RobotModel&, model::ProviderChoice own);

/// One entry a sample. Gravity is the model's, or the batch's base motion's.
Result<std::vector<Energy>> energies(const Bound<InverseDynamics>&, DynamicsBatch, Progress&);

/// count matrices of dof rows and 10 columns a joint of the model: InverseDynamics::regressor.
Result<std::vector<double>> regressor(const Bound<InverseDynamics>&, DynamicsBatch, Progress&);

/// count matrices of dof * dof each, row-major, row = entry of what is differentiated.
struct DynamicsDerivatives {
  std::vector<double> by_q;    ///< by small motions of the joints
  std::vector<double> by_qd;   ///< by rates
  std::vector<double> by_tau;  ///< of accelerations only
  bool numerical = false;      ///< central differences of order four, for want of a provider's own
};
/// Of the torques of the batch's terms; refused with closed loops.
Result<DynamicsDerivatives> derivatives(const Bound<InverseDynamics>&, const DynamicsBatch&,
                                        Progress&);
/// Of the accelerations.
Result<DynamicsDerivatives> derivatives(const Bound<ForwardDynamics>&, const DynamicsBatch&,
                                        Progress&);

/// Accelerations (count * dof) and the forces that keep the loops closed: a number a fixed
/// direction, in order of LoopDirection, loop after loop, a sample.
struct ConstrainedMotion {
  std::vector<double> qdd, forces;
};
Result<ConstrainedMotion> constrained(const Bound<ForwardDynamics>&, DynamicsBatch, Progress&);

}  // namespace robomosp::sim
