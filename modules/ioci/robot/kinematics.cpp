// SPDX-License-Identifier: Apache-2.0
// What a robot does: forward kinematics, Jacobian, and where worlds show it.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "robotics/closure.h"
#include "robotics/coordinates.h"
#include "robotics/home.h"
#include "robotics/kinematics.h"
#include "robotics/singularity.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::Robot;

struct Posed {
  std::shared_ptr<const RobotModel> model;
  std::vector<double> q;
  std::vector<Pose> frames;  ///< base_T_joint
};

Result<Posed> posed(CommandContext& ctx, const Map& args) {
  Posed p;
  RMP_TRY_ASSIGN(p.model, model_of(ctx, args));
  RMP_TRY_ASSIGN(p.q, given_or_shown(ctx, args, *p.model));
  p.frames.resize(p.model->joints.size());
  robotics::forward_kinematics(*p.model, p.q, p.frames);
  return p;
}

Result<Value> fk(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Posed p, posed(ctx, args));
  if (flag(args, "close")) {
    const robotics::Closure closed =
        robotics::close_loops(*p.model, p.q, p.q, robotics::actuated_velocities(*p.model));
    RMP_TRY(closed_or_fault(*p.model, closed));
    p.q = closed.q;
    robotics::forward_kinematics(*p.model, p.q, p.frames);
  }
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*p.model, args));
  Map out = pose_map(spatial::compose(p.model->base, robotics::tip_pose(*p.model, tip, p.frames)));
  if (flag(args, "all")) {
    const Robot& r = content<Robot>(ctx, args);
    const auto frames = robotics::link_frames(r);
    std::vector<Pose> poses(frames.size());
    robotics::link_poses(frames, p.frames, poses);
    List links;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Map link = pose_map(spatial::compose(p.model->base, poses[i]));
      link.set("name", r.links[i].name);
      links.emplace_back(std::move(link));
    }
    out.set("links", std::move(links));
  }
  if (flag(args, "close")) out.set("q", NumericArray(p.q));
  return Value(std::move(out));
}

Result<Value> link_pose(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const std::int32_t index, read_link(r, *args.find("link"), false, "link"));
  std::vector<double> q = robotics::neutral_coordinates(*m);
  if (flag(args, "shown") && !has(args, "q")) {
    RMP_TRY_ASSIGN(q, shown_or_home(ctx, args));
  }
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(q, read_q(*args.find("q"), r, m->joints, "q"));
  }
  std::vector<Pose> frames(m->joints.size());
  robotics::forward_kinematics(*m, q, frames);
  const auto all = robotics::link_frames(r);
  std::vector<Pose> poses(all.size());
  robotics::link_poses(all, frames, poses);
  Pose out = poses[static_cast<std::size_t>(index)];
  if (text_of(args, "frame") == "parent") {
    const std::int32_t parent = r.links[static_cast<std::size_t>(index)].parent;
    if (parent >= 0)
      out = spatial::compose(spatial::inverse(poses[static_cast<std::size_t>(parent)]), out);
  } else {
    out = spatial::compose(m->base, out);
  }
  return Value(pose_map(out));
}

/// `mGetLocal` and `mGetGlobal` are the two frames of robot.link_pose.
Result<Value> link_pose_parent(CommandContext& ctx, const Map& args) {
  Map local = args;
  local.set("frame", "parent");
  return link_pose(ctx, local);
}

/// Jacobian joint after joint as the matrix of the textbooks: 6 rows (v, w), one column a joint.
NumericArray jacobian_matrix(const std::vector<double>& columns, std::size_t dof) {
  std::vector<double> rows(6 * dof);
  for (std::size_t j = 0; j < dof; ++j)
    for (std::size_t i = 0; i < 6; ++i) rows[i * dof + j] = columns[6 * j + i];
  return NumericArray(std::move(rows), 6, dof);
}

Result<Value> jacobian(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Posed p, posed(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*p.model, args));
  std::vector<double> j(6 * p.model->dof());
  const auto frame = text_of(args, "frame") == "tool" ? robotics::JacobianFrame::tip
                                                      : robotics::JacobianFrame::world;
  robotics::geometric_jacobian(*p.model, tip, p.frames, frame, j);
  return Value(jacobian_matrix(j, p.model->dof()));
}

Result<Value> manipulability(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const Posed p, posed(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*p.model, args));
  RMP_TRY_ASSIGN(const robotics::TipMotion motion, closed_tip_motion(*p.model, tip, p.frames));
  const std::string measure = text_of(args, "measure"), part = text_of(args, "part");
  if (measure == "yoshikawa" && part == "all" && motion.loose.empty())
    return Value(robotics::manipulability(motion.jacobian));
  const robotics::Dexterity d =
      robotics::dexterity(motion.jacobian,
                          part == "translation" ? robotics::TwistPart::translation
                          : part == "rotation"  ? robotics::TwistPart::rotation
                                                : robotics::TwistPart::all,
                          1, motion.self_motion_twists);
  return Value(measure == "condition" ? d.condition : measure == "least" ? d.least : d.yoshikawa);
}

Result<Value> set_joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(auto q, read_joints(args, *args.find("q"), content<Robot>(ctx, args), *m, "q"));
  return put_joints(ctx, args, s, std::move(q));
}

Result<Value> add_joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(const auto step,
                 read_joints(args, *args.find("q"), content<Robot>(ctx, args), *m, "q"));
  const auto units = robotics::coordinate_units(*m);
  for (std::size_t i = 0; i < step.size() && i < s.q.size(); ++i) {
    if (units[i].empty())
      return error(ErrorCode::unsupported, "quaternions cannot be added to",
                   "Set the joints with robot.set_joints.", "robot " + text::quote(m->name));
    s.q[i] += step[i];
  }
  return put_joints(ctx, args, s, std::move(s.q));
}

Result<Value> joint_values(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(ShownRobot s, shown_robot(ctx, args));
  return Value(NumericArray(std::move(s.q)));
}

}  // namespace

RMP_COMMANDS(robot_motion_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec q =
      needed("q", "any", "rad or m", "Joint values, one a joint, or the name of a pose.");
  const ParamSpec q_or_shown =
      optional("q", "any", "rad or m",
               "Joint values, one a joint, or the name of a pose; those at which the only world "
               "that has the robot shows it when left out.");
  const ParamSpec tip =
      optional("tip", "string", "",
               "Name of the tip in a branched robot; the tool of the last link when left out.");
  const std::vector<ParamSpec> pose_fields{field("pose", "pose", "", "4x4 homogeneous matrix."),
                                           field("position", "vec3", "m", "Position."),
                                           field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                                           field("quaternion", "real[]", "", "w, x, y, z.")};
  auto fk_fields = pose_fields;
  fk_fields.push_back(
      field("links", "list", "", "With all = true: the same of every link, and its name."));
  fk_fields.push_back(field("q", "real[]", "", "With close = true: the closed configuration."));
  const char* const mounting =
      "In the frame the robot is mounted in, which is its base frame unless the robot has a base "
      "placement.";

  all.push_back(
      {.name = "robot.fk",
       .classic = "PRobot LLRL FKine|PRobot LLRL mGetOutHMT()",
       .summary = "Gives the pose of the tool for given joint values.",
       .details = mounting,
       .example =
           with_arm("local t = arm:fk{q = {0, 0, 0, 0, 0, 0}}\nassert(math.abs(t.position[1] - "
                    "0.5) < 1e-12)\nassert(#arm:fk{q = \"ready\", all = true}.links == 6)"),
       .params = {self("robot"), q_or_shown,
                  defaulted("all", "bool", "", false, "Also the frames of all links."), tip,
                  defaulted("close", "bool", "", false,
                            "First closes the loops: joints without motors move to where those "
                            "with motors, as given, put them.")},
       .returns = {"map", "", "", fk_fields},
       .effect = Effect::reads,
       .run = fk});
  const ParamSpec link = needed("link", "any", "", "Number, 1 is the first, or name of the link.");
  const ParamSpec q_optional =
      optional("q", "any", "rad or m", "Joint values or the name of a pose; zeros when left out.");
  const ParamSpec shown =
      defaulted("shown", "bool", "", false,
                "Without q at the joint values at which a world shows the robot, else at home.");
  all.push_back(
      {.name = "robot.link_pose",
       .classic = "PRobot Link mGetGlobal(link, shown=true)",
       .summary = "Gives the frame of one link.",
       .details = std::string(mounting) + " Classic: `PRobot <id> Link <i> mGetGlobal`.",
       .example = with_arm("assert(math.abs(arm:link_pose{link = 1}.position[3] - 0.4) < 1e-12)"),
       .params = {self("robot"), link, q_optional,
                  choice("frame", {"mounting", "parent"},
                         "Relative to the mounting frame or to the link before."),
                  shown},
       .returns = {"map", "", "", pose_fields},
       .effect = Effect::reads,
       .run = link_pose});
  all.push_back({.name = "robot.link_pose_local",
                 .classic = "PRobot Link mGetLocal(link, shown=true)",
                 .summary = "Gives the frame of one link in that of the link it stands on.",
                 .details = "Classic: `PRobot <id> Link <i> mGetLocal`.",
                 .example = with_arm(
                     "assert(math.abs(arm:link_pose_local{link = 2}.position[1] - 0.45) < 1e-12)"),
                 .params = {self("robot"), link, q_optional, shown},
                 .returns = {"map", "", "", pose_fields},
                 .effect = Effect::reads,
                 .run = link_pose_parent});
  all.push_back(
      {.name = "robot.jacobian",
       .classic = "PRobot LLRL mJacobian|PRobot LLRL mJacobian Local(frame=tool, q)|PRobot LLRL "
                  "mJacobian Global(frame=base, q)",
       .summary = "Gives the geometric Jacobian of the tool.",
       .details = "Six rows (vx, vy, vz, wx, wy, wz), one column a joint; the reference point is "
                  "the tool's origin. Each joint counts as moving by itself, also in a robot with "
                  "closed loops; robot.dexterity counts the motions that keep those closed.",
       .example =
           with_arm("local j = arm:jacobian{q = \"ready\", frame = \"tool\"}\nassert(#j == 6)"),
       .params = {self("robot"), q_or_shown,
                  choice("frame", {"base", "tool"}, "Axes that velocities are expressed in."), tip},
       .returns = {"matrix", "", "6 x joints.", {}},
       .effect = Effect::reads,
       .run = jacobian});
  all.push_back(
      {.name = "robot.manipulability",
       .classic = "",
       .summary = "Gives Yoshikawa's measure of how far the robot is from a singularity.",
       .details = "sqrt(det(J J^T)), for fewer than six joints sqrt(det(J^T J)); 0 when singular.",
       .example = with_arm("assert(arm:manipulability{q = \"ready\"} > 0)"),
       .params = {self("robot"), q,
                  choice("measure", {"yoshikawa", "condition", "least"},
                         "Product of the singular values, the greatest over the least, or the "
                         "least; robot.dexterity gives all of them."),
                  choice("part", {"all", "translation", "rotation"}, "Of the tool's motion."), tip},
       .returns = {"real", "", "", {}},
       .effect = Effect::reads,
       .run = manipulability});
  const std::string in_world =
      "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n";
  const ParamSpec world = shown_world();
  all.push_back({.name = "robot.joint_values",
                 .classic = "PRobot LLRL mGetInJointp",
                 .summary = "Gives the joint values at which a world shows the robot.",
                 .details = "",
                 .example = with_arm((in_world + "assert(#arm:joint_values() == 6)").c_str()),
                 .params = {self("robot"), world},
                 .returns = {"array", "rad or m", "", {}},
                 .effect = Effect::reads,
                 .run = joint_values});
  all.push_back(
      {.name = "robot.set_joints",
       .classic = "PRobot SetLinks(q, angles=degrees)",
       .summary = "Sets the joint values at which a world shows the robot.",
       .details = "",
       .example = with_arm(
           (in_world + "arm:set_joints(\"ready\")\nassert(arm:joint_values()[5] == 1)").c_str()),
       .params = {self("robot"), q, world, angle_unit()},
       .returns = {"array", "rad or m", "The joint values now; angles by the argument.", {}},
       .effect = Effect::edits,
       .run = set_joints});
  all.push_back(
      {.name = "robot.add_joints",
       .classic = "PRobot AddLinks(q, angles=degrees)",
       .summary = "Adds to the joint values at which a world shows the robot.",
       .details = "",
       .example = with_arm(
           (in_world + "arm:add_joints({0.1, 0, 0, 0, 0, 0})\nassert(arm:joint_values()[1] == 0.1)")
               .c_str()),
       .params = {self("robot"), q, world, angle_unit()},
       .returns = {"array", "rad or m", "The joint values now; angles by the argument.", {}},
       .effect = Effect::edits,
       .run = add_joints});
  return all;
}

}  // namespace robomosp::ioci
