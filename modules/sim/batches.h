// SPDX-License-Identifier: Apache-2.0
// Dynamics of many states at once into memory of the caller, checked as all that providers give
// (layer: application, sim). Errors name the robot and the provider.
#pragma once

#include <span>

#include "sim/simulate.h"

namespace robomosp::sim {

/// count * dof numbers.
Result<void> torques(const Bound<InverseDynamics>&, DynamicsBatch, std::span<double> out,
                     Progress&);
/// count * dof * dof numbers.
Result<void> inertia(const Bound<InverseDynamics>&, DynamicsBatch, std::span<double> out,
                     Progress&);
/// count * dof numbers.
Result<void> accelerations(const Bound<ForwardDynamics>&, DynamicsBatch, std::span<double> out,
                           Progress&);

}  // namespace robomosp::sim
