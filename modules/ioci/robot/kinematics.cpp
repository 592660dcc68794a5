// SPDX-License-Identifier: Apache-2.0
// What a robot does: forward and inverse kinematics, Jacobian, and where worlds show it.
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

Result<std::size_t> tip_index(const RobotModel& m, const Map& args) {
  if (!has(args, "tip")) return std::size_t{0};
  std::vector<std::string> known;
  const std::string wanted = text_of(args, "tip");
  for (std::size_t i = 0; i < m.tips.size(); ++i) {
    if (m.tips[i].name == wanted) return i;
    known.push_back(m.tips[i].name);
  }
  return unknown_name("tip", wanted, known).in("robot " + text::quote(m.name));
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

std::string_view status_word(IkStatus s) {
  switch (s) {
    case IkStatus::solved: return "solved";
    case IkStatus::out_of_reach: return "out_of_reach";
    case IkStatus::joint_limit: return "joint_limit";
    case IkStatus::not_converged: return "not_converged";
  }
  return "not_converged";
}

std::string_view status_sentence(IkStatus s) {
  switch (s) {
    case IkStatus::out_of_reach: return "the target is out of reach";
    case IkStatus::joint_limit: return "the target can only be reached outside the joint limits";
    default: return "no configuration was found for the target";
  }
}

Result<model::ProviderChoice> chosen(const Map& args, const model::ProviderChoice& robots_own) {
  return has(args, "provider") ? read_provider(*args.find("provider"), "provider")
                               : Result<model::ProviderChoice>(robots_own);
}

/// The unit all joints share: `turning` for revolute ones, `sliding` for prismatic ones, else
/// `mixed`.
std::string shared_unit(const RobotModel& m, const char* turning, const char* sliding,
                        const char* mixed) {
  if (!m.is_simple()) return mixed;
  const auto slides = [](const JointModel& j) { return j.type == JointType::prismatic; };
  if (std::none_of(m.joints.begin(), m.joints.end(), slides)) return turning;
  return std::all_of(m.joints.begin(), m.joints.end(), slides) ? sliding : mixed;
}
std::string joint_unit(const RobotModel& m) { return shared_unit(m, "rad", "m", "rad or m"); }

/// Why there is no solution, or which way the tip has lost: as far as the solver knows.
void set_reasons(Map& out, const RobotModel& m, const IkResult& result) {
  out.set("shortfall", result.shortfall);
  if (result.limiting_joint >= 0 &&
      static_cast<std::size_t>(result.limiting_joint) < m.joints.size())
    out.set("limiting_joint", m.joints[static_cast<std::size_t>(result.limiting_joint)].name);
  const auto& lost = result.lost_direction;
  if (lost == std::array<double, 6>{}) return;
  const Vec3 v = spatial::rotate(m.base, {lost[0], lost[1], lost[2]});
  const Vec3 w = spatial::rotate(m.base, {lost[3], lost[4], lost[5]});
  out.set("lost_direction", NumericArray({v[0], v[1], v[2], w[0], w[1], w[2]}));
}

Result<Value> solve_ik(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*m, args));
  RMP_TRY_ASSIGN(const auto choice, chosen(args, r.ik));
  const auto target = pose_from(*args.find("target"));
  if (!target) return error(ErrorCode::invalid_argument, "the target is not a pose", {}, "target");
  const Pose in_base = spatial::compose(spatial::inverse(m->base), *target);
  std::vector<double> seed;
  if (has(args, "seed")) {
    RMP_TRY_ASSIGN(seed, read_q(*args.find("seed"), r, m->joints, "seed"));
  }
  RMP_TRY_ASSIGN(const auto bound, ctx.app.solvers.ik(ctx.app.registry, m, choice));
  IkBatch batch;
  batch.targets = std::span(&in_base, 1);
  batch.seeds = seed;
  batch.tolerance = {real(args, "position_tolerance"), real(args, "rotation_tolerance")};
  batch.all_solutions = flag(args, "all");
  batch.tip = static_cast<std::int32_t>(tip);
  const double arm_angle = has(args, "arm_angle") ? real(args, "arm_angle") : 0.0;
  if (has(args, "arm_angle")) batch.arm_angles = std::span(&arm_angle, 1);
  RMP_TRY_ASSIGN(auto results, sim::solve_ik(bound, batch, ctx.progress));
  IkResult& result = results.front();
  report_singular(*m, tip, kIkPose, result);
  if (result.status != IkStatus::solved && !flag(args, "partial")) {
    std::string message =
        result.detail.empty() ? std::string(status_sentence(result.status)) : result.detail;
    return error(ErrorCode::unreachable, std::move(message),
                 "Move the target, or give partial = true to get the closest configuration.",
                 "robot " + text::quote(m->name));
  }
  const std::size_t dof = m->coordinate_count();
  const std::size_t count = result.q.size() / dof;
  Map out{{"status", status_word(result.status)}};
  if (count > 0)
    out.set("q",
            NumericArray(std::vector<double>(result.q.begin(),
                                             result.q.begin() + static_cast<std::ptrdiff_t>(dof)),
                         joint_unit(*m)));
  out.set("solutions",
          count > 0 ? Value(NumericArray(result.q, count, dof, joint_unit(*m))) : Value(List{}));
  out.set("position_error", result.position_error);
  out.set("rotation_error", result.rotation_error);
  out.set("iterations", static_cast<std::int64_t>(result.iterations));
  out.set("detail", result.detail);
  set_reasons(out, *m, result);
  out.set("provider", bound.provider);
  return Value(std::move(out));
}

/// Seeds of a batch: a pose's name, one configuration, or a list of configurations.
Result<std::vector<double>> read_seeds(const Map& args, const Robot& r, const RobotModel& m) {
  std::vector<double> out;
  if (!has(args, "seed")) return out;
  const Value& given = *args.find("seed");
  const bool many =
      given.as_list() && !given.as_list()->empty() && !given.as_list()->front().is_number();
  const bool table = given.as_array() && given.as_array()->is_matrix();
  if (!many && !table) return read_q(given, r, m.joints, "seed");
  if (table) return reals(&given);
  for (const Value& one : *given.as_list()) {
    RMP_TRY_ASSIGN(const auto q, read_q(one, r, m.joints, "seed"));
    out.insert(out.end(), q.begin(), q.end());
  }
  return out;
}

Result<Value> solve_ik_batch(CommandContext& ctx, const Map& args) {
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const std::size_t tip, tip_index(*m, args));
  RMP_TRY_ASSIGN(const auto choice, chosen(args, r.ik));
  const Pose base_T_mounting = spatial::inverse(m->base);
  std::vector<Pose> targets;
  for (const Value& v : *args.find("targets")->as_list()) {
    const auto target = pose_from(v);
    if (!target)
      return error(ErrorCode::invalid_argument,
                   "target " + std::to_string(targets.size() + 1) + " is not a pose",
                   "Give poses such as pose(0.5, 0, 0.3).", "targets");
    targets.push_back(spatial::compose(base_T_mounting, *target));
  }
  RMP_TRY_ASSIGN(const auto seeds, read_seeds(args, r, *m));
  const std::vector<double> arm_angles = reals(args.find("arm_angle"));
  RMP_TRY_ASSIGN(const auto bound, ctx.app.solvers.ik(ctx.app.registry, m, choice));
  IkBatch batch;
  batch.targets = targets;
  batch.seeds = seeds;
  batch.arm_angles = arm_angles;
  batch.tolerance = {real(args, "position_tolerance"), real(args, "rotation_tolerance")};
  batch.continuous = flag(args, "continuous");
  batch.tip = static_cast<std::int32_t>(tip);
  RMP_TRY_ASSIGN(const auto results, sim::solve_ik(bound, batch, ctx.progress));
  const std::size_t n = m->coordinate_count();
  std::vector<double> q, position, rotation, shortfall;
  List status, detail;
  std::int64_t solved = 0;
  for (const IkResult& result : results) {
    // A target without any configuration has the seed's place filled with zeros.
    if (result.q.size() >= n)
      q.insert(q.end(), result.q.begin(), result.q.begin() + static_cast<std::ptrdiff_t>(n));
    else q.insert(q.end(), n, 0.0);
    status.emplace_back(std::string(status_word(result.status)));
    detail.emplace_back(result.detail);
    position.push_back(result.position_error);
    rotation.push_back(result.rotation_error);
    shortfall.push_back(result.shortfall);
    solved += result.status == IkStatus::solved ? 1 : 0;
  }
  Map out{{"solved", solved}};
  out.set("q", results.empty()
                   ? Value(List{})
                   : Value(NumericArray(std::move(q), results.size(), n, joint_unit(*m))));
  out.set("status", std::move(status));
  out.set("detail", std::move(detail));
  out.set("position_error", NumericArray(std::move(position), "m"));
  out.set("rotation_error", NumericArray(std::move(rotation), "rad"));
  out.set("shortfall", NumericArray(std::move(shortfall), "m"));
  out.set("provider", bound.provider);
  return Value(std::move(out));
}

Result<Value> set_joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(const ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(auto q, read_q(*args.find("q"), content<Robot>(ctx, args), m->joints, "q"));
  return put_joints(ctx, s, std::move(q));
}

Result<Value> add_joints(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(ShownRobot s, shown_robot(ctx, args));
  RMP_TRY_ASSIGN(const auto step,
                 read_q(*args.find("q"), content<Robot>(ctx, args), m->joints, "q"));
  const auto units = robotics::coordinate_units(*m);
  for (std::size_t i = 0; i < step.size() && i < s.q.size(); ++i) {
    if (units[i].empty())
      return error(ErrorCode::unsupported, "quaternions cannot be added to",
                   "Set the joints with robot.set_joints.", "robot " + text::quote(m->name));
    s.q[i] += step[i];
  }
  return put_joints(ctx, s, std::move(s.q));
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
  const ParamSpec provider = optional(
      "provider", "any", "",
      "Name of the solver, or {name = ..., params = {...}}; the robot's own choice when left out.");
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
  all.push_back(
      {.name = "robot.link_pose",
       .classic = "PRobot Link mGetGlobal",
       .summary = "Gives the frame of one link.",
       .details = std::string(mounting) + " Classic: `PRobot <id> Link <i> mGetGlobal`.",
       .example = with_arm("assert(math.abs(arm:link_pose{link = 1}.position[3] - 0.4) < 1e-12)"),
       .params = {self("robot"), link, q_optional,
                  choice("frame", {"mounting", "parent"},
                         "Relative to the mounting frame or to the link before.")},
       .returns = {"map", "", "", pose_fields},
       .effect = Effect::reads,
       .run = link_pose});
  all.push_back({.name = "robot.link_pose_local",
                 .classic = "PRobot Link mGetLocal",
                 .summary = "Gives the frame of one link in that of the link it stands on.",
                 .details = "Classic: `PRobot <id> Link <i> mGetLocal`.",
                 .example = with_arm(
                     "assert(math.abs(arm:link_pose_local{link = 2}.position[1] - 0.45) < 1e-12)"),
                 .params = {self("robot"), link, q_optional},
                 .returns = {"map", "", "", pose_fields},
                 .effect = Effect::reads,
                 .run = link_pose_parent});
  all.push_back(
      {.name = "robot.jacobian",
       .classic = "PRobot LLRL mJacobian|PRobot LLRL mJacobian Local(frame=tool, q)|PRobot LLRL "
                  "mJacobian Global(frame=base, q)",
       .summary = "Gives the geometric Jacobian of the tool.",
       .details = "Six rows (vx, vy, vz, wx, wy, wz), one column a joint; the reference point is "
                  "the tool's origin.",
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
  all.push_back(
      {.name = "robot.solve_ik",
       .classic = "PRobot LLRL IKine",
       .summary = "Finds joint values that bring the tool to a pose: inverse kinematics.",
       .details = "The target is given in the frame the robot is mounted in. A target that cannot "
                  "be reached is an error of code unreachable that tells how near one can get, "
                  "unless partial = true.",
       .example = with_arm("local target = arm:fk{q = \"ready\"}.pose\nlocal s = "
                           "arm:solve_ik{target = target, seed = {0, -0.8, 0.5, 0, 0.9, "
                           "0}}\nassert(s.status == \"solved\" and s.position_error < 1e-8)"),
       .params = {self("robot"), needed("target", "pose", "", "Where the tool shall be."),
                  optional("seed", "any", "rad or m",
                           "Joint values to start from, or the name of a pose."),
                  defaulted("all", "bool", "", false, "Every solution the solver can tell apart."),
                  defaulted("partial", "bool", "", false,
                            "Return the closest configuration when the target cannot be reached."),
                  above_zero(defaulted("position_tolerance", "real", "m", 1e-9,
                                       "When the position counts as reached.")),
                  above_zero(defaulted("rotation_tolerance", "real", "rad", 1e-9,
                                       "When the rotation counts as reached.")),
                  provider, tip,
                  optional("arm_angle", "real", "rad",
                           "Of a 7-joint arm, with a solver tagged arm_angle: the elbow turned "
                           "about the line from shoulder to wrist; 0 is the plane of axis 1.")},
       .returns = {"map",
                   "",
                   "",
                   {field("status", "string", "",
                          "solved, out_of_reach, joint_limit or not_converged."),
                    field("q", "real[]", "rad or m", "The (first) solution."),
                    field("solutions", "matrix", "rad or m", "One row a solution."),
                    field("position_error", "real", "m", "What is left of the first."),
                    field("rotation_error", "real", "rad", "What is left of the first."),
                    field("iterations", "int", "", "Steps of the solver."),
                    field("detail", "string", "",
                          "Reason in words when not solved, or that q is next to a singular one."),
                    field("shortfall", "real", "m",
                          "How far the target is out of reach, at least; 0 when not known."),
                    field("limiting_joint", "string", "", "Whose limit is in the way, if known."),
                    field("lost_direction", "real[]", "",
                          "Where q is singular or next to it: the unit twist (vx, vy, vz, wx, wy, "
                          "wz) that the "
                          "tip has lost, axes of the mounting frame."),
                    field("provider", "string", "", "The solver.")}},
       .effect = Effect::reads,
       .run = solve_ik});
  all.push_back(
      {.name = "robot.solve_ik_batch",
       .classic = "",
       .summary = "Finds joint values for many poses of the tool in one call.",
       .details = "Poses are in the frame the robot is mounted in. What cannot be reached is no "
                  "error: status and detail tell it, and q is the closest configuration found.",
       .example = with_arm("local a = arm:fk{q = \"ready\"}.pose\nlocal b = arm:fk{q = {0.1, -0.8, "
                           "0.5, 0, 0.9, 0}}.pose\nlocal s = arm:solve_ik_batch{targets = {a, b}, "
                           "seed = \"ready\"}\nassert(s.solved == 2 and #s.q == 2)"),
       .params = {self("robot"), needed("targets", "list", "", "Poses of the tool."),
                  optional("seed", "any", "rad or m",
                           "Joint values to start from, the name of a pose, or a list: one a "
                           "target."),
                  defaulted("continuous", "bool", "", false,
                            "The poses are samples of one path: each starts from the one before."),
                  optional(
                      "arm_angle", "real[]", "rad",
                      "Of 7-joint arms, see robot.solve_ik: one for all targets, or one each."),
                  above_zero(defaulted("position_tolerance", "real", "m", 1e-9,
                                       "When the position counts as reached.")),
                  above_zero(defaulted("rotation_tolerance", "real", "rad", 1e-9,
                                       "When the rotation counts as reached.")),
                  provider, tip},
       .returns = {"map",
                   "",
                   "",
                   {field("solved", "int", "", "Number of targets reached."),
                    field("q", "matrix", "rad or m", "One row a target."),
                    field("status", "list", "", "Words as of robot.solve_ik."),
                    field("detail", "list", "", "Reasons in words."),
                    field("position_error", "array", "m", "One a target."),
                    field("rotation_error", "array", "rad", "One a target."),
                    field("shortfall", "array", "m", "One a target; 0 when not known."),
                    field("provider", "string", "", "The solver.")}},
       .effect = Effect::reads,
       .run = solve_ik_batch});
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
       .classic = "PRobot SetLinks",
       .summary = "Sets the joint values at which a world shows the robot.",
       .details = "",
       .example = with_arm(
           (in_world + "arm:set_joints(\"ready\")\nassert(arm:joint_values()[5] == 1)").c_str()),
       .params = {self("robot"), q, world},
       .returns = {"array", "rad or m", "The joint values now.", {}},
       .effect = Effect::edits,
       .run = set_joints});
  all.push_back(
      {.name = "robot.add_joints",
       .classic = "PRobot AddLinks",
       .summary = "Adds to the joint values at which a world shows the robot.",
       .details = "",
       .example = with_arm(
           (in_world + "arm:add_joints({0.1, 0, 0, 0, 0, 0})\nassert(arm:joint_values()[1] == 0.1)")
               .c_str()),
       .params = {self("robot"), q, world},
       .returns = {"array", "rad or m", "The joint values now.", {}},
       .effect = Effect::edits,
       .run = add_joints});
  return all;
}

}  // namespace robomosp::ioci
