// SPDX-License-Identifier: Apache-2.0
// A robot where a world shows it: single joints, and its tool at the target of the world.
#include <algorithm>
#include <cstdint>
#include <numbers>
#include <optional>

#include "ioci/robot/array_units.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "robotics/maker_axes.h"
#include "sim/ik_reason.h"
#include "spatial/pose.h"

namespace robomosp::ioci {

model::Placement target_of(const model::World& w) {
  for (const auto& f : w.frames)
    if (f.name == kTarget) return f.placement;
  return {};
}

Pose target_in_mounting(const CommandContext& ctx, const ShownRobot& shown) {
  const model::World& w = *ctx.snapshot().get(shown.world);
  return spatial::compose(spatial::inverse(model::pose(w.robots[shown.member].placement)),
                          model::pose(target_of(w)));
}

namespace {

/// Lua that makes a world `cell` with a six-joint arm `arm`, for examples.
std::string arm_in_cell(const std::string& rest) {
  return with_arm("local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n") +
         rest;
}

using model::Robot;

/// The one coordinate of the joint that the argument `joint` names: its place, whether it turns.
struct OneJoint {
  std::size_t link = 0, q = 0;
  bool turns = false;
  std::string unit;
};
Result<OneJoint> one_joint(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t link, read_link(r, *args.find("joint"), false, "joint"));
  const auto at = static_cast<std::size_t>(link);
  const robotics::LinkJoints joint = robotics::link_joints(r)[at];
  if (joint.q_count != 1)
    return error(
        ErrorCode::unsupported,
        joint.q_count == 0
            ? "its link " + text::quote(r.links[at].name) + " has no independent joint value"
            : "the joint of link " + text::quote(r.links[at].name) + " has " +
                  std::to_string(joint.q_count) + " values",
        "Set all values of the robot with robot.set_joints.", name_in(ctx, ref(args, "id")));
  const auto q = static_cast<std::size_t>(joint.q);
  const std::string unit(robotics::coordinate_units(r)[q]);
  return OneJoint{at, q, unit == "rad", unit};
}

/// A value of a joint as an answer, by the argument `angles`.
Value joint_answer(const Map& args, const OneJoint& joint, double value) {
  return Value(joint.turns && in_degrees(args) ? value / kDegree : value);
}

/// Joint values as shown, with one changed by `change`.
Result<Value> change_joint(CommandContext& ctx, const Map& args,
                           double (*change)(double shown, double given)) {
  RMP_TRY_ASSIGN(const OneJoint joint, one_joint(ctx, args));
  RMP_TRY_ASSIGN(ShownRobot s, shown_robot(ctx, args));
  if (joint.q >= s.q.size())
    return error(ErrorCode::conflict,
                 "the world places it with " + std::to_string(s.q.size()) + " joint values",
                 "Set all values of the robot with robot.set_joints.",
                 name_in(ctx, ref(args, "id")));
  Value given = *args.find("value");
  std::optional<double> bare;
  if (given.is_number()) bare = given.number();
  else if (const std::string* word = given.as_string()) bare = text::read_real(*word);
  if (bare && joint.turns && in_degrees(args)) given = Value(*bare * kDegree);
  RMP_TRY_ASSIGN(const Value v, check_value(field("", "real", joint.unit, ""), given, "value"));
  s.q[joint.q] = change(s.q[joint.q], v.number());
  return put_joints(ctx, args, s, std::move(s.q));
}

Result<Value> joint_value(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const OneJoint joint, one_joint(ctx, args));
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  if (joint.q >= s.q.size())
    return error(ErrorCode::conflict,
                 "the world places it with " + std::to_string(s.q.size()) + " joint values",
                 "Set all values of the robot with robot.set_joints.",
                 name_in(ctx, ref(args, "id")));
  return joint_answer(args, joint, s.q[joint.q]);
}

Result<Value> joint_limit(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const OneJoint joint, one_joint(ctx, args));
  const model::Link& l = content<Robot>(ctx, args).links[joint.link];
  return joint_answer(args, joint, text_of(args, "limit") == "lower" ? l.lower : l.upper);
}

/// The joint values of a named pose; "home" is zeros where the robot has none.
Result<Value> pose_values(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  const std::string name = text_of(args, "name");
  std::vector<std::string> known;
  for (const model::NamedPose& p : r.poses) {
    if (p.name == name) return joints_answer(args, r, p.q);
    known.push_back(p.name);
  }
  if (name == "home") return joints_answer(args, r, robotics::home_joint_values(r));
  Error e = unknown_name("pose", name, known);
  if (e.hint.empty()) e.hint = "robot.set_pose names one.";
  return std::move(e).in(name_in(ctx, ref(args, "id")));
}

/// alpha, a, theta, d, minimum, maximum, origin, nest and type, as a row of the program of 2006.
Result<Value> link_parameters(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const std::int32_t link, read_link(r, *args.find("link"), false, "link"));
  const auto at = static_cast<std::size_t>(link);
  const model::Link& l = r.links[at];
  const std::string where = name_in(ctx, ref(args, "id"));
  if (l.origin)
    return error(ErrorCode::unsupported,
                 "link " + text::quote(l.name) + " is placed by an origin and has no DH row",
                 "robot.link returns its origin and axis.", where);
  const robotics::LinkJoints joint = robotics::link_joints(r)[at];
  const bool turns = l.joint == model::JointKind::revolute;
  if (!turns && l.joint != model::JointKind::prismatic)
    return error(ErrorCode::unsupported,
                 "link " + text::quote(l.name) + " is neither Revolute nor Prismatic",
                 "robot.link returns all its data.", where);
  const std::vector<double> home = robotics::home_joint_values(r);
  const auto nest = std::find_if(r.poses.begin(), r.poses.end(),
                                 [](const model::NamedPose& p) { return p.name == "nest"; });
  const auto q = static_cast<std::size_t>(joint.q);
  const auto value_of = [&](const std::vector<double>& pose) {
    return joint.q_count == 1 && q < pose.size() ? pose[q] : 0.0;
  };
  const double origin = value_of(home);
  std::vector<double> row{
      l.row.alpha,      l.row.a, l.row.theta, l.row.d,
      l.lower,          l.upper, origin,      nest == r.poses.end() ? origin : value_of(nest->q),
      turns ? 0.0 : 1.0};
  if (in_degrees(args)) {
    for (const std::size_t k : {0, 2}) row[k] /= kDegree;
    for (std::size_t k = 4; k < 8 && turns; ++k) row[k] /= kDegree;
  }
  return Value(NumericArray(std::move(row)));
}

Result<Value> set_target_pose(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  const auto pose = pose_from(*args.find("pose"));
  if (!pose) return error(ErrorCode::invalid_argument, "the target is not a pose", {}, "pose");
  auto done = change<model::World>(ctx, s.world, [&](model::World& w) -> Result<void> {
    const Pose at = spatial::compose(model::pose(w.robots[s.member].placement), *pose);
    for (model::PlacedFrame& f : w.frames)
      if (f.name == kTarget) {
        f.placement = model::placement(at, f.placement.notation);
        return {};
      }
    w.frames.push_back({std::string(kTarget), model::placement(at)});
    return {};
  });
  if (!done.ok()) return std::move(done).error();
  return Value();
}

Result<Value> set_joint(CommandContext& ctx, const Map& args) {
  return change_joint(ctx, args, [](double, double given) { return given; });
}
Result<Value> add_joint(CommandContext& ctx, const Map& args) {
  return change_joint(ctx, args, [](double shown, double given) { return shown + given; });
}

Result<Value> target_pose(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  return Value(pose_map(target_in_mounting(ctx, s)));
}

/// Why the robot's own solver did not reach `base_T_tip`, in the maker's axes; "" = it did not say.
std::string ik_reason_of(CommandContext& ctx, const Map& args, const sim::Bound<IkSolver>& bound,
                         const IkResult& found, const Pose& base_T_tip,
                         std::span<const double> seed) {
  const Robot& r = content<Robot>(ctx, args);
  return sim::ik_reason(ctx.app.registry, bound, r.ik, found, base_T_tip, seed,
                        *robotics::MakerAxes::for_messages(&r), ctx.progress);
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
               "it cannot reach the target of world " + text::quote(world) +
                   (found.detail.empty() ? "" : ": ") +
                   ik_reason_of(ctx, args, bound, found, target, s.q),
               "Move the target: world.place{id = " + text::quote(world) +
                   ", member = \"target\", ...}, after world.add_frame if there is none.",
               name_in(ctx, ref(args, "id")));
}

Result<Value> target_joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(auto q, solve_target(ctx, args, s));
  return Value(NumericArray(std::move(q), joint_array_unit(content<Robot>(ctx, args))));
}

Result<Value> follow_target(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(auto q, solve_target(ctx, args, s));
  return put_joints(ctx, args, s, std::move(q));
}

/// The rotation of 9 or 16 numbers, a matrix row by row; nothing of other counts, or of as many as
/// the robot has coordinates.
Result<std::optional<spatial::Matrix3>> given_rotation(const Value& given,
                                                       std::size_t coordinates) {
  std::vector<double> v;
  if (const std::string* words = given.as_string()) {
    const auto read = check_value(field("", "real[]", "", ""), *words, "q");
    if (read.ok()) v = reals(&*read);
  } else if (given.as_array() || given.as_list()) {
    v = reals(&given);
  }
  if ((v.size() != 9 && v.size() != 16) || v.size() == coordinates)
    return std::optional<spatial::Matrix3>();
  const std::size_t width = v.size() == 9 ? 3 : 4;
  Pose t;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) t.R[3 * i + j] = v[width * i + j];
  if (!spatial::is_rigid(t, 1e-6))
    return error(ErrorCode::invalid_argument, "the matrix is not a rotation",
                 "Its columns must be perpendicular, of length 1, and right-handed.", "q");
  return std::optional<spatial::Matrix3>(t.R);
}

Result<Value> rotation_vector(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(const auto rotation, given_rotation(*args.find("q"), m->coordinate_count()));
    if (rotation) return Value(vec_value(spatial::rotation_log(*rotation), "rad"));
  }
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
  return arm_in_cell(
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
      "The target is the frame \"target\" of the world that shows the robot, or the world's origin "
      "if there is no such frame. ";
  all.push_back(
      {.name = "robot.set_joint",
       .classic = "PRobot Link Set(joint, value, angles=degrees)",
       .summary = "Sets the value of one joint at which a world shows the robot.",
       .details = "",
       .example = arm_in_cell("arm:set_joint{joint = 3, value = \"30 deg\"}\n"
                              "assert(math.abs(arm:joint_values()[3] - math.pi / 6) < 1e-15)"),
       .params = {self("robot"), joint,
                  needed("value", "any", "rad or m", "The value, in the unit of the joint's type."),
                  world, angle_unit()},
       .returns = joints,
       .effect = Effect::edits,
       .run = set_joint});
  all.push_back({.name = "robot.add_joint",
                 .classic = "PRobot Link Add(joint, value, angles=degrees)",
                 .summary = "Adds to the value of one joint at which a world shows the robot.",
                 .details = "",
                 .example = arm_in_cell("arm:add_joint{joint = 3, value = 0.1}\n"
                                        "arm:add_joint{joint = 3, value = 0.1}\n"
                                        "assert(arm:joint_values()[3] == 0.2)"),
                 .params = {self("robot"), joint,
                            needed("value", "any", "rad or m",
                                   "The increment, in the unit of the joint's type."),
                            world, angle_unit()},
                 .returns = joints,
                 .effect = Effect::edits,
                 .run = add_joint});
  all.push_back({.name = "robot.target_pose",
                 .classic = "PRobot LLRL mGetInHMT",
                 .summary = "Returns the target of a world in the robot's mounting frame.",
                 .details = target + "robot.target_joints solves for it.",
                 .example = with_target("assert(math.abs(arm:target_pose().position[3] - "
                                        "arm:fk().position[3] - 0.1) < 1e-12)"),
                 .params = {self("robot"), world},
                 .returns = {"map", "", "", pose_fields},
                 .effect = Effect::reads,
                 .run = target_pose});
  all.push_back({.name = "robot.target_joints",
                 .classic = "PRobot LLRL mGetOutJointp",
                 .summary = "Computes joint values that bring the tool to the target of a world.",
                 .details = target + "The search starts at the joint values shown.",
                 .example = with_target("local q = arm:target_joints()\nassert(math.abs(arm:fk{q = "
                                        "q}.position[3] - arm:fk().position[3] - 0.1) < 1e-8)"),
                 .params = {self("robot"), world},
                 .returns = {"array", "rad or m", "One value per joint.", {}},
                 .effect = Effect::reads,
                 .run = target_joints});
  all.push_back(
      {.name = "robot.follow_target",
       .classic = "PRobot FollowTarget(angles=degrees)",
       .summary = "Shows a robot with its tool at the target of its world.",
       .details = target + "If it cannot be reached, this is an error and the robot does not move.",
       .example = with_target("arm:follow_target()\nassert(math.abs(arm:fk().position[3] - "
                              "arm:target_pose().position[3]) < 1e-8)"),
       .params = {self("robot"), world, angle_unit()},
       .returns = joints,
       .effect = Effect::edits,
       .run = follow_target});
  all.push_back(
      {.name = "robot.set_target_pose",
       .classic = "PRobot LLRL mSetInHMT(pose)",
       .summary = "Moves the target of a world; the pose is given in the robot's mounting frame.",
       .details = target + "The target is created if it does not exist.",
       .example = with_target("arm:set_target_pose(pose(0.5, 0, 0.3))\n"
                              "assert(math.abs(arm:target_pose().position[1] - 0.5) < "
                              "1e-12)"),
       .params = {self("robot"), needed("pose", "pose", "", "The new pose of the target."), world},
       .returns = {},
       .effect = Effect::edits,
       .run = set_target_pose});
  all.push_back({.name = "robot.joint_value",
                 .classic = "PRobot Link GetAngle(joint, angles=degrees)|PRobot GetAngle(joint, "
                            "angles=degrees)",
                 .summary = "Returns the value of one joint at which a world shows the robot.",
                 .details = "",
                 .example = arm_in_cell("arm:set_joint{joint = 3, value = 0.5}\n"
                                        "assert(arm:joint_value(3) == 0.5)"),
                 .params = {self("robot"), joint, world, angle_unit()},
                 .returns = {"real", "", "rad or m; angles in the unit set by `angles`.", {}},
                 .effect = Effect::reads,
                 .run = joint_value});
  all.push_back({.name = "robot.joint_limit",
                 .classic =
                     "PRobot Link GetMinAngle(joint, limit=lower, angles=degrees)|PRobot "
                     "GetMinAngle(joint, limit=lower, angles=degrees)|PRobot Link "
                     "GetMaxAngle(joint, limit=upper, angles=degrees)|PRobot GetMaxAngle(joint, "
                     "limit=upper, angles=degrees)",
                 .summary = "Returns a limit of one joint.",
                 .details = "Infinite if it has none.",
                 .example = with_arm("assert(arm:joint_limit(1, \"upper\") == 3)"),
                 .params = {self("robot"), joint,
                            choice("limit", {"lower", "upper"}, "Which of the two limits.", true),
                            angle_unit()},
                 .returns = {"real", "", "rad or m; angles in the unit set by `angles`.", {}},
                 .effect = Effect::reads,
                 .run = joint_limit});
  all.push_back(
      {.name = "robot.pose_values",
       .classic = "PRobot LLRL mGetOriginAngles(name=home)|PRobot LLRL "
                  "mGetNestAngles(name=nest)",
       .summary = "Returns the joint values of a named pose.",
       .details = "\"home\" is all zeros if the robot has no pose of that name.",
       .example = with_arm("assert(arm:pose_values(\"ready\")[5] == 1)"),
       .params = {self("robot"), needed("name", "string", "", "Name of the pose."), angle_unit()},
       .returns =
           {"array", "rad or m", "One value per joint; angles in the unit set by `angles`.", {}},
       .effect = Effect::reads,
       .run = pose_values});
  all.push_back(
      {.name = "robot.link_parameters",
       .classic = "PRobot Link vGetDHp(link, angles=degrees)",
       .summary = "Returns the row of one link, its limits and its values in two poses.",
       .details = "Nine numbers as in the program of 2006: alpha, a [m], theta, d [m], minimum, "
                  "maximum, origin (pose home), nest (pose nest, otherwise home), type (0 "
                  "revolute, 1 prismatic). The joint's value is added to theta or d.",
       .example = with_arm("local p = arm:link_parameters(2)\nassert(#p == 9 and p[2] == 0.45)"),
       .params = {self("robot"),
                  needed("link", "any", "", "Number, 1 is the first, or name of the link."),
                  angle_unit()},
       .returns = {"array", "", "Nine numbers; angles in the unit set by `angles`.", {}},
       .effect = Effect::reads,
       .run = link_parameters});
  all.push_back(
      {.name = "robot.rotation_vector",
       .classic = "PRobot LLRL RotVec",
       .summary = "Returns the orientation of the tool as a rotation vector: axis times angle.",
       .details =
           "In the robot's mounting frame. spatial.convert returns its other representations.",
       .example = arm_in_cell(
           "local v = arm:rotation_vector()\nassert(math.abs(spatial.convert{rotation_vector = "
           "v}.quaternion[1] - arm:fk().quaternion[1]) < 1e-12)"),
       .params = {self("robot"),
                  optional("q", "any", "rad or m",
                           "Joint values or the name of a pose; those shown if omitted. Or the 9 "
                           "or 16 numbers of a matrix, to convert its rotation instead."),
                  world},
       .returns = {"vec3", "rad", "", {}},
       .effect = Effect::reads,
       .run = rotation_vector});
  all.push_back({.name = "robot.tool_transform",
                 .classic = "PRobot GetToolTransformId",
                 .summary = "Returns the name of a robot's tool in the transform commands.",
                 .details = "",
                 .example = with_arm("transform.set(arm:tool_transform(), \"P3\", \"150 mm\")\n"
                                     "assert(arm:tool().position[3] == 0.15)"),
                 .params = {self("robot")},
                 .returns = {"string", "", "A name such as arm.tool.", {}},
                 .effect = Effect::reads,
                 .run = tool_transform});
  return all;
}

}  // namespace robomosp::ioci
