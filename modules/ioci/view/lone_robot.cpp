// SPDX-License-Identifier: Apache-2.0
#include "ioci/view/lone_robot.h"

#include "kernel/permit.h"

namespace robomosp::ioci {

Result<LoneRobot> LoneRobot::make(CommandContext& ctx, RobotId robot,
                                  const recording::Recording& r) {
  const PermitScope unlimited(nullptr);  // never committed, so no edit of the caller's
  RMP_TRY_ASSIGN(document::Transaction edit, ctx.app.document.begin("a robot alone"));
  // As this session sees the document: the robot may just have come from the library.
  edit.base_on(std::make_shared<const document::Snapshot>(ctx.snapshot()));
  const document::Record* record = edit.now().find(AnyId(robot));
  model::World world;
  model::PlacedRobot placed;
  placed.name = r.robot.empty() ? record->name : r.robot;
  placed.robot = robot;
  world.robots.push_back(std::move(placed));
  RMP_TRY_ASSIGN(const WorldId id,
                 edit.add(edit.free_name(Kind::world, "alone"), std::move(world)));
  return LoneRobot(std::move(edit), id);
}

std::optional<RobotId> robot_of(const document::Snapshot& s, const recording::Recording& r) {
  if (r.world.number != 0 || r.robot.empty()) return std::nullopt;
  const auto id = s.find(Kind::robot, r.robot);
  if (!id) return std::nullopt;
  return RobotId{id->number};
}

}  // namespace robomosp::ioci
