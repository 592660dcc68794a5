// SPDX-License-Identifier: Apache-2.0
// A robot where a world shows it: single joints, and its tool at the target of the world.
#include <algorithm>
#include <optional>

#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "ioci/world/members.h"
#include "robotics/coordinates.h"
#include "robotics/kinematics.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::Robot;

/// Joint values as shown, with one changed by `change`.
Result<Value> change_joint(CommandContext& ctx, const Map& args,
                           double (*change)(double shown, double given)) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t link, read_link(r, *args.find("joint"), false, "joint"));
  RMP_TRY_ASSIGN(ShownRobot s, shown_robot(ctx, args));
  const auto at = static_cast<std::size_t>(link);
  const robotics::LinkJoints joint = robotics::link_joints(r)[at];
  if (joint.q_count != 1)
    return error(ErrorCode::unsupported,
                 joint.q_count == 0 ? "its link " + text::quote(r.links[at].name) +
                                          " has no joint value of its own"
                                    : "the joint of link " + text::quote(r.links[at].name) +
                                          " has " + std::to_string(joint.q_count) + " values",
                 "robot.set_joints sets all values of the robot.", name_in(ctx, ref(args, "id")));
  const auto q = static_cast<std::size_t>(joint.q);
  const std::string unit(robotics::coordinate_units(r)[q]);
  RMP_TRY_ASSIGN(const Value v,
                 check_value(field("", "real", unit, ""), *args.find("value"), "value"));
  s.q[q] = change(s.q[q], v.number());
  return put_joints(ctx, s, std::move(s.q));
}

Result<Value> set_joint(CommandContext& ctx, const Map& args) {
  return change_joint(ctx, args, [](double, double given) { return given; });
}
Result<Value> add_joint(CommandContext& ctx, const Map& args) {
  return change_joint(ctx, args, [](double shown, double given) { return shown + given; });
}

/// The target of the world that shows the robot, in the frame the robot is mounted in.
Pose target_in_mounting(const CommandContext& ctx, const ShownRobot& s) {
  const model::World& w = *ctx.snapshot().get(s.world);
  return spatial::compose(spatial::inverse(model::pose(w.robots[s.member].placement)),
                          model::pose(target_of(w)));
}

Result<Value> target_pose(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  return Value(pose_map(target_in_mounting(ctx, s)));
}

/// Joint values with the tool at the target, from those shown.
Result<std::vector<double>> solve_target(CommandContext& ctx, const Map& args,
                                         const ShownRobot& s) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const auto bound,
                 ctx.app.solvers.ik(ctx.app.registry, m, content<Robot>(ctx, args).ik));
  const Pose target = spatial::compose(spatial::inverse(m->base), target_in_mounting(ctx, s));
  IkBatch batch;
  batch.targets = {&target, 1};
  batch.seeds = s.q;
  RMP_TRY_ASSIGN(const auto results, sim::solve_ik(bound, batch, ctx.progress));
  const IkResult& found = results.front();
  if (found.status == IkStatus::solved)
    return std::vector<double>(
        found.q.begin(), found.q.begin() + static_cast<std::ptrdiff_t>(m->coordinate_count()));
  const std::string world = ctx.snapshot().find(AnyId(s.world))->name;
  return error(ErrorCode::unreachable,
               "it cannot bring its tool to the target of world " + text::quote(world) +
                   (found.detail.empty() ? "" : ": " + found.detail),
               "Move the target: world.place{id = " + text::quote(world) +
                   ", member = \"target\", ...}, after world.add_frame when there is none.",
               name_in(ctx, ref(args, "id")));
}

Result<Value> target_joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(auto q, solve_target(ctx, args, s));
  return Value(NumericArray(std::move(q)));
}

Result<Value> follow_target(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(auto q, solve_target(ctx, args, s));
  return put_joints(ctx, s, std::move(q));
}

Result<Value> rotation_vector(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const auto q, given_or_shown(ctx, args, *m));
  std::vector<Pose> frames(m->joints.size());
  robotics::forward_kinematics(*m, q, frames);
  const Pose tool = spatial::compose(m->base, robotics::tip_pose(*m, 0, frames));
  return Value(vec_value(spatial::rotation_log(tool.R), "rad"));
}

Result<Value> tool_transform(CommandContext& ctx, const Map& args) {
  return Value(ctx.snapshot().find(ref(args, "id"))->name + ".tool");
}

/// An arm shown ready, and the target of its world 0.1 m above its tool.
std::string with_target(const char* rest) {
  return example_cell(
      std::string("arm:set_joints(\"ready\")\nlocal p, a = arm:fk().position, arm:fk().rpy\n"
                  "cell:add_frame{name = \"target\", position = {p[1], p[2], p[3] + 0.1}, rpy = "
                  "a}\n") +
      rest);
}

}  // namespace

RMP_COMMANDS(robot_target_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec world = shown_world(),
                  joint = needed("joint", "any", "",
                                 "Number, 1 is the first, or name of the link that it moves.");
  const std::vector<ParamSpec> pose_fields{field("pose", "pose", "", "4x4 homogeneous matrix."),
                                           field("position", "vec3", "m", "Position."),
                                           field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                                           field("quaternion", "real[]", "", "w, x, y, z.")};
  const ReturnSpec joints{"array", "rad or m", "The joint values now.", {}};
  const std::string target =
      "The target is the frame \"target\" of the world that shows the robot, and the world's "
      "origin while there is no such frame. ";
  all.push_back(
      {.name = "robot.set_joint",
       .classic = "PRobot Link Set(joint, value)",
       .summary = "Sets the value of one joint at which a world shows the robot.",
       .details = "",
       .example = example_cell("arm:set_joint{joint = 3, value = \"30 deg\"}\n"
                               "assert(math.abs(arm:joint_values()[3] - math.pi / 6) < 1e-15)"),
       .params = {self("robot"), joint,
                  needed("value", "any", "rad or m", "The value, by the joint's type."), world},
       .returns = joints,
       .effect = Effect::edits,
       .run = set_joint});
  all.push_back(
      {.name = "robot.add_joint",
       .classic = "PRobot Link Add(joint, value)",
       .summary = "Adds to the value of one joint at which a world shows the robot.",
       .details = "",
       .example = example_cell("arm:add_joint{joint = 3, value = 0.1}\n"
                               "arm:add_joint{joint = 3, value = 0.1}\n"
                               "assert(arm:joint_values()[3] == 0.2)"),
       .params = {self("robot"), joint,
                  needed("value", "any", "rad or m", "What is added, by the joint's type."), world},
       .returns = joints,
       .effect = Effect::edits,
       .run = add_joint});
  all.push_back({.name = "robot.target_pose",
                 .classic = "PRobot LLRL mGetInHMT",
                 .summary = "Gives the target of a world in the frame the robot is mounted in.",
                 .details = target + "It is what robot.target_joints solves for.",
                 .example = with_target("assert(math.abs(arm:target_pose().position[3] - "
                                        "arm:fk().position[3] - 0.1) < 1e-12)"),
                 .params = {self("robot"), world},
                 .returns = {"map", "", "", pose_fields},
                 .effect = Effect::reads,
                 .run = target_pose});
  all.push_back({.name = "robot.target_joints",
                 .classic = "PRobot LLRL mGetOutJointp",
                 .summary = "Gives joint values that bring the tool to the target of a world.",
                 .details = target + "The search begins at the joint values shown.",
                 .example = with_target("local q = arm:target_joints()\nassert(math.abs(arm:fk{q = "
                                        "q}.position[3] - arm:fk().position[3] - 0.1) < 1e-8)"),
                 .params = {self("robot"), world},
                 .returns = {"array", "rad or m", "One value a joint.", {}},
                 .effect = Effect::reads,
                 .run = target_joints});
  all.push_back(
      {.name = "robot.follow_target",
       .classic = "PRobot FollowTarget",
       .summary = "Shows a robot with its tool at the target of its world.",
       .details = target + "What cannot be reached is an error, and the robot stays.",
       .example = with_target("arm:follow_target()\nassert(math.abs(arm:fk().position[3] - "
                              "arm:target_pose().position[3]) < 1e-8)"),
       .params = {self("robot"), world},
       .returns = joints,
       .effect = Effect::edits,
       .run = follow_target});
  all.push_back(
      {.name = "robot.rotation_vector",
       .classic = "PRobot LLRL RotVec",
       .summary = "Gives the orientation of the tool as a rotation vector: axis times angle.",
       .details = "In the frame the robot is mounted in. spatial.convert gives the other notations "
                  "of it.",
       .example = example_cell(
           "local v = arm:rotation_vector()\nassert(math.abs(spatial.convert{rotation_vector = "
           "v}.quaternion[1] - arm:fk().quaternion[1]) < 1e-12)"),
       .params = {self("robot"),
                  optional("q", "any", "rad or m",
                           "Joint values or the name of a pose; those shown when left out."),
                  world},
       .returns = {"vec3", "rad", "", {}},
       .effect = Effect::reads,
       .run = rotation_vector});
  all.push_back({.name = "robot.tool_transform",
                 .classic = "PRobot GetToolTransformId",
                 .summary = "Gives the name by which the transform commands know a robot's tool.",
                 .details = "",
                 .example = with_arm("transform.set(arm:tool_transform(), \"P3\", \"150 mm\")\n"
                                     "assert(arm:tool().position[3] == 0.15)"),
                 .params = {self("robot")},
                 .returns = {"string", "", "Such as arm.tool.", {}},
                 .effect = Effect::reads,
                 .run = tool_transform});
  return all;
}

}  // namespace robomosp::ioci
