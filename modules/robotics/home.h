// SPDX-License-Identifier: Apache-2.0
// Default configuration of a robot (layer: data processing, robotics). [any thread]
#pragma once

#include <vector>

#include "model/records.h"
#include "robotics/coordinates.h"

namespace robomosp::robotics {

/// The configuration of the pose "home", else zeros with quaternions 1 0 0 0: coordinate_count()
/// numbers [rad, m or 1].
[[nodiscard]] inline std::vector<double> home_joint_values(const model::Robot& robot) {
  std::vector<double> neutral = neutral_coordinates(robot);
  for (const auto& pose : robot.poses)
    if (pose.name == "home" && pose.q.size() == neutral.size()) return pose.q;
  return neutral;
}

}  // namespace robomosp::robotics
