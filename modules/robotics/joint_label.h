// SPDX-License-Identifier: Apache-2.0
// Joints in messages and titles of columns (layer: data processing, robotics). [any thread]
#pragma once

#include <cstddef>
#include <string>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// `joint 3 (elbow)` of entry 2 of RobotModel::joints. MakerAxes::before_joint() returns the
/// words for its axis, which come before it.
[[nodiscard]] inline std::string joint_label(const RobotModel& model, std::size_t joint) {
  return "joint " + std::to_string(joint + 1) + " (" + model.joints[joint].name + ")";
}

}  // namespace robomosp::robotics
