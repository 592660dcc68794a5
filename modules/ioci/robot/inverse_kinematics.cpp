// SPDX-License-Identifier: Apache-2.0
// Inverse kinematics of one pose and of many: joint values, branches by name, what joint limits
// take away.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "ioci/robot/array_units.h"
#include "ioci/robot/branch_wish.h"
#include "ioci/robot/robots.h"
#include "ioci/robot/shown_robot.h"
#include "robotics/maker_axes.h"
#include "sim/ik_question.h"
#include "spatial/pose.h"
#include "spatial/print.h"

namespace robomosp::ioci {
namespace {

using model::Robot;

/// Changes of branch that an answer lists.
constexpr std::size_t kMostChanges = 4096;

std::string_view status_word(IkStatus s) {
  switch (s) {
    case IkStatus::solved: return "solved";
    case IkStatus::out_of_reach: return "out_of_reach";
    case IkStatus::joint_limit: return "joint_limit";
    case IkStatus::not_converged: return "not_converged";
  }
  return "not_converged";
}

Result<model::ProviderChoice> chosen(const Map& args, const model::ProviderChoice& robots_own) {
  return has(args, "provider") ? read_provider(*args.find("provider"), "provider")
                               : Result<model::ProviderChoice>(robots_own);
}

/// Why there is no solution, or which way the tip has lost: as far as the solver knows.
void set_reasons(Map& out, const RobotModel& m, const IkResult& result) {
  out.set("shortfall", result.shortfall);
  if (result.limiting_joint >= 0 &&
      static_cast<std::size_t>(result.limiting_joint) < m.joints.size())
    out.set("limiting_joint", m.joints[static_cast<std::size_t>(result.limiting_joint)].name);
  const auto& lost = result.lost_direction;
  if (lost == std::array<double, 6>{}) return;
  const Vec3 v = spatial::rotate(m.base, Vec3{lost[0], lost[1], lost[2]});
  const Vec3 w = spatial::rotate(m.base, Vec3{lost[3], lost[4], lost[5]});
  out.set("lost_direction", NumericArray({v[0], v[1], v[2], w[0], w[1], w[2]}));
}

/// One command: the robot, its solver, what is asked.
Result<sim::IkQuestion> read_question(CommandContext& ctx, const Map& args) {
  sim::IkQuestion out;
  const Robot& r = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(out.model, model_of(ctx, args));
  RMP_TRY_ASSIGN(out.tip, tip_index(*out.model, args));
  RMP_TRY_ASSIGN(out.choice, chosen(args, r.ik));
  RMP_TRY_ASSIGN(out.bound, ctx.app.solvers.ik(ctx.app.registry, out.model, out.choice));
  RMP_TRY_ASSIGN(const ProviderInfo info,
                 ctx.app.registry.find(IkSolver::kInterfaceId, out.bound.provider));
  out.tags = info.tags;
  out.where = "robot " + text::quote(out.model->name);
  if (auto axes = robotics::MakerAxes::of(r); axes.ok()) out.axes = std::move(*axes);
  out.names = sim::BranchNames(out.bound, static_cast<std::int32_t>(out.tip));
  out.is_ignoring = text_of(args, "limits") == "ignore";
  RMP_TRY(out.refuse_unused(ctx.app.registry, has(args, "arm_angle"), has(args, "branch")));
  if (has(args, "branch")) {
    RMP_TRY_ASSIGN(out.wish, read_branch_wish(out.names, *args.find("branch"), "branch"));
  }
  return out;
}

/// The tolerances and the tip of what is asked.
IkBatch batch_of(const sim::IkQuestion& asked, const Map& args) {
  IkBatch out;
  out.tolerance = {real(args, "position_tolerance"), real(args, "rotation_tolerance")};
  out.tip = static_cast<std::int32_t>(asked.tip);
  return out;
}

List beyond_list(const sim::IkQuestion& asked, std::span<const sim::IkSolution> beyond) {
  List out;
  for (const sim::IkSolution& s : beyond) {
    const JointModel& j = asked.model->joints[static_cast<std::size_t>(s.excess.joint)];
    Map row{{"q", NumericArray(s.q, joint_array_unit(*asked.model))},
            {"joint", j.name},
            {"by", s.excess.by},
            {"value", s.excess.value},
            {"limit", s.excess.limit},
            {"detail", asked.excess_words(s.excess, s.q)}};
    if (!asked.names.empty()) row.set("branch", asked.names.name(s.measures));
    out.emplace_back(std::move(row));
  }
  return out;
}

Result<Value> solve_ik(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const sim::IkQuestion asked, read_question(ctx, args));
  const RobotModel& m = *asked.model;
  std::vector<double> seed;
  std::optional<Pose> target;
  if (has(args, "target")) {
    target = pose_from(*args.find("target"));
    if (!target)
      return error(ErrorCode::invalid_argument, "the target is not a pose", {}, "target");
  } else {
    auto s = shown_robot(ctx, args);
    if (!s.ok()) {
      Error e = std::move(s).error();
      e.message = "no target is given, and " + e.message;
      e.hint = "Give target, or have one world show it, whose target is meant then.";
      return e;
    }
    target = target_in_mounting(ctx, *s);
    seed = s->q;
  }
  const Pose in_base = spatial::compose(spatial::inverse(m.base), *target);
  if (has(args, "seed")) {
    RMP_TRY_ASSIGN(seed, read_q(*args.find("seed"), content<Robot>(ctx, args), m.joints, "seed"));
  }
  IkBatch batch = batch_of(asked, args);
  batch.targets = std::span(&in_base, 1);
  batch.seeds = seed;
  const double arm_angle = has(args, "arm_angle") ? real(args, "arm_angle") : 0.0;
  if (has(args, "arm_angle")) batch.arm_angles = std::span(&arm_angle, 1);
  const bool wants_all = flag(args, "all");
  RMP_TRY_ASSIGN(const sim::IkAnswer answer,
                 sim::solve_one(ctx.app.registry, asked, batch, wants_all, ctx.progress));
  const IkResult& result = answer.result;
  const std::vector<sim::IkSolution>&found = answer.found, &beyond = answer.beyond;
  if (result.status != IkStatus::solved && !flag(args, "partial")) {
    std::string message =
        result.detail.empty() ? std::string(sim::status_sentence(result.status)) : result.detail;
    if (!answer.limits.empty()) message += "; " + answer.limits;
    return error(ErrorCode::unreachable, std::move(message),
                 answer.limits.empty()
                     ? "Move the target, or give partial = true to get the closest configuration."
                     : "Move the target, or give partial = true to get the closest configuration, "
                       "or limits = \"ignore\" to get those beyond.",
                 asked.where);
  }
  Map out{{"status", status_word(result.status)}};
  const std::string unit = joint_array_unit(m);
  const std::size_t n = m.coordinate_count();
  if (!found.empty()) out.set("q", NumericArray(found.front().q, unit));
  std::vector<double> rows;
  for (const sim::IkSolution& s : found) rows.insert(rows.end(), s.q.begin(), s.q.end());
  out.set("solutions", found.empty() ? Value(List{})
                                     : Value(NumericArray(std::move(rows), found.size(), n, unit)));
  out.set("position_error", result.position_error);
  out.set("rotation_error", result.rotation_error);
  out.set("iterations", static_cast<std::int64_t>(result.iterations));
  std::string detail = result.detail;
  if (!answer.limits.empty()) detail += (detail.empty() ? "" : "; ") + answer.limits;
  out.set("detail", detail);
  set_reasons(out, m, result);
  if (!asked.names.empty() && !found.empty()) {
    out.set("branch", asked.names.name(found.front().measures));
    List branches;
    for (const sim::IkSolution& s : found) branches.emplace_back(asked.names.name(s.measures));
    out.set("branches", std::move(branches));
  }
  if (wants_all || asked.is_ignoring || !beyond.empty()) {
    out.set("beyond_limits", static_cast<std::int64_t>(beyond.size()));
    out.set("beyond", beyond_list(asked, beyond));
  }
  if (asked.is_ignoring) {
    List within;
    for (const sim::IkSolution& s : found) within.emplace_back(s.excess.joint < 0);
    out.set("within_limits", std::move(within));
  }
  out.set("provider", asked.bound.provider);
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
  RMP_TRY_ASSIGN(const sim::IkQuestion asked, read_question(ctx, args));
  const RobotModel& m = *asked.model;
  const Pose base_T_mounting = spatial::inverse(m.base);
  std::vector<Pose> targets;
  for (const Value& v : *args.find("targets")->as_list()) {
    const std::string path = "targets[" + std::to_string(targets.size() + 1) + "]";
    RMP_TRY_ASSIGN(const Value pose, check_value(field("", "pose", "", ""), v, path));
    const auto target = pose_from(pose);
    if (!target)
      return error(ErrorCode::invalid_argument,
                   "target " + std::to_string(targets.size() + 1) + " is not a pose",
                   "Give poses such as pose(0.5, 0, 0.3).", path);
    targets.push_back(spatial::compose(base_T_mounting, *target));
  }
  RMP_TRY_ASSIGN(auto seeds, read_seeds(args, content<Robot>(ctx, args), m));
  const std::vector<double> arm_angles = reals(args.find("arm_angle"));
  IkBatch batch = batch_of(asked, args);
  batch.targets = targets;
  batch.seeds = seeds;
  batch.arm_angles = arm_angles;
  batch.continuous = flag(args, "continuous");
  RMP_TRY_ASSIGN(const auto answers, sim::solve_many(ctx.app.registry, asked, batch, ctx.progress));
  const std::size_t n = m.coordinate_count();
  std::vector<double> q, position, rotation, shortfall;
  List status, detail, within;
  std::int64_t solved = 0;
  for (const sim::IkRow& row : answers) {
    const IkResult& result = row.result;
    q.insert(q.end(), result.q.begin(), result.q.end());
    within.emplace_back(row.is_within);
    status.emplace_back(std::string(row.is_other ? "other_branch" : status_word(result.status)));
    detail.emplace_back(result.detail);
    position.push_back(result.position_error);
    rotation.push_back(result.rotation_error);
    shortfall.push_back(result.shortfall);
    solved += result.status == IkStatus::solved && !row.is_other ? 1 : 0;
  }
  Map out{{"solved", solved}};
  if (!asked.names.empty()) {
    const std::vector<double> measures = asked.names.measure(q);
    const std::size_t each = asked.names.choices().size();
    List branches, changes;
    for (std::size_t i = 0; i < answers.size(); ++i)
      branches.emplace_back(asked.names.name(std::span(measures).subspan(i * each, each)));
    out.set("branches", std::move(branches));
    if (batch.continuous) {
      for (const sim::BranchChange& c : sim::branch_changes(asked.names, q, kMostChanges))
        changes.emplace_back(Map{{"target", c.at + 1}, {"from", c.from}, {"to", c.to}});
      out.set("branch_changes", std::move(changes));
    }
  }
  if (asked.is_ignoring) out.set("within_limits", std::move(within));
  out.set("q", answers.empty()
                   ? Value(List{})
                   : Value(NumericArray(std::move(q), answers.size(), n, joint_array_unit(m))));
  out.set("status", std::move(status));
  out.set("detail", std::move(detail));
  out.set("position_error", NumericArray(std::move(position), "m"));
  out.set("rotation_error", NumericArray(std::move(rotation), "rad"));
  out.set("shortfall", NumericArray(std::move(shortfall), "m"));
  out.set("provider", asked.bound.provider);
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(inverse_kinematics_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec tip =
      optional("tip", "string", "",
               "Name of the tip in a branched robot; by default the tool of the last link.");
  const ParamSpec provider =
      optional("provider", "any", "",
               "Name of the solver, or {name = ..., params = {...}}; by default the robot's own, "
               "otherwise a closed form that supports the robot, otherwise the default provider.");
  const ParamSpec branch = optional(
      "branch", "any", "",
      "For solvers that name branches: a text such as \"left up no flip\", or a table {shoulder = "
      "\"left\", elbow = \"up\", wrist = \"flip\"}; omitted parts may be either.");
  const ParamSpec limits =
      choice("limits", {"apply", "ignore"},
             "Joint limits; ignore also returns solutions beyond them, marked in within_limits.");
  all.push_back(
      {.name = "robot.solve_ik",
       .classic = "PRobot LLRL IKine",
       .summary = "Finds joint values that bring the tool to a pose: inverse kinematics.",
       .details =
           "The target is given in the mounting frame. A target that cannot be reached is an error "
           "of code unreachable that gives the remaining distance, unless partial = true.",
       .example = with_arm("local target = arm:fk{q = \"ready\"}.pose\nlocal s = "
                           "arm:solve_ik{target = target, seed = {0, -0.8, 0.5, 0, 0.9, "
                           "0}}\nassert(s.status == \"solved\" and s.position_error < 1e-8)"),
       .params = {self("robot"),
                  optional("target", "pose", "",
                           "Pose of the tool to reach; by default the target of the world that "
                           "shows the robot, starting at the joint values shown."),
                  optional("seed", "any", "rad or m",
                           "Joint values to start from, or the name of a pose."),
                  defaulted("all", "bool", "", false,
                            "Return every solution that the solver can distinguish."),
                  defaulted("partial", "bool", "", false,
                            "Return the closest configuration if the target cannot be reached."),
                  above_zero(defaulted("position_tolerance", "real", "m", 1e-9,
                                       "Tolerance for reaching the position.")),
                  above_zero(defaulted("rotation_tolerance", "real", "rad", 1e-9,
                                       "Tolerance for reaching the rotation.")),
                  provider, tip,
                  optional(
                      "arm_angle", "real", "rad",
                      "For 7-joint arms, with a solver tagged arm_angle: rotation of the elbow "
                      "about the line from shoulder to wrist; 0 is the plane of axis 1."),
                  branch, limits, shown_world()},
       .returns =
           {"map",
            "",
            "",
            {field("status", "string", "", "solved, out_of_reach, joint_limit or not_converged."),
             field("q", "real[]", "rad or m", "The (first) solution."),
             field("solutions", "matrix", "rad or m", "One row per solution."),
             field("position_error", "real", "m", "Remaining error of the first solution."),
             field("rotation_error", "real", "rad", "Remaining error of the first solution."),
             field("iterations", "int", "", "Iterations of the solver."),
             field(
                 "detail", "string", "",
                 "Reason if not solved, or a remark that q is close to a singular configuration."),
             field("shortfall", "real", "m",
                   "Least distance by which the target is out of reach; 0 if not known."),
             field("limiting_joint", "string", "",
                   "The joint that prevents the solution by its limit, if known."),
             field("lost_direction", "real[]", "",
                   "If q is singular or close to it: the unit twist (vx, vy, vz, wx, wy, wz) that "
                   "the tip has lost, axes of the mounting frame."),
             field("branch", "string", "",
                   "Branch of the first solution, if the solver names branches."),
             field("branches", "list", "", "Branch of each solution."),
             field("beyond_limits", "int", "",
                   "Number of solutions beyond joint limits: with all = true, a branch, limits = "
                   "\"ignore\", or if there is none within the limits."),
             field("beyond", "list", "",
                   "For each of them q, branch, the joint farthest beyond its limit, by how much, "
                   "its value and limit, and detail."),
             field("within_limits", "list", "",
                   "With limits = \"ignore\": whether each solution is within the limits."),
             field("provider", "string", "", "The solver.")}},
       .effect = Effect::reads,
       .run = solve_ik});
  all.push_back(
      {.name = "robot.solve_ik_batch",
       .classic = "",
       .summary = "Finds joint values for many poses of the tool in one call.",
       .details = "Poses are in the mounting frame. An unreachable pose is not an error: see "
                  "status and detail; q is the closest configuration found.",
       .example = with_arm("local a = arm:fk{q = \"ready\"}.pose\nlocal b = arm:fk{q = {0.1, -0.8, "
                           "0.5, 0, 0.9, 0}}.pose\nlocal s = arm:solve_ik_batch{targets = {a, b}, "
                           "seed = \"ready\"}\nassert(s.solved == 2 and #s.q == 2)"),
       .params =
           {self("robot"), needed("targets", "list", "", "Poses of the tool."),
            optional(
                "seed", "any", "rad or m",
                "Joint values to start from, the name of a pose, or a list with one per target."),
            defaulted(
                "continuous", "bool", "", false,
                "The poses are samples of one path: each search starts from the solution before."),
            optional("arm_angle", "real[]", "rad",
                     "For 7-joint arms, see robot.solve_ik: one for all targets, or one each."),
            above_zero(defaulted("position_tolerance", "real", "m", 1e-9,
                                 "Tolerance for reaching the position.")),
            above_zero(defaulted("rotation_tolerance", "real", "rad", 1e-9,
                                 "Tolerance for reaching the rotation.")),
            provider, tip, branch, limits},
       .returns = {"map",
                   "",
                   "",
                   {field("solved", "int", "", "Number of targets reached."),
                    field("q", "matrix", "rad or m", "One row per target."),
                    field("status", "list", "",
                          "Status as in robot.solve_ik, or other_branch: q is on another branch "
                          "than requested."),
                    field("detail", "list", "", "Reasons as text."),
                    field("position_error", "array", "m", "One per target."),
                    field("rotation_error", "array", "rad", "One per target."),
                    field("shortfall", "array", "m", "One per target; 0 if not known."),
                    field("branches", "list", "", "One per target, if the solver names branches."),
                    field(
                        "branch_changes", "list", "",
                        "With continuous: changes of the branch along the path: target, from, to."),
                    field("within_limits", "list", "", "With limits = \"ignore\", one per target."),
                    field("provider", "string", "", "The solver.")}},
       .effect = Effect::reads,
       .run = solve_ik_batch});
  return all;
}

}  // namespace robomosp::ioci
