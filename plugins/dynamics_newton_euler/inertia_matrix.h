// SPDX-License-Identifier: Apache-2.0
// Solves M x = b for the joint-space inertia of a tree (layer: plugin). M = L^T D L, eliminated
// from the tips to the base, so that zeros between branches stay zeros and a pivot that vanishes
// belongs to the joint that nothing resists (Featherstone, Rigid Body Dynamics Algorithms, 6.5).
#pragma once

#include <cstdint>

#include "chain.h"

namespace robomosp::newton_euler {

/// Factors m (dof * dof) in place, with dof doubles of scratch. Returns -1, or the joint whose
/// pivot is not positive; nothing is divided by such a pivot.
[[nodiscard]] std::int32_t factor(const Chain& chain, double* m, double* scratch);
/// Solves in place with a factored matrix.
void solve(const Chain& chain, const double* m, double* x);

}  // namespace robomosp::newton_euler
