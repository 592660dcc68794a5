// SPDX-License-Identifier: Apache-2.0
#include "task/target_places.h"

#include <algorithm>
#include <numbers>

#include "kernel/text.h"
#include "robotics/grip.h"
#include "spatial/pose.h"
#include "task/task_executor.h"

namespace robomosp::task {

Result<TargetPlaces> target_places(const sim::Simulator& simulator, WorldId world,
                                   const ProgramInWorld& wanted, std::string_view symbol,
                                   Progress& progress) {
  constexpr double kStep = 0.02;  // [s]; no time passes
  RMP_TRY_ASSIGN(const TaskExecutor x, TaskExecutor::create(simulator, world, kStep, progress));
  return ProgramActor::target_places(x, wanted, symbol);
}

Result<TargetPlaces> ProgramActor::target_places(const TaskExecutor& x, ProgramInWorld wanted,
                                                 std::string_view symbol) {
  const rmp_code& c = wanted.code->code();
  const std::string where = "program " + text::quote(wanted.placement.name);
  wanted.frees_unbound = true;  // signals have no say here
  std::vector<std::string> notes;
  RMP_TRY_ASSIGN(const ProgramActor actor, create(x, std::move(wanted), notes));
  const Names& names = *actor.names_;
  const RobotUse* use = names.own ? &*names.own : nullptr;
  for (const auto& [at, of] : names.robots)
    if (!symbol.empty() &&
        static_cast<const rmp_code_symbol*>(rmp_row(&c.symbols, at))->name == symbol)
      use = &of;
  if (!use)
    return error(ErrorCode::not_found, "the world robot moved by the program is unknown",
                 "program.bind{kind = \"robot\", to = ...} names it.", where);
  const TaskExecutor::Actor& robot = x.actors_[use->actor];
  TargetPlaces out;
  out.robot = robot.placed->name;
  out.record = robot.placed->robot;
  out.start = robot.start;
  out.frame = use->frame, out.tool = use->tool;
  out.frame_is_object = x.thing_of_.contains(use->frame);
  if (const auto it = names.rails.find(use->actor); it != names.rails.end()) out.rail = it->second;
  for (const auto& [number, joint] : names.joints) {
    if (joint.is_grip) continue;
    const TaskExecutor::Actor& of = x.actors_[joint.at];
    const JointModel& model = of.model->joints[joint.joint];
    AdditionalJoint one;
    one.number = number;
    one.robot = of.placed->name, one.joint = model.name;
    if (joint.at == use->actor) one.rail = static_cast<std::int32_t>(joint.joint);
    one.is_rotary = TaskExecutor::is_rotary(of, joint.joint);
    const double unit = one.is_rotary ? std::numbers::pi / 180 : 0.001;
    one.start = of.start[joint.joint] / unit;
    one.lower = model.lower / unit, one.upper = model.upper / unit;
    if (const auto count = maker_counts(of, joint.joint, &one.axis)) one.maker = *count;
    out.additional.push_back(std::move(one));
  }
  if (const auto it = x.thing_of_.find(use->frame); it != x.thing_of_.end()) {
    const auto& held = x.things_[it->second].history.front();
    const bool moves = held.is_held && held.joint >= 0 &&
                       (held.actor == use->actor ||
                        std::any_of(names.joints.begin(), names.joints.end(), [&](const auto& j) {
                          return !j.second.is_grip && j.second.at == held.actor;
                        }));
    if (moves) out.frame_carrier = x.actors_[held.actor].placed->name;
  }
  if (!use->frame.empty()) {
    auto world_T_frame = x.frame(use->frame, 0);
    if (!world_T_frame.ok()) return std::move(world_T_frame).error().in(where);
    out.base_T_frame = spatial::compose(spatial::inverse(robot.world_T_base), *world_T_frame);
  }
  auto tip = x.tip(use->actor, use->tool);
  if (!tip.ok()) return std::move(tip).error().in(where);
  const robotics::LinkFrame flange = robotics::flange_frame(*robot.record);
  if (tip->joint != flange.joint)
    return error(ErrorCode::unsupported,
                 "the tool of robot " + text::quote(out.robot) +
                     " is not on its last link, from which controllers measure tools",
                 "program.bind{kind = \"robot\", tool = ...} selects another one.", where);
  out.flange_T_tool = spatial::compose(spatial::inverse(flange.joint_T_link), tip->joint_T_grip);
  return out;
}

}  // namespace robomosp::task
