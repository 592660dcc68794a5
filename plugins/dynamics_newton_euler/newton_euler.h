// SPDX-License-Identifier: Apache-2.0
// The two recursions (layer: plugin): recursive Newton-Euler in joint frames (paper eqs 2-6) and
// composite rigid bodies for the joint-space inertia. One sample a call, no allocation.
#pragma once

#include "chain.h"

namespace robomosp::newton_euler {

/// Inputs of one evaluation; a null pointer means zeros.
struct Motion {
  const double* q = nullptr;
  const double* qd = nullptr;
  const double* qdd = nullptr;
  Vec3 gravity{};
  const TipWrench* tip = nullptr;
};

[[nodiscard]] std::size_t newton_euler_scratch(const Chain& chain);
/// tau[j] of the rigid bodies alone: no motor inertia, no friction.
void newton_euler(const Chain& chain, const Motion& motion, double* scratch, double* tau);

/// tau of one sample of a batch for the chosen terms, with motor inertia and friction.
void selected_torques(const Chain& chain, const DynamicsBatch& batch, std::size_t sample,
                      std::uint32_t terms, double* scratch, double* tau);

enum class InertiaMethod { composite, columns };
[[nodiscard]] std::size_t inertia_scratch(const Chain& chain, InertiaMethod method);
/// M(q) with motor inertia: dof * dof, symmetric to the bit.
void joint_space_inertia(const Chain& chain, InertiaMethod method, const double* q, double* scratch,
                         double* m);

}  // namespace robomosp::newton_euler
