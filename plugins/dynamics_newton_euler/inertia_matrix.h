// SPDX-License-Identifier: Apache-2.0
// Finds the joint that makes a joint-space inertia singular (layer: plugin). M = L^T D L is
// eliminated from the tips to the base, so that a vanishing pivot belongs to a joint without
// inertia (Featherstone, Rigid Body Dynamics Algorithms, 6.5).
#pragma once

#include <cstdint>

#include "spatial/recursion_chain.h"

namespace robomosp::newton_euler {

using spatial::recursions::Chain;

/// Eliminates in m (dof * dof, modified). Returns -1, or the entry with a pivot that is not
/// positive.
[[nodiscard]] std::int32_t singular_entry(const Chain& chain, std::vector<double> m);

}  // namespace robomosp::newton_euler
