// SPDX-License-Identifier: Apache-2.0
// Data of a mechanism for the general search: limits and steps of its velocities, motion of a
// configuration, frames and their Jacobians; any tree, any joint type (layer: plugin).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <robomosp/sdk/robot_model.h>

#include "random.h"

namespace robomosp::ik_numeric {

/// One entry of qd.
struct Velocity {
  std::size_t joint = 0;        ///< its joint, in RobotModel::joints
  std::int32_t q = -1;          ///< entry of q with this rate; -1 for balls and free bodies
  double lower = 0, upper = 0;  ///< of that entry; including limits of coupled joints
  double unit = 1;              ///< step unit of the search: 1 rad, or the mechanism's length [m]
  bool turns = true;
};

/// Immutable after make_mechanism; the model must outlive it.
struct Mechanism {
  const RobotModel* model = nullptr;
  std::vector<Velocity> velocities;
  double length = 1;  ///< greatest sum of distances from the base to a tip, > 0 [m]
};

[[nodiscard]] Mechanism make_mechanism(const RobotModel& model);

/// q after moving with the velocities `step` for one second, within the limits if requested.
void advance(const Mechanism& m, std::span<const double> step, bool limits, std::span<double> q);

/// The middle of the limits, 0 for unlimited joints, the identity for balls and free bodies.
[[nodiscard]] std::vector<double> middle_configuration(const Mechanism& m);
/// Within the limits; within a turn or the mechanism's length for unlimited joints.
void random_configuration(const Mechanism& m, Random& random, std::span<double> q);

/// q with limits and unit quaternions restored; a zero quaternion becomes the identity.
void mend(const Mechanism& m, std::span<double> q);

/// base_T_joint of all joints.
void forward(const RobotModel& model, std::span<const double> q, std::span<Pose> frames);
/// base_T_frame of a frame carried by a joint (-1 = base).
[[nodiscard]] Pose carried(std::int32_t joint, const Pose& local, std::span<const Pose> frames);
/// Adds sign * the Jacobian (v, w) of a frame at `point` carried by `joint` to J (6 x dof), base
/// axes.
void add_jacobian(const RobotModel& model, std::int32_t joint, const Vec3& point,
                  std::span<const Pose> frames, double sign, Eigen::Ref<Eigen::MatrixXd> J);

}  // namespace robomosp::ik_numeric
