// SPDX-License-Identifier: Apache-2.0
// The joints between base and one tip, and the tip's pose and Jacobian (layer: plugin).
#pragma once

#include <span>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::ik_numeric {

/// One joint on the path to the tip.
struct PathJoint {
  Pose placement;  ///< previous-path-joint_T_joint at q = 0
  double lower = 0, upper = 0;
  double unit = 1;        ///< step unit of the search: 1 rad, or the chain's length for prismatic
                          ///< joints [m]
  std::size_t index = 0;  ///< in RobotModel::joints
  JointType type = JointType::revolute;
};

/// Data of a mechanism for the search, for one tip. Immutable after make_chain.
struct Chain {
  std::vector<PathJoint> joints;
  Pose first;         ///< base_T_tip if no joint carries the tip
  Pose tool;          ///< last joint_T_tip
  double length = 1;  ///< sum of the distances between the joints, > 0 [m]
  double slide = 0;   ///< total range of all prismatic joints from q = 0; may be infinite [m]
  [[nodiscard]] std::size_t size() const { return joints.size(); }
};

[[nodiscard]] Chain make_chain(const RobotModel& model, std::size_t tip);

/// Frames along the chain for q (one entry per path joint); returns base_T_tip.
Pose forward(const Chain& chain, std::span<const double> q, std::span<Pose> frames);

/// Range of initial values: the limits, or one turn or chain length if unlimited.
[[nodiscard]] double start_bound(const PathJoint& joint, bool upper);

/// A lower bound of the distance of base_T_tip's origin from `target` [m]; 0 = may be reached.
[[nodiscard]] double certain_gap(const Chain& chain, const Vec3& target);

}  // namespace robomosp::ik_numeric
