// SPDX-License-Identifier: Apache-2.0
// Which branch a configuration of a 6R arm is: shoulder, elbow, wrist (layer: plugin).
#pragma once

#include <span>

#include <robomosp/sdk/ik_branches.h>

#include "family.h"

namespace robomosp::ik_spherical_wrist {

/// Shoulder, elbow and wrist where axes 2 and 3 are parallel; else the wrist alone, as the up to
/// four ways of the first three joints have no signs that tell them apart.
[[nodiscard]] std::span<const IkBranchChoice> branch_choices(const Family& family);
/// IkBranches::measure of one configuration, given as six angles [rad].
void measure_branch(const Family& family, std::span<const double> q, std::span<double> out);

}  // namespace robomosp::ik_spherical_wrist
