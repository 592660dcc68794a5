// SPDX-License-Identifier: Apache-2.0
// Paths at one branch and one arm angle, several targets side by side (layer: plugin).
#pragma once

#include <span>

#include "follow_kernel.h"
#include "srs_arm.h"

namespace robomosp::ik_srs {

/// Above this sine of elbow, shoulder and wrist no other branch comes within kSlow of this one.
inline constexpr double kClearOfBranches = 0.05;

/// The numbers of an arm that the kernels read.
[[nodiscard]] FollowArm follow_arm(const SrsArm& arm);
/// Branch and arm angle of a configuration.
[[nodiscard]] FollowBranch follow_branch(const SrsArm& arm, const Angles& q);
/// Of up to kMostAhead targets, with the processor's vector width.
void follow(const FollowArm& arm, const FollowBranch& branch, std::span<const Pose> targets,
            Followed& out);

}  // namespace robomosp::ik_srs
