// SPDX-License-Identifier: Apache-2.0
#include "evaluation/robot_model.h"

#include <optional>
#include <utility>
#include <vector>

#include "document/digest.h"
#include "evaluation/leaves.h"
#include "evaluation/mass.h"
#include "model/placement.h"
#include "robotics/build_model.h"
#include "spatial/mass.h"

namespace robomosp::evaluation {

using document::Snapshot;
using model::Record;

namespace {

/// Mass of a link's designed parts in the link's frame; nullopt without parts or material.
Result<std::optional<MassProperties>> designed_mass(Solids& solids, const Snapshot& s,
                                                    const model::Link& link, Progress& progress) {
  std::vector<MassProperties> masses;
  for (const auto& p : link.parts) {
    RMP_TRY_ASSIGN(const BodyMass m, body_mass(solids, s, p.what, progress));
    if (m.mass.mass > 0) masses.push_back(spatial::in_frame(m.mass, model::pose(p.placement)));
  }
  if (masses.empty()) return std::optional<MassProperties>{};
  return std::optional<MassProperties>{spatial::combine(masses)};
}

}  // namespace

Result<std::shared_ptr<const RobotModel>> robot_model_of(Solids& solids, const Snapshot& s,
                                                         RobotId id, Vec3 gravity,
                                                         Progress& progress) {
  const document::RecordPtr record = s.share(id);
  if (!record) return stale(s, id);
  const auto& robot = std::get<model::Robot>(record->body);
  const auto cached = [&](const Fingerprint& key, auto&& make) {
    return solids.cache().get<RobotModel>(key, key, make, [](const RobotModel& m) {
      return sizeof(RobotModel) + sizeof(JointModel) * m.joints.size();
    });
  };
  std::vector<std::optional<MassProperties>> masses;
  const auto build = [&] {
    return robotics::build_robot_model(record->name, robot, masses, gravity);
  };
  // Where all that counts is in the record, the key is known as soon as it was made once.
  const bool is_own = robot.mass_source != model::MassSource::designed;
  if (is_own)
    if (const auto key = solids.cache().key_of(record, gravity)) return cached(*key, build);
  if (!is_own)
    for (const auto& link : robot.links) {
      RMP_TRY_ASSIGN(auto m, designed_mass(solids, s, link, progress));
      masses.push_back(m);
    }
  // The key: what the model is built from, without looks, poses, solvers and parts.
  model::Robot kinematic = robot;
  kinematic.description.clear();
  kinematic.source.clear();
  kinematic.base_parts.clear();
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

}  // namespace robomosp::evaluation
