// SPDX-License-Identifier: Apache-2.0
// Determines the branch of a configuration of a 6R arm: shoulder, elbow, wrist (layer: plugin).
#pragma once

#include <span>

#include <robomosp/sdk/ik_branches.h>

#include "family.h"

namespace robomosp::ik_spherical_wrist {

/// Shoulder, elbow and wrist if axes 2 and 3 are parallel; else the wrist alone, since no signs
/// distinguish the up to four solutions for the first three joints.
[[nodiscard]] std::span<const IkBranchChoice> branch_choices(const Family& family);
/// IkBranches::measure of one configuration, given as six angles [rad].
void measure_branch(const Family& family, std::span<const double> q, std::span<double> out);

}  // namespace robomosp::ik_spherical_wrist
