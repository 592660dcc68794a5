// SPDX-License-Identifier: Apache-2.0
// Coordinates of a robot record: which numbers of q, qd and which joints of the model belong to
// which link, their units, and the neutral configuration (layer: data processing, robotics).
// Works on any record, also on one that build_robot_model refuses. [any thread]
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/robot_model.h>

#include "model/records.h"

namespace robomosp::robotics {

/// What of the model belongs to a link: ranges of RobotModel::joints, of q, and of qd and tau.
struct LinkJoints {
  std::int32_t joint = 0, joint_count = 0;  ///< count 0: the link is fixed
  std::int32_t q = 0, q_count = 0;          ///< count 0 as well: the joint follows another one
  std::int32_t v = 0, v_count = 0;
};

/// One entry a link, in the order of the record.
[[nodiscard]] std::vector<LinkJoints> link_joints(const model::Robot& robot);

/// SI units of the entries of q: "rad", "m", or "" for a quaternion's.
[[nodiscard]] std::vector<std::string_view> coordinate_units(const model::Robot& robot);
/// SI units of the entries of qd times a second: "rad" or "m". Those of tau are N m and N.
[[nodiscard]] std::vector<std::string_view> velocity_units(const RobotModel& model);
/// SI units of the entries of q, from the model.
[[nodiscard]] std::vector<std::string_view> coordinate_units(const RobotModel& model);
[[nodiscard]] std::vector<std::string_view> coordinate_units(std::span<const JointModel> joints);

/// "1 moving joint", "6 moving joints"; "7 coordinates" where joints are not of one each.
[[nodiscard]] std::string counted_coordinates(const model::Robot& robot);

/// All zeros, quaternions 1 0 0 0: coordinate_count() numbers.
[[nodiscard]] std::vector<double> neutral_coordinates(const model::Robot& robot);
[[nodiscard]] std::vector<double> neutral_coordinates(const RobotModel& model);

/// True when a link's joint has the limits, motor and spring of a link: joints of one kind of
/// coordinate (a universal joint has them on either axis).
[[nodiscard]] constexpr bool has_motor_fields(model::JointKind kind) {
  return kind == model::JointKind::revolute || kind == model::JointKind::prismatic ||
         kind == model::JointKind::universal;
}
/// revolute or prismatic: what can follow another joint, or be followed.
[[nodiscard]] constexpr bool has_one_coordinate(model::JointKind kind) {
  return kind == model::JointKind::revolute || kind == model::JointKind::prismatic;
}

}  // namespace robomosp::robotics
