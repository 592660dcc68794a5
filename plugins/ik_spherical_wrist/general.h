// SPDX-License-Identifier: Apache-2.0
// Arms with a spherical wrist and any first three joints: a quartic for joint 3, subproblems for
// the others (layer: plugin).
#pragma once

#include "candidates.h"
#include "family.h"

namespace robomosp::ik_spherical_wrist {

/// Fills the lanes of all branches. Where the wrist point cannot be reached they are the
/// configurations of the nearest points found, with their gaps.
void solve_general(const Family& family, const Question& question, Candidates& out);

}  // namespace robomosp::ik_spherical_wrist
