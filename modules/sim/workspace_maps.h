// SPDX-License-Identifier: Apache-2.0
// Reachability by inverse kinematics over the voxels of a workspace, configurations without
// collisions as a filter, and workspaces, maps and slices as recordings (layer: application).
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>

#include "collision/collision.h"
#include "recording/recording.h"
#include "robotics/joint_slice.h"
#include "robotics/workspace.h"
#include "sim/simulate.h"

namespace robomosp::sim {

/// Checks whether a robot touches itself or its surroundings; other robots of a world are in the
/// configuration shown there. [any thread]
class RobotContact {
 public:
  /// `robot`: index into model->robots(); of CollisionModel::of_robot 0.
  RobotContact(std::shared_ptr<const collision::CollisionModel> model, std::size_t robot)
      : model_(std::move(model)), robot_(robot), shown_(model_->shown()) {}
  /// `q`: the robot's coordinate_count() numbers.
  [[nodiscard]] Result<bool> touches(std::span<const double> q, Progress&) const;
  [[nodiscard]] bool is_script() const { return model_->is_script(); }

 private:
  std::shared_ptr<const collision::CollisionModel> model_;
  std::size_t robot_;
  std::vector<double> shown_;
};

/// Drops configurations with contact of the robot; both arguments must outlive the filter. [any
/// thread]
[[nodiscard]] robotics::ConfigurationFilter without_collisions(const RobotContact& contact,
                                                               Progress& progress);

struct ReachOptions {
  std::int32_t tip = 0;
  std::size_t directions = 32;  ///< of the tool's z axis (robotics::sphere_directions)
  /// Number of rotations about the tool's z axis tried for each direction, evenly over the circle;
  /// 0 = the rotation is free, which requires a solver with the tag "goals".
  std::size_t rolls = 4;
  IkTolerance tolerance{1e-6, 1e-6};
  const RobotContact* collision = nullptr;  ///< solutions must be free of contact; null = not
                                            ///< checked
  std::size_t threads = 0;                  ///< 0 = all cores; the result does not depend on it
};

/// For each point [mounting frame, m] the fraction of the directions, 0..1, that the tool can reach
/// there within the joint limits. Solvers written in Lua run on the calling thread.
[[nodiscard]] Result<std::vector<double>> reachability(const Registry&, const Bound<IkSolver>&,
                                                       std::span<const Vec3> points,
                                                       const ReachOptions&, Progress&);

/// x, y, z of the reached voxels, samples, surface, manipulability, mean_manipulability.
[[nodiscard]] recording::Recording workspace_recording(const RobotModel&,
                                                       const robotics::Workspace&);
/// q of the two joints (q2, q3), manipulability, condition, least, collision, singular.
[[nodiscard]] recording::Recording slice_recording(const RobotModel&, const robotics::SliceOptions&,
                                                   const robotics::JointSlice&);

}  // namespace robomosp::sim
