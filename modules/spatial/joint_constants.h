// SPDX-License-Identifier: Apache-2.0
// What recursions over a mechanism read of a joint's place and motion, prepared once: plain
// numbers, and how little of a rotation there is to compute (layer: data processing, spatial).
#pragma once

#include <cstdint>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::spatial {

/// The constant rotation before a joint's own motion. Rows of either DH convention, and most
/// URDF joints, are a twist about x and an offset about z, which adds to the joint's angle.
enum class Turn : std::int32_t {
  none = 0,           ///< parallel axes
  quarter = 1,        ///< Rx(90 deg)
  minus_quarter = 2,  ///< Rx(-90 deg)
  twist = 3,          ///< Rx(any angle)
  general = 4,        ///< any rotation R
  ball = 5,           ///< R times the rotation of a spherical or free joint
};

/// parent_T_joint(q) = (R_turn, p) * J. Of revolute and prismatic joints with value x the rotation
/// is R_turn Rz(angle + x) and R_turn Rz(angle).
struct JointConstants {
  double R[9];                    ///< of the placement, row-major
  double p[3];                    ///< of the placement [m]
  double cos_twist, sin_twist;    ///< Turn::twist and what it contains
  double angle;                   ///< 0 for Turn::general and Turn::ball [rad]
  double ratio, offset;           ///< joint value = ratio * q + offset
  std::int32_t parent;            ///< -1 = base
  std::int32_t q_index, v_index;  ///< of the joint followed when coupled
  std::int32_t velocity_count;    ///< 1, 3 or 6
  JointType type;
  Turn turn;
};

/// The constants of one joint. A rotation counts as a twist when it is one to 1e-15 in every
/// element; a right angle as such to 1e-15.
[[nodiscard]] JointConstants joint_constants(const JointModel& joint);

}  // namespace robomosp::spatial
