// SPDX-License-Identifier: Apache-2.0
// Checks whether entry i of q, qd and tau is joint i of an open tree (layer: data processing,
// robotics). [any thread]
#pragma once

#include <string>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// The reason why not, a clause such as `its joint "right" follows joint "left"` or `it has the
/// closed loop "pin"`; empty if every joint has one independent coordinate and there are no loops.
[[nodiscard]] std::string why_not_single_joints(const RobotModel& model);

}  // namespace robomosp::robotics
