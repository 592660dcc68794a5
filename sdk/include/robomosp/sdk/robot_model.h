// SPDX-License-Identifier: Apache-2.0
// RobotModel: the flat, constant description of a mechanism that every solver receives
// (layer: contract, std only). It is free of DH conventions: the host has already turned rows of
// either convention, offsets and fixed joints into joint frames with the joint axis as z axis.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <robomosp/sdk/types.h>

namespace robomosp {

/// How a joint's frame moves in its parent. Universal, cylindrical and planar joints come as
/// sequences of revolute and prismatic ones with massless bodies between.
enum class JointType : std::int32_t {
  revolute = 0,   ///< q: angle about z [rad]
  prismatic = 1,  ///< q: translation along z [m]
  /// q: unit quaternion w x y z; velocity: angular, in the moving joint frame [rad/s]
  spherical = 2,
  /// q: position x y z in the placement's frame [m], then the quaternion w x y z; velocity: linear
  /// of the joint frame's origin [m/s], then angular [rad/s], both in the moving joint frame
  free = 3,
};

/// Numbers in q of a joint: 1, 1, 4, 7.
[[nodiscard]] constexpr std::int32_t coordinate_count(JointType t) {
  return t == JointType::free ? 7 : t == JointType::spherical ? 4 : 1;
}
/// Numbers in qd, qdd and tau of a joint: 1, 1, 3, 6.
[[nodiscard]] constexpr std::int32_t velocity_count(JointType t) {
  return t == JointType::free ? 6 : t == JointType::spherical ? 3 : 1;
}

/// At the joint: tau_f = viscous * qd + coulomb(sign of qd; rest, |qd| <= 1e-9 rad/s or m/s: 0).
struct JointFriction {
  double viscous = 0;           ///< G^2 B [N m s/rad or N s/m]
  double coulomb_positive = 0;  ///< |G| Tc+ for qd > 0, >= 0 [N m or N]
  double coulomb_negative = 0;  ///< |G| Tc- for qd < 0, <= 0 [N m or N]
};

/// A spring across a joint of one coordinate; held against it, tau = stiffness * (q - rest).
struct JointSpring {
  double stiffness = 0;  ///< >= 0 [N m/rad or N/m]
  double rest = 0;       ///< where it pulls to [rad or m]
};

/// A joint that follows another one: q = ratio * q_of + offset. It has no coordinate itself;
/// forces at it count for the joint that it follows, times the ratio.
struct JointCoupling {
  std::int32_t of = -1;  ///< the joint followed (uncoupled, of one coordinate); -1 = none
  double ratio = 1;      ///< [1, m/rad or rad/m]
  double offset = 0;     ///< [rad or m]
};

/// One joint and the body it moves. Joint frame i moves with body i; it is at
/// `placement` in its parent's joint frame when the joint has not moved, and q moves it
/// (JointType): parent_T_joint(q) = placement * J(q).
struct JointModel {
  std::string name;
  JointType type = JointType::revolute;
  std::int32_t parent = -1;   ///< index of the parent joint (< own index), -1 = base
  std::int32_t q_index = -1;  ///< first entry in q; of the joint followed when coupled
  std::int32_t v_index = -1;  ///< first entry in qd, qdd, tau
  Pose placement;             ///< parent-joint_T_joint at rest (offset included)
  Pose link;                  ///< joint_T_link: the user's (DH) link frame in the joint frame
  MassProperties body;        ///< of all that moves rigidly with this joint, in the joint frame
  JointCoupling coupling;
  bool passive = false;  ///< has no motor: it is moved by springs, gravity or a closed loop
  /// Limits of joints of one coordinate; of the coupled joint itself where it is coupled.
  double lower = -std::numeric_limits<double>::infinity();            ///< [rad or m]
  double upper = std::numeric_limits<double>::infinity();             ///< [rad or m]
  double max_velocity = std::numeric_limits<double>::infinity();      ///< [rad/s or m/s]
  double max_acceleration = std::numeric_limits<double>::infinity();  ///< [rad/s^2 or m/s^2]
  double max_jerk = std::numeric_limits<double>::infinity();          ///< [rad/s^3 or m/s^3]
  double max_force = std::numeric_limits<double>::infinity();  ///< torque or force [N m or N]
  double armature = 0;  ///< motor inertia seen at the joint, G^2 Jm [kg m^2 or kg]
  JointFriction friction;
  JointSpring spring;

  [[nodiscard]] bool is_coupled() const { return coupling.of >= 0; }
};

/// A frame to be placed by inverse kinematics: the tool of one branch.
struct TipModel {
  std::string name;
  std::int32_t joint = -1;  ///< the joint that carries it, -1 = base
  Pose tool;                ///< joint_T_tip
};

/// Directions of a loop frame, to be summed by `|`: of motions that a closure forbids.
enum LoopDirection : std::uint32_t {
  kLoopX = 1,
  kLoopY = 2,
  kLoopZ = 4,
  kLoopRotX = 8,
  kLoopRotY = 16,
  kLoopRotZ = 32,
  kLoopPoint = 7,      ///< a ball: the origins meet
  kLoopRevolute = 31,  ///< a hinge about z
  kLoopWeld = 63,
};

/// A closed loop: two frames of the tree that stay together in the fixed directions, axes of frame
/// a. The residual is R_a^T (p_b - p_a) and the rotation vector of R_a^T R_b.
struct LoopModel {
  std::string name;
  std::int32_t joint_a = -1, joint_b = -1;  ///< that carry the frames, -1 = base
  Pose in_a, in_b;                          ///< joint_T_frame of either
  std::uint32_t fixed = kLoopWeld;          ///< LoopDirection
};

/// The mechanism. Made by the host and read through const&; may gain fields at the end.
/// A configuration q has coordinate_count() entries; qd, qdd and tau have dof(). They are equal
/// unless there are spherical or free joints.
struct RobotModel {
  std::uint32_t struct_size = sizeof(RobotModel);  ///< see plugin.h
  std::string name;
  std::vector<JointModel> joints;  ///< parents before children
  std::vector<TipModel> tips;      ///< at least one
  Pose base;                       ///< world_T_base; poses given to solvers are in the *base* frame
  Vec3 gravity{0, 0, -9.81};       ///< in the base frame [m/s^2]
  std::vector<LoopModel> loops;
  std::int32_t coordinates = 0;  ///< length of q
  std::int32_t velocities = 0;   ///< length of qd, qdd and tau

  /// Independent velocities of the tree, loops not counted.
  [[nodiscard]] std::size_t dof() const { return static_cast<std::size_t>(velocities); }
  [[nodiscard]] std::size_t coordinate_count() const {
    return static_cast<std::size_t>(coordinates);
  }
  /// Numbers the coordinates in order of the joints; whoever builds or changes `joints` calls it.
  void number_coordinates() {
    coordinates = velocities = 0;
    for (JointModel& j : joints) {
      if (j.is_coupled()) continue;
      j.q_index = coordinates;
      j.v_index = velocities;
      coordinates += robomosp::coordinate_count(j.type);
      velocities += velocity_count(j.type);
    }
    for (JointModel& j : joints)
      if (j.is_coupled()) {
        const JointModel& of = joints[static_cast<std::size_t>(j.coupling.of)];
        j.q_index = of.q_index;
        j.v_index = of.v_index;
      }
  }
  /// True when every joint's parent is the joint before it.
  [[nodiscard]] bool is_serial() const {
    for (std::size_t i = 0; i < joints.size(); ++i)
      if (joints[i].parent != static_cast<std::int32_t>(i) - 1) return false;
    return true;
  }
  /// True when every joint is revolute or prismatic and has its own coordinate, so that entry
  /// i of q, qd and tau belongs to joint i.
  [[nodiscard]] bool is_simple() const {
    for (const JointModel& j : joints)
      if (j.is_coupled() || robomosp::coordinate_count(j.type) != 1) return false;
    return true;
  }
};

}  // namespace robomosp
