// SPDX-License-Identifier: Apache-2.0
#include "robotics/coordinates.h"

#include <span>

namespace robomosp::robotics {
namespace {

using model::JointKind;

struct KindCounts {
  std::int32_t joints;
  std::string_view coordinates;  ///< a letter each: r rad, m metre, 1 part of a quaternion
  std::int32_t velocities;
};

KindCounts counts_of(JointKind kind) {
  switch (kind) {
    case JointKind::revolute: return {1, "r", 1};
    case JointKind::prismatic: return {1, "m", 1};
    case JointKind::fixed: return {0, "", 0};
    case JointKind::universal: return {2, "rr", 2};
    case JointKind::cylindrical: return {2, "mr", 2};
    case JointKind::planar: return {3, "mmr", 3};
    case JointKind::spherical: return {1, "1111", 3};
    case JointKind::free: return {1, "mmm1111", 6};
  }
  return {0, "", 0};
}

std::string_view unit_of(char letter) { return letter == 'r' ? "rad" : letter == 'm' ? "m" : ""; }

std::string_view letters_of(JointType type) {
  switch (type) {
    case JointType::revolute: return "r";
    case JointType::prismatic: return "m";
    case JointType::spherical: return "1111";
    case JointType::free: return "mmm1111";
  }
  return "";
}

/// A quaternion's first number is 1 where the unit is none and the one before is not of it.
std::vector<double> neutral(std::span<const std::string_view> units) {
  std::vector<double> q(units.size(), 0.0);
  for (std::size_t i = 0; i < q.size();) {
    if (!units[i].empty()) {
      ++i;
      continue;
    }
    q[i] = 1;
    i += 4;
  }
  return q;
}

}  // namespace

std::vector<LinkJoints> link_joints(const model::Robot& robot) {
  std::vector<LinkJoints> out;
  out.reserve(robot.links.size());
  LinkJoints next;
  for (const model::Link& link : robot.links) {
    const KindCounts counts = counts_of(link.joint);
    next.joint_count = counts.joints;
    next.q_count = link.mimic ? 0 : static_cast<std::int32_t>(counts.coordinates.size());
    next.v_count = link.mimic ? 0 : counts.velocities;
    out.push_back(next);
    next.joint += next.joint_count;
    next.q += next.q_count;
    next.v += next.v_count;
  }
  return out;
}

std::vector<std::string_view> coordinate_units(const model::Robot& robot) {
  std::vector<std::string_view> units;
  for (const model::Link& link : robot.links)
    if (!link.mimic)
      for (const char c : counts_of(link.joint).coordinates) units.push_back(unit_of(c));
  return units;
}

std::vector<std::string_view> coordinate_units(const RobotModel& model) {
  return coordinate_units(std::span<const JointModel>(model.joints));
}

std::vector<std::string_view> coordinate_units(std::span<const JointModel> joints) {
  std::vector<std::string_view> units;
  units.reserve(joints.size());
  for (const JointModel& joint : joints)
    if (!joint.is_coupled())
      for (const char c : letters_of(joint.type)) units.push_back(unit_of(c));
  return units;
}

std::vector<std::string_view> velocity_units(const RobotModel& model) {
  std::vector<std::string_view> units;
  for (const JointModel& joint : model.joints) {
    if (joint.is_coupled()) continue;
    const std::int32_t n = velocity_count(joint.type);
    for (std::int32_t k = 0; k < n; ++k)
      units.push_back(joint.type == JointType::prismatic || (joint.type == JointType::free && k < 3)
                          ? "m"
                          : "rad");
  }
  return units;
}

std::string counted_coordinates(const model::Robot& robot) {
  const std::size_t count = coordinate_units(robot).size();
  bool is_plain = true;
  for (const model::Link& link : robot.links)
    is_plain = is_plain && !link.mimic &&
               (link.joint == JointKind::fixed || has_one_coordinate(link.joint));
  return std::to_string(count) + (is_plain ? " moving joint" : " coordinate") +
         (count == 1 ? "" : "s");
}

std::vector<double> neutral_coordinates(const model::Robot& robot) {
  return neutral(coordinate_units(robot));
}
std::vector<double> neutral_coordinates(const RobotModel& model) {
  return neutral(coordinate_units(model));
}

}  // namespace robomosp::robotics
