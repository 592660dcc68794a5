// SPDX-License-Identifier: Apache-2.0
// Reachability by inverse kinematics over the voxels of a workspace, configurations without
// collisions as a filter, and workspaces, maps and slices as recordings (layer: application).
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "robotics/joint_slice.h"
#include "robotics/workspace.h"
#include "sim/collision.h"
#include "sim/recording.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// Drops configurations in which the robot touches itself. `model` is of that robot alone
/// (CollisionModel::of_robot); both arguments outlive the filter. [any thread]
[[nodiscard]] robotics::ConfigurationFilter without_collisions(const CollisionModel& model,
                                                               Progress& progress);

struct ReachOptions {
  std::int32_t tip = 0;
  std::size_t directions = 32;  ///< of the tool's z axis (robotics::sphere_directions)
  /// Turns about the tool's z axis that are tried for each direction, evenly over the circle; 0 =
  /// the turn is free, which takes a solver with the tag "goals".
  std::size_t rolls = 4;
  IkTolerance tolerance{1e-6, 1e-6};
  const CollisionModel* collision = nullptr;  ///< of the robot alone; a solution must not touch it
  std::size_t threads = 0;                    ///< 0 = all cores; the answer does not depend on it
};

/// For each point [mounting frame, m] the share of the directions, 0..1, in which the tool can
/// stand there within the joint limits. Solvers of the origin "lua" run on the calling thread.
[[nodiscard]] Result<std::vector<double>> reachability(const Registry&, const Bound<IkSolver>&,
                                                       std::span<const Vec3> points,
                                                       const ReachOptions&, Progress&);

/// x, y, z of the reached voxels, samples, surface, manipulability, mean_manipulability.
[[nodiscard]] Recording workspace_recording(const RobotModel&, const robotics::Workspace&);
/// q of the two joints (q2, q3), manipulability, condition, least, collision, singular.
[[nodiscard]] Recording slice_recording(const RobotModel&, const robotics::SliceOptions&,
                                        const robotics::JointSlice&);

}  // namespace robomosp::sim
