// SPDX-License-Identifier: Apache-2.0
// Where a robot stands when nobody says otherwise (layer: data processing, robotics). [any thread]
#pragma once

#include <cstddef>
#include <vector>

#include "model/records.h"

namespace robomosp::robotics {

/// Joint values of the pose "home", else `dof` zeros [rad or m].
[[nodiscard]] inline std::vector<double> home_joint_values(const model::Robot& robot,
                                                           std::size_t dof) {
  for (const auto& pose : robot.poses)
    if (pose.name == "home") return pose.q;
  return std::vector<double>(dof, 0.0);
}

}  // namespace robomosp::robotics
