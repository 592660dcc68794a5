// SPDX-License-Identifier: Apache-2.0
// Which forward dynamics a robot gets for which nobody has chosen one (layer: application, sim).
#pragma once

#include <cstddef>

#include <robomosp/sdk/robot_model.h>

#include "kernel/registry.h"
#include "model/records.h"

namespace robomosp::sim {

/// From so many velocities on articulated bodies take less time than the inertia matrix, one state
/// at a time (docs/performance.md).
inline constexpr std::size_t kLongChain = 24;

/// Whether bind_forward_dynamics() takes "articulated_body": neither the robot nor the run, the
/// document or the user has chosen, the robot has kLongChain velocities or more, no closed loops,
/// and joints that move by themselves. [any thread]
[[nodiscard]] bool is_long_chain(const Registry&, const RobotModel&,
                                 const model::ProviderChoice& own);

}  // namespace robomosp::sim
