// SPDX-License-Identifier: Apache-2.0
// Shapes of trajectories: the paths of tools (layer: application, scene). Internal to
// modules/scene.
#pragma once

#include <string>

#include "scene/build.h"
#include "scene/posed_robot.h"
#include "scene/shape.h"

namespace robomosp::scene {

/// Whether a trajectory has segments that move joints, its own or those of what it runs: then its
/// path depends on the robot and its placement.
[[nodiscard]] bool moves_joints(const document::Snapshot&, TrajectoryId);

/// The path in the trajectory's frame, on body 0; with the failure instead if it cannot be built.
/// Not of trajectories that move joints. An error only when cancelled.
[[nodiscard]] Result<ShapePtr> path_shape(const Source&, const model::PlacedTrajectory&,
                                          const Extras&);
/// The path of a robot's tool along a trajectory that moves joints, in the world's frame: its run
/// is simulated. `robot` null = no robot is known for it, and only its control points are shown.
[[nodiscard]] Result<ShapePtr> tool_path_shape(const Source&, WorldId,
                                               const model::PlacedTrajectory&, const Extras&,
                                               const RobotBasePtr& robot,
                                               const model::PlacedRobot* placed, Progress&);

/// The path of the tool of `robot` in the colours of a check, as mark_path() draws it, in the
/// world's frame; with the failure instead if it cannot be checked. An error only when cancelled.
[[nodiscard]] Result<ShapePtr> checked_path_shape(const Source&, WorldId,
                                                  const model::PlacedTrajectory&, const Extras&,
                                                  const model::PlacedRobot& robot, Progress&);

}  // namespace robomosp::scene
