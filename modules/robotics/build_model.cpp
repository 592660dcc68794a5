// SPDX-License-Identifier: Apache-2.0
#include "robotics/build_model.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "model/placement.h"
#include "robotics/coordinates.h"
#include "robotics/tip_names.h"
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
  if (!has_motor_fields(link.joint) && link.joint != JointKind::fixed) {
    const model::Link none;
    if (link.lower != none.lower || link.upper != none.upper ||
        link.max_velocity != none.max_velocity || link.max_acceleration != none.max_acceleration ||
        link.max_jerk != none.max_jerk || link.max_force != none.max_force ||
        !(link.drive == none.drive) || !(link.spring == none.spring))
      return fault(
          "its joint has coordinates of several kinds, for which limits, drive and spring are not "
          "supported",
          "Leave them out, or make the joint of revolute and prismatic links.");
  }
  if (std::isnan(link.lower) || std::isnan(link.upper))
    return fault("a joint limit is not a number", "Give a number, or leave the limit out.");
  if (link.lower > link.upper)
    return fault("its lower limit " + spatial::print_joint_value(link.lower, type) +
                     " is above its upper limit " + spatial::print_joint_value(link.upper, type),
                 "Swap the two limits.");
  const std::pair<double, const char*> greatest[] = {{link.max_velocity, "velocity"},
                                                     {link.max_acceleration, "acceleration"},
                                                     {link.max_jerk, "jerk"},
                                                     {link.max_force, "force"}};
  for (const auto& [value, what] : greatest)
    if (!(value > 0))
      return fault(std::string("its greatest ") + what + " is " + print_number(value),
                   "It must be positive; leave it out if there is none.");
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

Result<void> check_spring(const model::Spring& spring) {
  if (!std::isfinite(spring.stiffness) || spring.stiffness < 0)
    return fault("its spring's stiffness is " + print_number(spring.stiffness),
                 "A stiffness must be a finite number of at least 0.");
  if (!std::isfinite(spring.rest))
    return fault("its spring rests at " + print_number(spring.rest), "Give a finite number.");
  return {};
}

Result<void> check_mimic(const model::Robot& robot, std::size_t i) {
  const model::Link& link = robot.links[i];
  if (!link.mimic) return {};
  const model::Mimic& mimic = *link.mimic;
  if (!has_one_coordinate(link.joint))
    return fault("its joint follows another one but is neither revolute nor prismatic",
                 "Only a joint of one coordinate can follow another one.");
  if (mimic.link < 0 || mimic.link >= static_cast<std::int32_t>(i))
    return fault("its joint follows that of link " + std::to_string(mimic.link + 1) +
                     ", which does not come before it",
                 "A joint can only follow the joint of an earlier link.");
  if (!has_one_coordinate(robot.links[static_cast<std::size_t>(mimic.link)].joint))
    return fault("its joint follows that of " +
                     link_label(robot, static_cast<std::size_t>(mimic.link)) +
                     ", which is neither revolute nor prismatic",
                 "Only a joint of one coordinate can be followed.");
  if (!std::isfinite(mimic.ratio) || !std::isfinite(mimic.offset))
    return fault("the ratio or offset by which its joint follows is not a finite number",
                 "Correct them.");
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
  if (link.origin) {
    if (!finite(*link.origin))
      return fault("its origin has a value that is not a finite number",
                   "Correct position and angles.");
    if (!spatial::is_finite(link.axis) || !(spatial::norm(link.axis) > 1e-9))
      return fault("its joint's axis has no direction", "Give a vector such as (0, 0, 1).");
  }
  RMP_TRY(check_limits(link));
  RMP_TRY(check_drive(link.drive));
  RMP_TRY(check_spring(link.spring));
  RMP_TRY(check_mimic(robot, i));
  if (link.given) RMP_TRY(check_mass(*link.given, "given"));
  return {};
}

const MassProperties* chosen_mass(const model::Robot& robot, std::size_t i,
                                  std::span<const std::optional<MassProperties>> designed) {
  if (robot.mass_source == model::MassSource::designed && i < designed.size() && designed[i])
    return &*designed[i];
  return robot.links[i].given ? &*robot.links[i].given : nullptr;
}

/// The rotation of least angle that takes z to `axis`, exact for the axes of the frame.
Pose turn_z_to(const Vec3& direction) {
  const Vec3 axis = spatial::unit(direction);
  const Vec3 across{0.0 - axis[1], axis[0], 0};  // z x axis
  const double sine = spatial::norm(across);
  if (sine < 1e-15) return axis[2] > 0 ? Pose{} : spatial::rotation_x(std::numbers::pi);
  if (axis[1] == 0) return spatial::rotation_y(std::atan2(axis[0], axis[2]));
  if (axis[0] == 0) return spatial::rotation_x(std::atan2(0.0 - axis[1], axis[2]));
  Pose t;
  t.R = spatial::from_axis_angle(across, std::atan2(sine, axis[2]));
  return t;
}

/// Where a link's joint stands, and the link on it, by its origin or its row.
RowPoses joint_poses(const model::Robot& robot, std::size_t i) {
  const model::Link& link = robot.links[i];
  if (!link.origin) return row_poses(link.convention.value_or(robot.convention), link.row);
  const Pose origin = model::pose(*link.origin);
  const bool has_axis = link.joint != JointKind::fixed && link.joint != JointKind::spherical &&
                        link.joint != JointKind::free;
  if (!has_axis) return {origin, Pose{}};
  const Pose turn = turn_z_to(link.axis);
  return {spatial::compose(origin, turn), spatial::inverse(turn)};
}

/// The joints of one coordinate (or the native one) that make up a joint kind: each stands turned
/// against the one before, or the joint's place, and `back` turns the last one upright again.
struct Sequence {
  struct Step {
    JointType type;
    Pose turn;
    const char* suffix;
  };
  std::vector<Step> steps;
  Pose back;
};

Sequence sequence_of(JointKind kind) {
  const Pose z_to_x = spatial::rotation_y(std::numbers::pi / 2),
             x_to_z = spatial::rotation_y(-std::numbers::pi / 2),
             z_to_y = spatial::rotation_x(-std::numbers::pi / 2),
             y_to_z = spatial::rotation_x(std::numbers::pi / 2);
  switch (kind) {
    case JointKind::revolute: return {{{JointType::revolute, {}, ""}}, {}};
    case JointKind::prismatic: return {{{JointType::prismatic, {}, ""}}, {}};
    case JointKind::fixed: return {};
    case JointKind::universal:
      return {{{JointType::revolute, {}, " about z"}, {JointType::revolute, z_to_x, " about x"}},
              x_to_z};
    case JointKind::cylindrical:
      return {{{JointType::prismatic, {}, " along z"}, {JointType::revolute, {}, " about z"}}, {}};
    case JointKind::planar:
      return {{{JointType::prismatic, z_to_x, " along x"},
               {JointType::prismatic, spatial::compose(x_to_z, z_to_y), " along y"},
               {JointType::revolute, y_to_z, " about z"}},
              {}};
    case JointKind::spherical: return {{{JointType::spherical, {}, ""}}, {}};
    case JointKind::free: return {{{JointType::free, {}, ""}}, {}};
  }
  return {};
}

/// Limits, motor, friction and spring of a link's joint.
void put_motor(JointModel& joint, const model::Link& link) {
  joint.lower = link.lower;
  joint.upper = link.upper;
  joint.max_velocity = link.max_velocity;
  joint.max_acceleration = link.max_acceleration;
  joint.max_jerk = link.max_jerk;
  joint.max_force = link.max_force;
  const double g = link.drive.gear_ratio;
  joint.armature = g * g * link.drive.motor_inertia;
  joint.friction = {g * g * link.drive.viscous, std::fabs(g) * link.drive.coulomb_positive,
                    std::fabs(g) * link.drive.coulomb_negative};
  joint.spring = {link.spring.stiffness, link.spring.rest};
}

/// Adds the joints of link i; all but the last carry nothing.
void add_joints(const model::Robot& robot, std::size_t i, const LinkFrame& parent,
                std::vector<JointModel>& joints) {
  const model::Link& link = robot.links[i];
  const RowPoses row = joint_poses(robot, i);
  const Sequence sequence = sequence_of(link.joint);
  Pose place = spatial::compose(parent.joint_T_link, row.parent_T_joint);
  std::int32_t below = parent.joint;
  for (const Sequence::Step& step : sequence.steps) {
    JointModel joint;
    if (!link.name.empty()) joint.name = link.name + step.suffix;
    joint.type = step.type;
    joint.parent = below;
    joint.placement = spatial::compose(place, step.turn);
    joint.passive = link.passive;
    if (has_motor_fields(link.joint)) put_motor(joint, link);
    below = static_cast<std::int32_t>(joints.size());
    place = Pose{};
    joints.push_back(std::move(joint));
    if (joints.back().name.empty()) joints.back().name = "joint " + std::to_string(joints.size());
  }
  if (!sequence.steps.empty())
    joints.back().link = spatial::compose(sequence.back, row.joint_T_link);
}

/// The coupling of link i's joint to one that has a coordinate of its own.
JointCoupling coupling_of(const model::Robot& robot, std::size_t i,
                          std::span<const LinkJoints> joints) {
  JointCoupling coupling;
  const model::Link* link = &robot.links[i];
  while (link->mimic) {
    // q = ratio (inner.ratio q' + inner.offset) + offset
    coupling.offset += coupling.ratio * link->mimic->offset;
    coupling.ratio *= link->mimic->ratio;
    const auto of = static_cast<std::size_t>(link->mimic->link);
    coupling.of = joints[of].joint;
    link = &robot.links[of];
  }
  return coupling;
}

LinkFrame frame_of(const model::Robot& robot, std::size_t i, std::span<const LinkFrame> before,
                   const LinkJoints& joints) {
  const model::Link& link = robot.links[i];
  const RowPoses row = joint_poses(robot, i);
  if (link.joint != JointKind::fixed)
    return {joints.joint + joints.joint_count - 1,
            spatial::compose(sequence_of(link.joint).back, row.joint_T_link)};
  const LinkFrame parent =
      link.parent < 0 ? LinkFrame{} : before[static_cast<std::size_t>(link.parent)];
  return {parent.joint, spatial::compose(spatial::compose(parent.joint_T_link, row.parent_T_joint),
                                         row.joint_T_link)};
}

LinkFrame at_link(std::span<const LinkFrame> frames, std::int32_t link) {
  return link < 0 ? LinkFrame{} : frames[static_cast<std::size_t>(link)];
}

/// A frame given on a link, on the joint that carries the link.
LinkFrame on_link(std::span<const LinkFrame> frames, std::int32_t link,
                  const model::Placement& placement) {
  const LinkFrame at = at_link(frames, link);
  return {at.joint, spatial::compose(at.joint_T_link, model::pose(placement))};
}

Result<void> check_tools(const model::Robot& robot) {
  if (robot.payload)
    if (auto checked = check_mass(*robot.payload, "payload's"); !checked)
      return std::move(checked).error().in("the tool");
  for (const model::RobotTool& tool : robot.tools) {
    const std::string where = "tool \"" + tool.name + "\"";
    if (tool.link < -1 || tool.link >= static_cast<std::int32_t>(robot.links.size()))
      return fault("it is attached to link " + std::to_string(tool.link + 1) +
                       ", which does not exist",
                   "Name a link of the robot, or the base.")
          .in(where);
    if (!finite(tool.placement))
      return fault("its placement is not finite", "Correct position and angles.").in(where);
    if (tool.payload)
      if (auto checked = check_mass(*tool.payload, "payload's"); !checked)
        return std::move(checked).error().in(where);
  }
  return {};
}

std::uint32_t fixed_directions(model::LoopKind kind) {
  switch (kind) {
    case model::LoopKind::point: return kLoopPoint;
    case model::LoopKind::revolute: return kLoopRevolute;
    case model::LoopKind::planar: return kLoopX | kLoopY;
    case model::LoopKind::weld: return kLoopWeld;
  }
  return kLoopWeld;
}

Result<std::vector<LoopModel>> make_loops(const model::Robot& robot,
                                          std::span<const LinkFrame> frames) {
  std::vector<LoopModel> loops;
  const auto count = static_cast<std::int32_t>(robot.links.size());
  for (const model::LoopClosure& loop : robot.loops) {
    const std::string where = "loop \"" + loop.name + "\"";
    for (const std::int32_t link : {loop.link_a, loop.link_b})
      if (link < -1 || link >= count)
        return fault("it refers to link " + std::to_string(link + 1) + ", which does not exist",
                     "Name two links of the robot, or a link and the base.")
            .in(where);
    if (!finite(loop.in_a) || !finite(loop.in_b))
      return fault("one of its frames is not finite", "Correct position and angles.").in(where);
    const LinkFrame a = on_link(frames, loop.link_a, loop.in_a),
                    b = on_link(frames, loop.link_b, loop.in_b);
    if (a.joint == b.joint)
      return fault("both of its links move together, so it has no effect",
                   "Name two links that move relative to each other.")
          .in(where);
    loops.push_back(
        {loop.name, a.joint, b.joint, a.joint_T_link, b.joint_T_link, fixed_directions(loop.kind)});
  }
  return loops;
}

std::vector<TipModel> make_tips(const model::Robot& robot, std::span<const LinkFrame> frames) {
  const std::vector<bool> is_leaf = leaf_links(robot);
  const std::size_t last = robot.links.size() - 1;
  std::vector<TipModel> tips;
  tips.push_back({"tool", frames[last].joint,
                  spatial::compose(frames[last].joint_T_link, model::pose(robot.tool))});
  for (std::size_t i = 0; i < last; ++i) {
    if (!is_leaf[i]) continue;
    tips.push_back({leaf_tip_name(robot, i), frames[i].joint, frames[i].joint_T_link});
  }
  for (const model::RobotTool& tool : robot.tools) {
    const LinkFrame at = on_link(frames, tool.link, tool.placement);
    tips.push_back({tool.name, at.joint, at.joint_T_link});
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
                                     Vec3 gravity_in_mounting_frame, const Progress* progress) {
  const std::string where = "robot \"" + name + "\"";
  if (robot.links.empty()) return fault("it has no links", "Add a link with its joint.").in(where);
  if (!link_masses.empty() && link_masses.size() != robot.links.size())
    return fault("designed masses were given for " + std::to_string(link_masses.size()) +
                     " of its " + std::to_string(robot.links.size()) + " links",
                 "Give one entry per link, empty if nothing is designed.")
        .in(where);
  if (!finite(robot.base) || !finite(robot.tool))
    return fault("the placement of its base or tool is not finite", "Correct position and angles.")
        .in(where);
  if (!spatial::is_finite(gravity_in_mounting_frame))
    return fault("the gravity that acts on it is not finite", "Correct the world's gravity.")
        .in(where);

  if (auto checked = check_tools(robot); !checked) return std::move(checked).error().in(where);

  RobotModel out;
  out.name = name;
  out.base = model::pose(robot.base);
  out.gravity = spatial::rotate_back(out.base, gravity_in_mounting_frame);
  const std::vector<LinkJoints> joints = link_joints(robot);
  std::vector<LinkFrame> frames;
  frames.reserve(robot.links.size());
  std::vector<std::vector<MassProperties>> bodies;
  const auto carry = [&](const MassProperties& mass, const LinkFrame& at) {
    if (at.joint >= 0)
      bodies[static_cast<std::size_t>(at.joint)].push_back(
          spatial::in_frame(mass, at.joint_T_link));
  };
  const auto is_stopped = [progress](std::size_t i) {
    constexpr std::size_t kLook = 256;
    return progress && i % kLook == 0 && progress->cancelled();
  };
  const auto stopped = [&where] {
    return error(ErrorCode::cancelled, "its model was not built: cancelled").in(where);
  };
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    if (is_stopped(i)) return stopped();
    const model::Link& link = robot.links[i];
    const MassProperties* mass = chosen_mass(robot, i, link_masses);
    Result<void> checked = check_link(robot, i);
    if (checked && mass)
      checked =
          check_mass(*mass, mass == (link.given ? &*link.given : nullptr) ? "given" : "designed");
    if (!checked) return std::move(checked).error().in(link_label(robot, i)).in(where);
    frames.push_back(frame_of(robot, i, frames, joints[i]));
    add_joints(robot, i, at_link(frames, link.parent), out.joints);
    if (link.mimic) out.joints.back().coupling = coupling_of(robot, i, joints);
    bodies.resize(out.joints.size());
    if (mass) carry(*mass, frames.back());
  }
  if (out.joints.empty())
    return fault("all its links are fixed", "Give at least one link a joint that moves.").in(where);
  if (robot.payload)
    carry(*robot.payload,
          on_link(frames, static_cast<std::int32_t>(robot.links.size()) - 1, robot.tool));
  for (const model::RobotTool& tool : robot.tools)
    if (tool.payload) carry(*tool.payload, on_link(frames, tool.link, tool.placement));
  for (std::size_t j = 0; j < bodies.size(); ++j) {
    if (is_stopped(j)) return stopped();
    out.joints[j].body = spatial::combine(bodies[j]);
  }
  out.number_coordinates();
  out.tips = make_tips(robot, frames);
  auto loops = make_loops(robot, frames);
  if (!loops.ok()) return std::move(loops).error().in(where);
  out.loops = std::move(loops).value();
  return out;
}

std::vector<LinkFrame> link_frames(const model::Robot& robot) {
  std::vector<LinkFrame> frames;
  frames.reserve(robot.links.size());
  const std::vector<LinkJoints> joints = link_joints(robot);
  for (std::size_t i = 0; i < robot.links.size(); ++i)
    frames.push_back(frame_of(robot, i, frames, joints[i]));
  return frames;
}

std::vector<std::int32_t> moving_links(const model::Robot& robot) {
  std::vector<std::int32_t> links;
  const std::vector<LinkJoints> joints = link_joints(robot);
  for (std::size_t i = 0; i < joints.size(); ++i)
    links.insert(links.end(), static_cast<std::size_t>(joints[i].joint_count),
                 static_cast<std::int32_t>(i));
  return links;
}

RowPoses link_joint_poses(const model::Robot& robot, std::size_t link) {
  return joint_poses(robot, link);
}

}  // namespace robomosp::robotics
