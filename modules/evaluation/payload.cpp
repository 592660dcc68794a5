// SPDX-License-Identifier: Apache-2.0
#include "evaluation/payload.h"

#include <algorithm>
#include <array>

#include "model/placement.h"
#include "robotics/grip.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::evaluation {

using recording::Column;
using recording::Load;
using recording::Recording;

Result<std::vector<Load>> attached_loads(const Sources& sim, WorldId id,
                                         const model::PlacedRobot& placed,
                                         const RobotModel& model) {
  std::vector<Load> out;
  const model::World* world = sim.snapshot.get(id);
  const model::Robot* record = sim.snapshot.get(placed.robot);
  if (!world || !record) return out;
  for (const model::Attachment& held : world->attachments) {
    if (held.robot != placed.name) continue;
    for (const model::PlacedObject& object : world->objects) {
      if (object.name != held.object) continue;
      RMP_TRY_ASSIGN(const robotics::LinkFrame grip,
                     robotics::grip_frame(*record, model, held.link));
      Load load;
      load.robot = placed.name;
      load.object = object.name;
      load.what = object.what;
      load.joint = grip.joint;
      load.joint_T_object = spatial::compose(grip.joint_T_link, model::pose(held.tool_T_object));
      out.push_back(std::move(load));
    }
  }
  return out;
}

Result<std::shared_ptr<const RobotModel>> loaded_model(const Sources& sim,
                                                       std::shared_ptr<const RobotModel> model,
                                                       std::span<const Load> loads,
                                                       Progress& progress) {
  std::shared_ptr<RobotModel> out;
  for (const Load& load : loads) {
    if (load.joint < 0) continue;
    RMP_TRY_ASSIGN(const evaluation::BodyMass body,
                   sim.derived.mass(sim.snapshot, load.what, progress));
    if (!(body.mass.mass > 0)) continue;
    if (!out) out = std::make_shared<RobotModel>(*model);
    MassProperties& carrier = out->joints[static_cast<std::size_t>(load.joint)].body;
    carrier =
        spatial::combine(std::array{carrier, spatial::in_frame(body.mass, load.joint_T_object)});
  }
  if (out) return std::shared_ptr<const RobotModel>(std::move(out));
  return model;
}

std::vector<Load> loads_at(std::span<const Load> loads, double time) {
  std::vector<Load> out;
  for (const Load& load : loads)
    if (load.from <= time && time < load.to) out.push_back(load);
  return out;
}

std::vector<std::size_t> load_stretches(const Recording& r, std::span<const Load> loads) {
  std::vector<std::size_t> firsts{0};
  const Column* const time = r.find("time");
  const auto changes = [&](double after, double until) {
    const auto is_within = [&](double t) { return t > after && t <= until; };
    return std::any_of(loads.begin(), loads.end(), [&](const Load& load) {
      return is_within(load.from) || is_within(load.to);
    });
  };
  for (std::size_t row = 1; time && row < r.rows(); ++row)
    if (changes(time->values[row - 1], time->values[row])) firsts.push_back(row);
  return firsts;
}

Result<std::shared_ptr<const RobotModel>> attached_model(const Sources& sim, WorldId world,
                                                         const model::PlacedRobot& placed,
                                                         std::shared_ptr<const RobotModel> model,
                                                         Progress& progress) {
  RMP_TRY_ASSIGN(const auto loads, attached_loads(sim, world, placed, *model));
  return loaded_model(sim, std::move(model), loads, progress);
}

}  // namespace robomosp::evaluation
