// SPDX-License-Identifier: Apache-2.0
#include "sim/payload.h"

#include <array>

#include "model/placement.h"
#include "robotics/grip.h"
#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::sim {

Result<std::vector<Load>> attached_loads(const Simulator& sim, WorldId id,
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
      load.what = object.what;
      load.joint = grip.joint;
      load.joint_T_object = spatial::compose(grip.joint_T_link, model::pose(held.tool_T_object));
      out.push_back(std::move(load));
    }
  }
  return out;
}

Result<std::shared_ptr<const RobotModel>> loaded_model(const Simulator& sim,
                                                       std::shared_ptr<const RobotModel> model,
                                                       std::span<const Load> loads,
                                                       Progress& progress) {
  std::shared_ptr<RobotModel> out;
  for (const Load& load : loads) {
    if (load.joint < 0) continue;
    RMP_TRY_ASSIGN(const document::BodyMass body,
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

Result<std::shared_ptr<const RobotModel>> attached_model(const Simulator& sim, WorldId world,
                                                         const model::PlacedRobot& placed,
                                                         std::shared_ptr<const RobotModel> model,
                                                         Progress& progress) {
  RMP_TRY_ASSIGN(const auto loads, attached_loads(sim, world, placed, *model));
  return loaded_model(sim, std::move(model), loads, progress);
}

}  // namespace robomosp::sim
