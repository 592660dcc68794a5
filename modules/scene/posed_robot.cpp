// SPDX-License-Identifier: Apache-2.0
#include "scene/posed_robot.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "kernel/text.h"
#include "model/placement.h"
#include "robotics/grip.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "scene/body_shape.h"
#include "scene/ids.h"
#include "scene/leaf_parts.h"
#include "scene/tool_ellipsoids.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::scene {
namespace {

/// Which of a link's designed parts and attached tools its drawables belong to: they come in order,
/// each as many as its record has solids, or others where a solid fails.
void tell_parts(const document::Snapshot& snapshot, const RobotBase& robot, std::size_t body,
                std::span<Element<render::Item>> items) {
  const auto& parts = body == 0 ? robot.record->base_parts : robot.record->links[body - 1].parts;
  const std::size_t tools_from = robot.bodies.tools_from[body];
  const auto assign = [&](std::size_t from, std::size_t to, std::int32_t PartOf::*member,
                          const std::vector<std::pair<std::int32_t, AnyId>>& all) {
    std::size_t at = from;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const auto leaves = leaf_parts(snapshot, all[k].second);
      const bool is_last = k + 1 == all.size();
      for (std::size_t n = 0; at < to && (is_last || n < leaves.size()); ++n, ++at) {
        items[at].of.*member = all[k].first;
        items[at].of.leaf = n < leaves.size() ? static_cast<std::int32_t>(n) : -1;
      }
    }
  };
  std::vector<std::pair<std::int32_t, AnyId>> designed, tools;
  if (!robot.bodies.is_generated[body])
    for (std::size_t p = 0; p < parts.size(); ++p)
      designed.emplace_back(static_cast<std::int32_t>(p), parts[p].what);
  const auto& attached = robot.record->attached;
  for (std::size_t t = 0; t < attached.size(); ++t)
    if (static_cast<std::size_t>(attached[t].link + 1) == body)
      tools.emplace_back(static_cast<std::int32_t>(t), attached[t].what);
  assign(0, tools_from, &PartOf::part, designed);
  assign(tools_from, items.size(), &PartOf::tool, tools);
}

std::string degrees(double angle) {
  return text::print_rounded(angle * 180 / std::numbers::pi, 5) + " deg";
}
std::string millimetres(double length) { return text::print_rounded(1000 * length, 5) + " mm"; }

}  // namespace

double RobotBase::frame_length() const {
  double reach = 0;
  for (const auto& l : record->links)
    reach += l.origin ? spatial::norm(model::position(*l.origin)) : std::hypot(l.row.a, l.row.d);
  return std::clamp(0.07 * reach, 0.03, 0.25);
}

Result<RobotBasePtr> robot_base(const Source& source, RobotId id, Progress& progress) {
  auto r = std::make_shared<RobotBase>();
  r->kept = source.snapshot.share(AnyId(id));
  r->record = source.snapshot.get(id);
  if (!r->record)
    return error(ErrorCode::stale_handle, "the robot no longer exists", "Add it again.");
  RMP_TRY_ASSIGN(r->model,
                 source.derived.robot_model(source.snapshot, id, {0, 0, -9.81}, progress));
  RMP_TRY_ASSIGN(r->bodies, source.derived.robot_bodies(source.snapshot, id, progress));
  r->links = robotics::link_frames(*r->record);
  return RobotBasePtr(std::move(r));
}

PosedRobot::PosedRobot(RobotBasePtr base, const Pose& world_T_mounting)
    : base_(std::move(base)),
      world_T_base_(spatial::compose(world_T_mounting, base_->model->base)),
      joint_frames_(base_->model->joints.size()) {}

void PosedRobot::pose(std::span<const double> q, std::vector<Pose>& bodies) {
  robotics::forward_kinematics(*base_->model, q, joint_frames_);
  const std::size_t links = base_->links.size();
  bodies.resize(links + 2);
  robotics::link_poses(base_->links, joint_frames_, std::span(bodies).subspan(1, links));
  bodies[0] = world_T_base_;
  for (std::size_t i = 1; i <= links; ++i) bodies[i] = spatial::compose(world_T_base_, bodies[i]);
  bodies.back() =
      spatial::compose(world_T_base_, robotics::tip_pose(*base_->model, 0, joint_frames_));
}

Pose PosedRobot::place(const robotics::LinkFrame& at) const {
  return spatial::compose(world_T_base_,
                          robotics::carried(at.joint, at.joint_T_link, joint_frames_));
}

Result<robotics::LinkFrame> PosedRobot::grip_of(const model::Attachment& a) const {
  RMP_TRY_ASSIGN(auto at, robotics::grip_frame(*base_->record, *base_->model, a.link));
  at.joint_T_link = spatial::compose(at.joint_T_link, model::pose(a.tool_T_object));
  return at;
}

std::vector<double> shown_q(const model::Robot& robot, const std::vector<double>& given) {
  if (given.empty()) return robotics::home_joint_values(robot);
  std::vector<double> q = robotics::neutral_coordinates(robot);
  std::copy_n(given.begin(), std::min(given.size(), q.size()), q.begin());
  return q;
}

ShapePtr robot_shape(const document::Snapshot& snapshot, const RobotBase& robot) {
  auto shape = std::make_shared<Shape>();
  const std::size_t bodies = robot.bodies.bodies.size();
  shape->boxes.resize(bodies + 1, empty_box());
  for (std::size_t b = 0; b < bodies; ++b) {
    if (!robot.shows(b)) continue;
    const auto& parts = robot.bodies.bodies[b];
    const std::size_t first = shape->items.size();
    for (std::size_t p = 0; p < parts.size(); ++p) {
      Element<render::Item> e;
      e.what.name = robot.body_name(b);
      e.what.mesh = parts[p].mesh;
      e.what.pose = parts[p].placement;
      e.what.appearance = appearance_of(parts[p]);
      e.body = static_cast<std::int32_t>(b);
      e.group = static_cast<std::uint32_t>(b);
      e.number = static_cast<std::uint32_t>(p);
      e.of.link = e.body;
      if (parts[p].mesh) grow(shape->boxes[b], box_of(*parts[p].mesh, parts[p].placement));
      shape->items.push_back(std::move(e));
    }
    tell_parts(snapshot, robot, b, std::span(shape->items).subspan(first));
  }
  Element<render::Triad> tool;
  tool.what.length = robot.frame_length();
  tool.body = static_cast<std::int32_t>(bodies);
  tool.group = kToolBody;
  shape->triads.push_back(std::move(tool));
  return shape;
}

ShapePtr robot_frames(const RobotBase& robot) {
  auto shape = std::make_shared<Shape>();
  const double length = robot.frame_length();
  for (std::size_t b = 0; b <= robot.links.size(); ++b) {
    Element<render::Triad> e;
    e.what = {0, Pose{}, length, robot.body_name(b), true, {}};
    e.body = static_cast<std::int32_t>(b);
    e.group = kFrameBody;
    e.number = static_cast<std::uint32_t>(b);
    e.of.link = e.body;
    shape->triads.push_back(std::move(e));
  }
  return shape;
}

ShapePtr robot_rows(const RobotBase& robot, std::span<const double> q) {
  auto shape = std::make_shared<Shape>();
  // The parameter that the joint moves: what the row gives, and the joint's value with its sign.
  const auto moved = [&](std::size_t link, model::JointKind kind, auto&& text_of) {
    const std::int32_t joint = robot.links[link].joint;
    if (robot.record->links[link].joint != kind || joint < 0) return std::string();
    const double value =
        spatial::joint_value(robot.model->joints[static_cast<std::size_t>(joint)], q.data());
    return (value < 0 ? " - " : " + ") + text_of(std::fabs(value));
  };
  for (std::size_t i = 0; i < robot.record->links.size(); ++i) {
    const model::Link& l = robot.record->links[i];
    Element<render::Label> e;
    if (l.origin) {
      e.what.text = l.name + ": axis (" + text::print_rounded(l.axis[0], 4) + ", " +
                    text::print_rounded(l.axis[1], 4) + ", " + text::print_rounded(l.axis[2], 4) +
                    ")";
    } else {
      e.what.text = l.name + ": a " + millimetres(l.row.a) + ", alpha " + degrees(l.row.alpha) +
                    ", d " + millimetres(l.row.d) +
                    moved(i, model::JointKind::prismatic, millimetres) + ", theta " +
                    degrees(l.row.theta) + moved(i, model::JointKind::revolute, degrees);
    }
    e.body = static_cast<std::int32_t>(i + 1);
    e.group = kNoteBody;
    e.number = static_cast<std::uint32_t>(i + 1);
    e.of.link = e.body;
    shape->labels.push_back(std::move(e));
  }
  return shape;
}

ShapePtr robot_posed(const PosedRobot& robot, const std::string& owner, const Extras& extras) {
  auto shape = std::make_shared<Shape>();
  const RobotModel& model = *robot.base().model;
  for (render::Item& item :
       tool_ellipsoids("", model, robot.world_T_base(), robot.joint_frames(), extras.ellipsoids)) {
    Element<render::Item> e;
    item.name.erase(0, 1);  // the space behind the robot's name
    e.number = item.name.starts_with("force") ? 1 : 0;
    e.what = std::move(item);
    e.body = kWorldBody;
    e.group = kEllipsoidBody;
    shape->items.push_back(std::move(e));
  }
  if (extras.com) {
    std::vector<MassProperties> masses;
    for (std::size_t j = 0; j < model.joints.size(); ++j)
      if (model.joints[j].body.mass > 0)
        masses.push_back(spatial::in_frame(model.joints[j].body, robot.joint_frames()[j]));
    const MassProperties all = spatial::combine(masses);
    if (all.mass > 0) {
      Element<render::MassMark> e;
      e.what = mass_mark(0, spatial::in_frame(all, robot.world_T_base()));
      e.body = kWorldBody;
      e.group = kMarkBody;
      shape->marks.push_back(std::move(e));
    } else {
      shape->left_out.push_back("robot " + text::quote(owner) +
                                " has no mass, so its centre of mass is not shown.");
    }
  }
  return shape;
}

}  // namespace robomosp::scene
