// SPDX-License-Identifier: Apache-2.0
#include "exchange/export_items.h"

#include <algorithm>

#include "evaluation/attached_tools.h"
#include "evaluation/derived.h"
#include "kernel/text.h"
#include "model/placement.h"
#include "model/solid_edit.h"
#include "robotics/build_model.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::exchange {
namespace {

constexpr std::size_t kMostItems = 100000;

}  // namespace

Result<void> ExportItems::add(AnyId id, const std::string& name, const Pose& pose,
                              std::int32_t parent) {
  struct Open {
    AnyId what;
    std::string name;
    Pose pose;
    std::int32_t parent;
    MaterialId material;
  };
  std::vector<Open> stack{{id, name, pose, parent, {}}};
  while (!stack.empty()) {
    const Open open = std::move(stack.back());
    stack.pop_back();
    if (items.size() >= kMostItems)
      return error(ErrorCode::unsupported, "there are more than 100000 parts to export",
                   "Export them in groups.");
    if (open.what.kind == Kind::solid) {
      RMP_TRY(
          add_solid(SolidId{open.what.number}, open.name, open.pose, open.parent, open.material));
      continue;
    }
    const auto* object = with_.from.snapshot.get(ObjectId{open.what.number});
    if (!object) continue;
    const std::int32_t self = group(open.name, open.pose, open.parent);
    for (std::size_t i = object->parts.size(); i-- > 0;) {
      const model::ObjectPart& p = object->parts[i];
      // The outermost material given wins, as in masses.
      stack.push_back({p.what, p.name, model::pose(p.placement), self,
                       open.material.number ? open.material : p.material});
    }
  }
  return {};
}

Result<void> ExportItems::add_robot(RobotId id, const std::string& name,
                                    const Pose& world_T_mounting, std::vector<double> q) {
  const model::Robot& robot = *with_.from.snapshot.get(id);
  RMP_TRY_ASSIGN(const auto model, with_.from.derived.robot_model(with_.from.snapshot, id,
                                                                  {0, 0, -9.81}, with_.progress));
  if (q.size() != model->coordinate_count()) q = robotics::home_joint_values(robot);
  std::vector<Pose> joints(model->joints.size());
  const auto links = robotics::link_frames(robot);
  std::vector<Pose> frames(links.size());
  robotics::forward_kinematics(*model, q, joints);
  robotics::link_poses(links, joints, frames);
  const std::int32_t self = group(name, spatial::compose(world_T_mounting, model->base), -1);
  ExportRobot one;
  one.name = name;
  one.model = model.get();
  one.pose = spatial::compose(world_T_mounting, model->base);
  one.q = q;
  RMP_TRY_ASSIGN(const model::Robot equipped,
                 evaluation::with_tool_frames(with_.from.snapshot, name, robot));
  mechanisms_.push_back(mechanism_of(equipped, robot));
  set_mechanism(one, &mechanisms_.back());
  RMP_TRY_ASSIGN(const auto standing,
                 with_.from.derived.standing_mass(with_.from.snapshot, id, with_.progress));
  if (standing) {
    masses_.push_back(spatial::in_frame(*standing, spatial::inverse(model->base)));
    set_standing_mass(one, &masses_.back());
  }
  robots.push_back(std::move(one));
  models_.push_back(model);
  if (!wants_bodies) return {};
  RMP_TRY_ASSIGN(auto bodies,
                 with_.from.derived.robot_bodies(with_.from.snapshot, id, with_.progress));
  std::vector<std::string> inexact, hidden, drawn;
  for (std::size_t b = 0; b < bodies.bodies.size(); ++b) {
    const std::string& part = b == 0 ? std::string("base") : robot.links[b - 1].name;
    const Pose at = b == 0 ? Pose{} : frames[b - 1];
    const ItemOfRobot link{static_cast<std::int32_t>(robots.size()) - 1,
                           b == 0 ? -1 : links[b - 1].joint};
    const auto number = static_cast<std::int32_t>(b) - 1;
    std::int32_t body = -1;
    const auto open = [&] {
      if (body < 0) body = group(part, at, self, link, number);
    };
    const auto add_tools = [&]() -> Result<void> {
      for (const model::AttachedTool& t : robot.attached) {
        if (t.link != number) continue;
        open();
        RMP_TRY(add(t.what, t.name, model::pose(t.placement), body));
      }
      return {};
    };
    if (bodies.is_generated[b]) {
      if (bodies.tools_from[b] > 0 && wants_exact_) inexact.push_back(text::quote(part));
      const std::size_t own = wants_exact_ ? 0 : bodies.tools_from[b];
      if (own > 0) {
        drawn.push_back(text::quote(part));
        open();
      }
      for (std::size_t k = 0; k < own; ++k) {
        evaluation::Drawable& d = bodies.bodies[b][k];
        ExportItem item;
        item.name = d.name.empty() ? part : d.name;
        item.parent = body;
        item.pose = d.placement;
        item.colour = d.colour;
        item.mesh = keep(d.mesh);
        set_only_drawn(item);
        items.push_back(std::move(item));
      }
      RMP_TRY(add_tools());
      continue;
    }
    const auto& parts = b == 0 ? robot.base_parts : robot.links[b - 1].parts;
    if (!parts.empty() && b > 0 && !robot.links[b - 1].visible) {
      hidden.push_back(text::quote(part));
    } else if (!parts.empty()) {
      open();
      for (const model::BodyPart& p : parts)
        RMP_TRY(
            add(p.what, with_.from.snapshot.find(p.what)->name, model::pose(p.placement), body));
    }
    RMP_TRY(add_tools());
  }
  if (!inexact.empty())
    notes.push_back("Robot " + text::quote(name) + " has no designed bodies for " +
                    text::enumerate_some(inexact, 6) +
                    "; what is drawn there is not exact and was left out.");
  if (!drawn.empty() && chord_ > 0)
    notes.push_back("The chord does not hold for what is drawn of robot " + text::quote(name) +
                    " where nothing is designed: " + text::enumerate_some(drawn, 6) + ".");
  if (!hidden.empty())
    notes.push_back("Links of robot " + text::quote(name) +
                    " that are not visible were left out: " + text::enumerate_some(hidden, 6) +
                    ".");
  return {};
}

Result<void> ExportItems::cut(const Pose& plane) {
  std::vector<Pose> poses;
  std::vector<ExportItem> outlines;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const ExportItem& item = items[i];
    poses.push_back(item.parent < 0 ? item.pose
                                    : spatial::compose(poses[static_cast<std::size_t>(item.parent)],
                                                       item.pose));
    if (solids_[i].number == 0) continue;
    const Pose solid_T_plane = spatial::compose(spatial::inverse(poses[i]), plane);
    const double chord = chord_ > 0 ? chord_ : with_.from.snapshot.get(solids_[i])->chord;
    RMP_TRY_ASSIGN(const auto profile,
                   with_.from.derived.section(with_.from.snapshot, solids_[i], solid_T_plane, chord,
                                              with_.progress));
    if (profile->loops.empty()) continue;
    ExportItem outline;
    outline.name = item.name;
    outline.colour = item.colour;
    outline.profile = profile.get();
    profiles_.push_back(profile);
    outlines.push_back(std::move(outline));
  }
  if (outlines.empty())
    return error(ErrorCode::invalid_argument, "the plane cuts nothing",
                 "Give plane= a pose with x and y axes through the solid.", "plane");
  items = std::move(outlines);
  return {};
}

void ExportItems::set_pairs(std::vector<ExportPair> pairs) {
  if (mechanisms_.size() == 1) mechanisms_.front().pairs = std::move(pairs);
}

std::int32_t ExportItems::group(const std::string& name, const Pose& pose, std::int32_t parent,
                                ItemOfRobot link, std::int32_t number) {
  ExportItem item;
  if (link.robot >= 0) {
    set_robot_part(item, link);
    set_link(item, number);
  }
  item.name = name;
  item.parent = parent;
  item.pose = pose;
  push(std::move(item), {});
  return static_cast<std::int32_t>(items.size() - 1);
}

void ExportItems::push(ExportItem item, SolidId solid) {
  solids_.resize(items.size());
  solids_.push_back(solid);
  items.push_back(std::move(item));
}

const Mesh* ExportItems::keep(std::shared_ptr<const Mesh> mesh) {
  meshes_.push_back(std::move(mesh));
  return meshes_.back().get();
}

Result<void> ExportItems::add_solid(SolidId id, const std::string& name, const Pose& pose,
                                    std::int32_t parent, MaterialId material) {
  const model::Solid* solid = with_.from.snapshot.get(id);
  if (!solid) return {};
  ExportItem item;
  item.name = name;
  item.parent = parent;
  item.pose = pose;
  item.definition = id.number;
  if (!material.number) material = solid->material;
  if (const auto* m = with_.from.snapshot.get(material)) item.colour = m->colour;
  if (wants_exact_) {
    RMP_TRY_ASSIGN(auto geometry,
                   with_.from.derived.geometry(with_.from.snapshot, id, with_.progress));
    item.geometry = geometry.get();
    geometries_.push_back(std::move(geometry));
  } else {
    RMP_TRY_ASSIGN(auto mesh,
                   with_.from.derived.mesh(with_.from.snapshot, id, chord_, with_.progress));
    item.mesh = keep(std::move(mesh));
    if (const auto p = primitive_of(*solid)) {
      primitives_.push_back(*p);
      set_primitive(item, &primitives_.back());
    }
  }
  std::string stand_in;
  // What is exact is exported without a mesh, and needs none to be told so.
  if (!item.geometry || item.geometry->form == CsgGeometry::Form::mesh) {
    RMP_TRY_ASSIGN(stand_in,
                   with_.from.derived.stand_in(with_.from.snapshot, id, chord_, with_.progress));
  }
  const std::string note = with_.from.snapshot.describe(id) + ": " + stand_in;
  if (!stand_in.empty() && std::find(notes.begin(), notes.end(), note) == notes.end())
    notes.push_back(note);
  push(std::move(item), id);
  return {};
}

std::optional<ExportPrimitive> ExportItems::primitive_of(const model::Solid& s) {
  if (s.nodes.size() != 1) return std::nullopt;
  const model::SolidNode& n = s.nodes[0];
  ExportPrimitive p;
  double lift = 0;
  if (n.kind == CsgKind::box && n.sizes[3] == 0) {
    p.form = ExportPrimitive::Form::box;
    p.sizes = {n.sizes[0], n.sizes[1], n.sizes[2]};
    lift = n.sizes[2] / 2;
  } else if (n.kind == CsgKind::cylinder && n.sizes[2] == 0) {
    p.form = ExportPrimitive::Form::cylinder;
    p.sizes = {n.sizes[0], n.sizes[1], 0};
    lift = n.sizes[1] / 2;
  } else if (n.kind == CsgKind::sphere) {
    p.form = ExportPrimitive::Form::sphere;
    p.sizes = {n.sizes[0], 0, 0};
  } else {
    return std::nullopt;
  }
  p.pose =
      spatial::compose(model::pose(n.placement),
                       spatial::compose(model::node_T_body(n), spatial::translation({0, 0, lift})));
  return p;
}

ExportMechanism ExportItems::mechanism_of(const model::Robot& robot, const model::Robot& plain) {
  ExportMechanism out;
  const auto frames = robotics::link_frames(robot);
  const auto joints = robotics::link_joints(robot);
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const model::Link& l = robot.links[i];
    ExportLink link;
    link.name = l.name;
    link.parent = l.parent;
    link.joint = frames[i].joint;
    link.joint_count = joints[i].joint_count;
    link.joint_T_link = frames[i].joint_T_link;
    link.is_row = !l.origin;
    link.has_mass = l.given && l.given->mass != 0;
    out.links.push_back(std::move(link));
  }
  const auto frame = [&](const std::string& name, std::int32_t link, const Pose& pose) {
    ExportFrame f;
    f.name = name;
    f.link = link;
    f.pose = pose;
    out.frames.push_back(std::move(f));
  };
  for (const model::RobotTool& t : robot.tools) frame(t.name, t.link, model::pose(t.placement));
  // The last link carries the tool for whoever reads the file.
  const Pose at = model::pose(robot.tool);
  if (at.p != Vec3{} || at.R != Pose{}.R || !robot.tools.empty())
    frame("tool", static_cast<std::int32_t>(robot.links.size()) - 1, at);
  for (const model::NamedPose& p : robot.poses) out.poses.push_back({p.name, p.q});
  bool has_payload = robot.payload.has_value();
  for (const model::RobotTool& t : robot.tools) has_payload = has_payload || t.payload;
  if (!plain.attached.empty())
    out.left_out.emplace_back(
        "Attached tools were written as bodies, masses and frames of the links that carry them.");
  if (has_payload) out.left_out.emplace_back("Payloads were added to the links that carry them.");
  if (!robot.pair_rules.empty())
    out.left_out.emplace_back("Rules of which bodies may touch were left out.");
  if (!robot.parametric.parameters.empty() || !robot.parametric.expressions.empty())
    out.left_out.emplace_back("Expressions were written as the numbers that they have now.");
  return out;
}

}  // namespace robomosp::exchange
