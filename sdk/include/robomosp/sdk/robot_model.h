// SPDX-License-Identifier: Apache-2.0
// RobotModel: the flat, constant description of a mechanism that every solver receives
// (layer: contract, std only). It is free of DH conventions: the host has already turned rows of
// either convention, offsets and fixed joints into joint frames whose z axis is the joint axis.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp {

enum class JointType : std::int32_t { revolute = 0, prismatic = 1 };

/// Friction as seen at the joint: tau_f = viscous * qd + coulomb(sign of qd).
struct JointFriction {
  double viscous = 0;           ///< G^2 B [N m s/rad or N s/m]
  double coulomb_positive = 0;  ///< |G| Tc+ for qd > 0, >= 0 [N m or N]
  double coulomb_negative = 0;  ///< |G| Tc- for qd < 0, <= 0 [N m or N]
};

/// One joint and the body it moves. Joint frame i moves with body i; at q = 0 it stands at
/// `placement` in its parent's joint frame, and q turns it about (or shifts it along) its own z:
/// parent_T_joint(q) = placement * J(q).
struct JointModel {
  std::string name;
  JointType type = JointType::revolute;
  std::int32_t parent = -1;  ///< index of the parent joint (< own index), -1 = base
  Pose placement;            ///< parent-joint_T_joint at q = 0 (offset included)
  Pose link;                 ///< joint_T_link: the user's (DH) link frame in the joint frame
  MassProperties body;       ///< of all that moves rigidly with this joint, in the joint frame
  double lower = -std::numeric_limits<double>::infinity();            ///< [rad or m]
  double upper = std::numeric_limits<double>::infinity();             ///< [rad or m]
  double max_velocity = std::numeric_limits<double>::infinity();      ///< [rad/s or m/s]
  double max_acceleration = std::numeric_limits<double>::infinity();  ///< [rad/s^2 or m/s^2]
  double max_force = std::numeric_limits<double>::infinity();  ///< torque or force [N m or N]
  double armature = 0;  ///< motor inertia seen at the joint, G^2 Jm [kg m^2 or kg]
  JointFriction friction;
};

/// A frame to be placed by inverse kinematics: the tool of one branch.
struct TipModel {
  std::string name;
  std::int32_t joint = -1;  ///< the joint that carries it, -1 = base
  Pose tool;                ///< joint_T_tip
};

/// The mechanism. Made by the host and read through const&; may gain fields at the end.
/// q, qd, qdd, tau have one entry a joint, in order of `joints`.
struct RobotModel {
  std::string name;
  std::vector<JointModel> joints;  ///< parents before children
  std::vector<TipModel> tips;      ///< at least one
  Pose base;                       ///< world_T_base; poses given to solvers are in the *base* frame
  Vec3 gravity{0, 0, -9.81};       ///< in the base frame [m/s^2]

  [[nodiscard]] std::size_t dof() const { return joints.size(); }
  /// True when every joint's parent is the joint before it.
  [[nodiscard]] bool is_serial() const {
    for (std::size_t i = 0; i < joints.size(); ++i)
      if (joints[i].parent != static_cast<std::int32_t>(i) - 1) return false;
    return true;
  }
};

}  // namespace robomosp
