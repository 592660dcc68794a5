// SPDX-License-Identifier: Apache-2.0
#include "robotics/build_model.h"

#include <cmath>
#include <utility>

#include "model/placement.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "spatial/print.h"

namespace robomosp::robotics {
namespace {

using model::JointKind;
using spatial::print_number;

std::string link_label(const model::Robot& robot, std::size_t i) {
  std::string s = "link " + std::to_string(i + 1);
  if (!robot.links[i].name.empty()) s += " \"" + robot.links[i].name + "\"";
  return s;
}

bool finite(const model::DhRow& r) {
  return std::isfinite(r.a) && std::isfinite(r.alpha) && std::isfinite(r.d) &&
         std::isfinite(r.theta);
}
bool finite(const model::Placement& p) {
  return spatial::is_finite(p.position) && spatial::is_finite(p.angles);
}

Error fault(std::string message, std::string hint) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

Result<void> check_drive(const model::Drive& d) {
  if (!std::isfinite(d.motor_inertia) || !std::isfinite(d.gear_ratio) ||
      !std::isfinite(d.viscous) || !std::isfinite(d.coulomb_positive) ||
      !std::isfinite(d.coulomb_negative))
    return fault("its drive has a value that is not a finite number",
                 "Correct motor inertia, gear ratio and friction.");
  if (d.motor_inertia < 0)
    return fault("its motor inertia is " + print_number(d.motor_inertia) + " kg m^2",
                 "A motor's inertia cannot be negative.");
  if (d.viscous < 0)
    return fault("its viscous friction is " + print_number(d.viscous) + " N m s/rad",
                 "Friction that drives the joint is not possible; give a value of at least 0.");
  if (d.coulomb_positive < 0 || d.coulomb_negative > 0)
    return fault("its Coulomb friction is " + print_number(d.coulomb_positive) + " forward and " +
                     print_number(d.coulomb_negative) + " N m backward",
                 "The forward value must be at least 0 and the backward value at most 0.");
  return {};
}

Result<void> check_limits(const model::Link& link) {
  const JointType type =
      link.joint == JointKind::prismatic ? JointType::prismatic : JointType::revolute;
  if (std::isnan(link.lower) || std::isnan(link.upper))
    return fault("a joint limit is not a number", "Give a number, or leave the limit out.");
  if (link.lower > link.upper)
    return fault("its lower limit " + spatial::print_joint_value(link.lower, type) +
                     " is above its upper limit " + spatial::print_joint_value(link.upper, type),
                 "Exchange the two limits.");
  const std::pair<double, const char*> greatest[] = {{link.max_velocity, "velocity"},
                                                     {link.max_acceleration, "acceleration"},
                                                     {link.max_force, "force"}};
  for (const auto& [value, what] : greatest)
    if (!(value > 0))
      return fault(std::string("its greatest ") + what + " is " + print_number(value),
                   "It must be positive; leave it out where there is none.");
  return {};
}

Result<void> check_mass(const MassProperties& m, const char* kind) {
  if (!spatial::is_finite(m))
    return fault(std::string("its ") + kind + " mass properties have a value that is not finite",
                 "Correct mass, centre of mass and inertia.");
  if (m.mass < 0)
    return fault(std::string("its ") + kind + " mass is " + print_number(m.mass) + " kg",
                 "A mass cannot be negative.");
  return {};
}

Result<void> check_link(const model::Robot& robot, std::size_t i) {
  const model::Link& link = robot.links[i];
  if (link.parent < -1 || link.parent >= static_cast<std::int32_t>(i))
    return fault(
        "its parent is link " + std::to_string(link.parent + 1) + ", which does not come before it",
        "Order the links so that parents come first; the base is parent 0.");
  if (!finite(link.row))
    return fault("its row has a value that is not a finite number",
                 "Correct a, alpha, d and theta.");
  RMP_TRY(check_limits(link));
  RMP_TRY(check_drive(link.drive));
  if (link.given) RMP_TRY(check_mass(*link.given, "given"));
  return {};
}

const MassProperties* chosen_mass(const model::Robot& robot, std::size_t i,
                                  std::span<const std::optional<MassProperties>> designed) {
  if (robot.mass_source == model::MassSource::designed && i < designed.size() && designed[i])
    return &*designed[i];
  return robot.links[i].given ? &*robot.links[i].given : nullptr;
}

JointModel make_joint(const model::Link& link, const RowPoses& row, const LinkFrame& parent) {
  JointModel joint;
  joint.name = link.name;
  joint.type = link.joint == JointKind::prismatic ? JointType::prismatic : JointType::revolute;
  joint.parent = parent.joint;
  joint.placement = spatial::compose(parent.joint_T_link, row.parent_T_joint);
  joint.link = row.joint_T_link;
  joint.lower = link.lower;
  joint.upper = link.upper;
  joint.max_velocity = link.max_velocity;
  joint.max_acceleration = link.max_acceleration;
  joint.max_force = link.max_force;
  const double g = link.drive.gear_ratio;
  joint.armature = g * g * link.drive.motor_inertia;
  joint.friction = {g * g * link.drive.viscous, std::fabs(g) * link.drive.coulomb_positive,
                    std::fabs(g) * link.drive.coulomb_negative};
  return joint;
}

LinkFrame frame_of(const model::Robot& robot, std::size_t i, std::span<const LinkFrame> before,
                   std::int32_t next_joint) {
  const model::Link& link = robot.links[i];
  const RowPoses row = row_poses(robot.convention, link.row);
  if (link.joint != JointKind::fixed) return {next_joint, row.joint_T_link};
  const LinkFrame parent =
      link.parent < 0 ? LinkFrame{} : before[static_cast<std::size_t>(link.parent)];
  return {parent.joint, spatial::compose(spatial::compose(parent.joint_T_link, row.parent_T_joint),
                                         row.joint_T_link)};
}

std::vector<TipModel> make_tips(const model::Robot& robot, std::span<const LinkFrame> frames) {
  std::vector<bool> is_leaf(robot.links.size(), true);
  for (const model::Link& link : robot.links)
    if (link.parent >= 0) is_leaf[static_cast<std::size_t>(link.parent)] = false;
  const std::size_t last = robot.links.size() - 1;
  std::vector<TipModel> tips;
  tips.push_back({"tool", frames[last].joint,
                  spatial::compose(frames[last].joint_T_link, model::pose(robot.tool))});
  for (std::size_t i = 0; i < last; ++i) {
    if (!is_leaf[i]) continue;
    const std::string& name = robot.links[i].name;
    tips.push_back({name.empty() ? "link " + std::to_string(i + 1) : name, frames[i].joint,
                    frames[i].joint_T_link});
  }
  return tips;
}

}  // namespace

RowPoses row_poses(model::Convention convention, const model::DhRow& row) {
  if (convention == model::Convention::dh)
    return {spatial::dh_pose(0, 0, row.d, row.theta), spatial::dh_pose(row.a, row.alpha, 0, 0)};
  return {spatial::mdh_pose(row.a, row.alpha, row.d, row.theta), Pose{}};
}

Result<RobotModel> build_robot_model(const std::string& name, const model::Robot& robot,
                                     std::span<const std::optional<MassProperties>> link_masses,
                                     Vec3 gravity_in_mounting_frame) {
  const std::string where = "robot \"" + name + "\"";
  if (robot.links.empty()) return fault("it has no links", "Add a link with its joint.").in(where);
  if (!link_masses.empty() && link_masses.size() != robot.links.size())
    return fault("designed masses were given for " + std::to_string(link_masses.size()) +
                     " of its " + std::to_string(robot.links.size()) + " links",
                 "Give one entry a link, empty where nothing is designed.")
        .in(where);
  if (!finite(robot.base) || !finite(robot.tool))
    return fault("the placement of its base or tool is not finite", "Correct position and angles.")
        .in(where);
  if (!spatial::is_finite(gravity_in_mounting_frame))
    return fault("the gravity it stands in is not finite", "Correct the world's gravity.")
        .in(where);

  RobotModel out;
  out.name = name;
  out.base = model::pose(robot.base);
  out.gravity = spatial::rotate_back(out.base, gravity_in_mounting_frame);
  std::vector<LinkFrame> frames;
  frames.reserve(robot.links.size());
  std::vector<std::vector<MassProperties>> bodies;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const model::Link& link = robot.links[i];
    const MassProperties* mass = chosen_mass(robot, i, link_masses);
    Result<void> checked = check_link(robot, i);
    if (checked && mass)
      checked =
          check_mass(*mass, mass == (link.given ? &*link.given : nullptr) ? "given" : "designed");
    if (!checked) return std::move(checked).error().in(link_label(robot, i)).in(where);
    frames.push_back(frame_of(robot, i, frames, static_cast<std::int32_t>(out.joints.size())));
    if (link.joint != JointKind::fixed) {
      const LinkFrame parent =
          link.parent < 0 ? LinkFrame{} : frames[static_cast<std::size_t>(link.parent)];
      out.joints.push_back(make_joint(link, row_poses(robot.convention, link.row), parent));
      if (out.joints.back().name.empty())
        out.joints.back().name = "joint " + std::to_string(out.joints.size());
      bodies.emplace_back();
    }
    const LinkFrame& frame = frames.back();
    if (mass && frame.joint >= 0)
      bodies[static_cast<std::size_t>(frame.joint)].push_back(
          spatial::in_frame(*mass, frame.joint_T_link));
  }
  if (out.joints.empty())
    return fault("all its links are fixed", "Give at least one link a revolute or prismatic joint.")
        .in(where);
  for (std::size_t j = 0; j < bodies.size(); ++j) out.joints[j].body = spatial::combine(bodies[j]);
  out.number_coordinates();
  out.tips = make_tips(robot, frames);
  return out;
}

std::vector<LinkFrame> link_frames(const model::Robot& robot) {
  std::vector<LinkFrame> frames;
  frames.reserve(robot.links.size());
  std::int32_t joints = 0;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    frames.push_back(frame_of(robot, i, frames, joints));
    if (robot.links[i].joint != JointKind::fixed) ++joints;
  }
  return frames;
}

std::vector<std::int32_t> moving_links(const model::Robot& robot) {
  std::vector<std::int32_t> links;
  for (std::size_t i = 0; i < robot.links.size(); ++i)
    if (robot.links[i].joint != JointKind::fixed) links.push_back(static_cast<std::int32_t>(i));
  return links;
}

}  // namespace robomosp::robotics
