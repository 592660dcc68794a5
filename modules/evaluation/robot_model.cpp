// SPDX-License-Identifier: Apache-2.0
#include "evaluation/robot_model.h"

#include <optional>
#include <utility>
#include <vector>

#include "document/digest.h"
#include "evaluation/attached_tools.h"
#include "evaluation/leaves.h"
#include "evaluation/mass.h"
#include "model/placement.h"
#include "robotics/build_model.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {

using document::Snapshot;
using model::Record;

namespace {

/// Mass of designed parts in their link's frame; nullopt without parts or material.
Result<std::optional<MassProperties>> designed_mass(Solids& solids, const Snapshot& s,
                                                    std::span<const model::BodyPart> parts,
                                                    Progress& progress) {
  RMP_TRY_ASSIGN(const BodyMass m, parts_mass(solids, s, parts, progress));
  if (!(m.mass.mass > 0)) return std::optional<MassProperties>{};
  return std::optional<MassProperties>{m.mass};
}

/// The robot with attached tools as further tools, which carry the masses of their bodies.
Result<model::Robot> with_tools(Solids& solids, const Snapshot& s, const std::string& name,
                                const model::Robot& robot, Progress& progress) {
  RMP_TRY_ASSIGN(model::Robot out, with_tool_frames(s, name, robot));
  for (const model::AttachedTool& t : robot.attached) {
    auto mass = body_mass(solids, s, t.what, progress);
    if (!mass.ok())
      return std::move(mass).in("tool \"" + t.name + "\"").in("robot \"" + name + "\"").error();
    for (model::RobotTool& tool : out.tools)
      if (tool.name == t.name && mass->mass.mass > 0) tool.payload = mass->mass;
  }
  return out;
}

}  // namespace

Result<std::shared_ptr<const RobotModel>> robot_model_of(Solids& solids, const Snapshot& s,
                                                         RobotId id, Vec3 gravity,
                                                         Progress& progress) {
  const document::RecordPtr record = s.share(id);
  if (!record) return stale(s, id);
  const auto& plain = std::get<model::Robot>(record->body);
  std::optional<model::Robot> equipped;
  if (!plain.attached.empty()) {
    RMP_TRY_ASSIGN(equipped, with_tools(solids, s, record->name, plain, progress));
  }
  const model::Robot& robot = equipped ? *equipped : plain;
  const auto cached = [&](const Fingerprint& key, auto&& make) {
    return solids.cache().get<RobotModel>(key, key, progress, make, [](const RobotModel& m) {
      return sizeof(RobotModel) + sizeof(JointModel) * m.joints.size();
    });
  };
  std::vector<std::optional<MassProperties>> masses;
  const auto build = [&] {
    return robotics::build_robot_model(record->name, robot, masses, gravity);
  };
  // Where all that counts is in the record, the key is known as soon as it was made once.
  const bool is_own = !equipped && robot.mass_source != model::MassSource::designed;
  if (is_own)
    if (const auto key = solids.cache().key_of(record, gravity)) return cached(*key, build);
  if (!is_own)
    for (const auto& link : robot.links) {
      RMP_TRY_ASSIGN(auto m, designed_mass(solids, s, link.parts, progress));
      masses.push_back(m);
    }
  // The key: what the model is built from, without looks, poses, solvers and parts.
  model::Robot kinematic = robot;
  kinematic.description.clear();
  kinematic.source.clear();
  kinematic.base_parts.clear();
  kinematic.base_mass.reset();
  kinematic.poses.clear();
  kinematic.pair_rules.clear();
  kinematic.ik = kinematic.inverse_dynamics = kinematic.forward_dynamics =
      kinematic.controller = {};
  kinematic.skin_colour = kinematic.skin_accent = {};
  kinematic.parametric = {};  // what it comes from does not matter, only the numbers
  for (auto& link : kinematic.links) {
    link.parts.clear();
    link.visible = true;
  }
  Fingerprinter fp("robot_model/1");
  fp.add(std::string_view(record->name)).add(std::span<const double>(gravity));
  document::feed(fp, kinematic, [](Fingerprinter&, AnyId) {});
  for (const auto& m : masses) {
    fp.add(m.has_value());
    if (!m) continue;
    const Sym3& i = m->inertia;
    fp.add(m->mass).add(std::span<const double>(m->com));
    for (const double v : {i.xx, i.yy, i.zz, i.xy, i.yz, i.xz}) fp.add(v);
  }
  const Fingerprint key = fp.finish();
  if (is_own) solids.cache().keep_key(record, gravity, key);
  return cached(key, build);
}

Result<std::optional<MassProperties>> standing_mass_of(Solids& solids, const Snapshot& s,
                                                       RobotId id, Progress& progress) {
  const auto* plain = s.get(id);
  if (!plain) return stale(s, id);
  std::optional<model::Robot> equipped;
  if (!plain->attached.empty()) {
    RMP_TRY_ASSIGN(equipped, with_tools(solids, s, s.find(id)->name, *plain, progress));
  }
  const model::Robot* robot = equipped ? &*equipped : plain;
  const bool is_designed = robot->mass_source == model::MassSource::designed;
  std::vector<MassProperties> bodies;
  const auto add_parts = [&](std::span<const model::BodyPart> parts,
                             const Pose& base_T_link) -> Result<bool> {
    if (!is_designed) return false;
    RMP_TRY_ASSIGN(const auto m, designed_mass(solids, s, parts, progress));
    if (m) bodies.push_back(spatial::in_frame(*m, base_T_link));
    return m.has_value();
  };
  RMP_TRY_ASSIGN(const bool base_weighs, add_parts(robot->base_parts, {}));
  if (!base_weighs && robot->base_mass) bodies.push_back(*robot->base_mass);
  const std::vector<robotics::LinkFrame> frames = robotics::link_frames(*robot);
  const auto pose_on = [&](std::int32_t link) -> std::optional<Pose> {
    if (link < 0) return Pose{};
    const robotics::LinkFrame& at = frames[static_cast<std::size_t>(link)];
    return at.joint < 0 ? std::optional(at.joint_T_link) : std::nullopt;
  };
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].joint >= 0) continue;
    const model::Link& link = robot->links[i];
    RMP_TRY_ASSIGN(const bool weighs, add_parts(link.parts, frames[i].joint_T_link));
    if (!weighs && link.given)
      bodies.push_back(spatial::in_frame(*link.given, frames[i].joint_T_link));
  }
  for (const model::RobotTool& tool : robot->tools)
    if (const auto at = pose_on(tool.link); at && tool.payload)
      bodies.push_back(
          spatial::in_frame(*tool.payload, spatial::compose(*at, model::pose(tool.placement))));
  const MassProperties all = spatial::combine(bodies);
  if (!(all.mass > 0)) return std::optional<MassProperties>{};
  return std::optional(spatial::in_frame(all, model::pose(robot->base)));
}

}  // namespace robomosp::evaluation
