// SPDX-License-Identifier: Apache-2.0
// Ellipsoids of velocity and force at the tools of robots (layer: application, scene). [any thread]
#pragma once

#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/render.h>
#include <robomosp/sdk/robot_model.h>

#include "scene/ellipsoid.h"

namespace robomosp::scene {

/// The ellipsoids of the first tool, scaled to a fifth of the reach; with closed loops for the
/// motors' rates. `joint_frames` of one configuration.
[[nodiscard]] std::vector<render::Item> tool_ellipsoids(const std::string& owner,
                                                        const RobotModel& model,
                                                        const Pose& world_T_base,
                                                        std::span<const Pose> joint_frames,
                                                        const ShownEllipsoids& shown);

}  // namespace robomosp::scene
