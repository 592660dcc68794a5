// SPDX-License-Identifier: Apache-2.0
// Whether entry i of q, qd and tau is joint i of an open tree, and if not, why (layer: data
// processing, robotics). [any thread]
#pragma once

#include <string>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// A clause such as `its joint "right" follows joint "left"` or `it has the closed loop "pin"`;
/// empty where every joint has one coordinate of its own and there are no loops.
[[nodiscard]] std::string why_not_single_joints(const RobotModel& model);

}  // namespace robomosp::robotics
