// SPDX-License-Identifier: Apache-2.0
// Motions around obstacles.
#include <robomosp/sdk/planner.h>
#include <robomosp/sdk/retimer.h>

#include "collision/collision.h"
#include "ioci/core/commands.h"
#include "ioci/core/watchers.h"
#include "sim/base_motion.h"
#include "sim/motion_planning.h"

namespace robomosp::ioci {
namespace {

using ModelPtr = std::shared_ptr<const collision::CollisionModel>;

/// Joint values, poses by name and poses in space that will do as the goal.
Result<void> read_goals(CommandContext& ctx, const Map& args,
                        const collision::CollisionRobot& robot, sim::PlanTask& task) {
  const model::Robot& record = *ctx.snapshot().get(robot.record);
  if (has(args, "to")) {
    RMP_TRY_ASSIGN(task.goals, read_q(*args.find("to"), record, robot.model->joints, "to"));
  }
  if (has(args, "target")) task.targets.push_back(*pose_from(*args.find("target")));
  if (has(args, "targets"))
    for (const Value& v : *args.find("targets")->as_list()) {
      const auto target = pose_from(v);
      if (!target)
        return error(ErrorCode::invalid_argument,
                     "target " + std::to_string(task.targets.size() + 1) + " is not a pose",
                     "Give poses such as pose(0.5, 0, 0.3).", "targets");
      task.targets.push_back(*target);
    }
  if (task.goals.empty() && task.targets.empty())
    return error(ErrorCode::invalid_argument, "no target given: set joints, pose or target",
                 "Give to (joint values or a named pose), target or targets (poses of the tool).");
  return {};
}

Result<sim::PlanTask> read_task(CommandContext& ctx, const Map& args,
                                const collision::CollisionModel& m) {
  sim::PlanTask task;
  std::vector<std::string> known;
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < m.robots().size(); ++i) {
    known.push_back(m.robots()[i].name);
    if (known.back() == text_of(args, "robot")) found = i;
  }
  if (!found) return unknown_name("robot", text_of(args, "robot"), known);
  task.robot = *found;
  const collision::CollisionRobot& robot = m.robots()[*found];
  const model::Robot& record = *ctx.snapshot().get(robot.record);
  task.start = robot.shown;
  if (has(args, "from")) {
    RMP_TRY_ASSIGN(task.start, read_q(*args.find("from"), record, robot.model->joints, "from"));
  }
  RMP_TRY(read_goals(ctx, args, robot, task));
  task.ik = record.ik;
  task.axes = robotics::MakerAxes::for_messages(&record);
  if (has(args, "ik")) {
    RMP_TRY_ASSIGN(task.ik, read_provider(*args.find("ik"), "ik"));
  }
  if (has(args, "planner")) {
    RMP_TRY_ASSIGN(task.planner, read_provider(*args.find("planner"), "planner"));
  }
  if (has(args, "retimer")) {
    RMP_TRY_ASSIGN(task.timing.retimer, read_provider(*args.find("retimer"), "retimer"));
  }
  task.clearance = real(args, "clearance");
  task.seconds = real(args, "seconds");
  task.seed = static_cast<std::uint64_t>(integer(args, "seed"));
  task.tries = static_cast<std::size_t>(integer(args, "shortcuts"));
  task.is_timed = flag(args, "timed");
  if (!task.is_timed && flag(args, "watch"))
    return error(ErrorCode::invalid_argument, "without times there is no recording to watch",
                 "Leave out timed = false, or watch.", "watch");
  task.timing.share = real(args, "share");
  task.timing.step = real(args, "sample_time");
  task.timing.has_torques = flag(args, "torque_limits");
  task.inverse_dynamics = record.inverse_dynamics;
  task.gravity = content<model::World>(ctx, args).gravity;
  task.velocity = real(args, "velocity");
  task.ramp = real(args, "ramp");
  return task;
}

NumericArray rows_of(const std::vector<double>& table, std::size_t dof) {
  return NumericArray(table, table.size() / dof, dof);
}

Value work_of(const sim::PlanWork& w) {
  return Value(Map{{"configurations", w.configurations},
                   {"motions", w.motions},
                   {"distances", w.distances},
                   {"searches", w.searches},
                   {"shortcuts", w.shortcuts},
                   {"goal_seconds", w.goals_seconds},
                   {"search_seconds", w.search_seconds},
                   {"proof_seconds", w.proof_seconds},
                   {"shortcut_seconds", w.shortcut_seconds},
                   {"timing_seconds", w.timing_seconds}});
}

Result<Value> plan_path(CommandContext& ctx, const Map& args) {
  const AnyId world = ref(args, "id");
  const std::string where = name_in(ctx, world);
  RMP_TRY_ASSIGN(const ModelPtr m,
                 ctx.app.collision_models.find({ctx.app.registry, ctx.app.derived, ctx.snapshot()},
                                               world, ctx.progress));
  auto task = read_task(ctx, args, *m);
  if (!task.ok()) return std::move(task).error().in(where);
  auto plan = sim::plan_motion(ctx.app.registry, *m, *task, ctx.progress);
  if (!plan.ok()) return std::move(plan).error().in(where);
  const collision::CollisionRobot& robot = m->robots()[task->robot];
  const std::size_t dof = robot.model->dof();
  Map out{{"length", plan->length},     {"found_length", plan->found},
          {"goals", plan->goals},       {"waypoints", rows_of(plan->waypoints, dof)},
          {"planner", plan->planner},   {"seed", static_cast<std::int64_t>(task->seed)},
          {"work", work_of(plan->work)}};
  if (!task->is_timed) {
    List notes;
    for (const std::string& note : plan->notes) notes.emplace_back(note);
    out.set("notes", Value(std::move(notes)));
    return Value(std::move(out));
  }
  recording::Recording planned =
      sim::planned_recording(robot, typed<model::World>(args), *plan, *task->axes);
  for (const model::PlacedRobot& r : content<model::World>(ctx, args).robots)
    if (auto stands = sim::note_on_standing_base(r, "planning does"))
      planned.notes.push_back(std::move(*stands));
  List notes;
  for (const std::string& note : planned.notes) notes.emplace_back(note);
  auto recording = std::make_shared<const recording::Recording>(std::move(planned));
  List joints;  // as segments of trajectories take them
  for (std::size_t i = 0; i < plan->motion.q.size(); i += dof)
    joints.emplace_back(
        NumericArray(std::vector<double>(&plan->motion.q[i], &plan->motion.q[i] + dof)));
  out.set("duration", plan->motion.times.back());
  out.set("joints", Value(std::move(joints)));
  out.set("times", NumericArray(plan->motion.times));
  out.set("notes", Value(std::move(notes)));
  out.set("recording", Handle{"recording", ctx.app.recordings.add(std::move(recording))});
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(planning_commands) {
  std::vector<CommandSpec> all;
  const std::string lengths =
      "square root of the sum of (joint change times the reach of the moved links)^2";
  all.push_back(
      {.name = "world.plan_path",
       .classic = "",
       .summary = "Plans a motion of a robot around the obstacles of its world.",
       .details =
           "A sampling planner searches a collision-free path of straight motions in joint space, "
           "checked between samples for the clearance; the path is shortened, its corners are "
           "rounded if there is space (otherwise it stops there), and it is run as fast as the "
           "joints' velocity and acceleration limits permit. Other robots stay as the world shows "
           "them. The recording can be played, checked and followed by controllers; joints and "
           "times make a trajectory segment of the shape joint_spline.",
       .example = "local rods = robot.create{name = \"rods\", convention = \"dh\", links = {\n"
                  "  {a = 0.5, lower = -3, upper = 3}, {a = 0.5, lower = -3, upper = 3}},\n"
                  "  poses = {left = {0.8, 0}, right = {-0.8, 0}}}\n"
                  "solid.create{name = \"ball\", root = {kind = \"sphere\", radius = 0.1}}\n"
                  "local cell = world.create{name = \"cell\"}\n"
                  "cell:add_robot{robot = rods, q = \"left\"}\n"
                  "cell:add_object{what = \"ball\", position = {0.8, 0, 0}}\n"
                  "assert(not cell:check_path{path = {\"left\", \"right\"}}.is_free)\n"
                  "local way = cell:plan_path{robot = \"rods\", to = \"right\"}\n"
                  "assert(way.duration > 0 and way.length <= way.found_length)\n"
                  "assert(cell:check_path{recording = way.recording}.is_free)",
       .params =
           {self("world"),
            needed("robot", "string", "",
                   "Name of the robot in the world; may be omitted if the world has only one."),
            optional(
                "from", "any", "rad or m",
                "Joint values or a named pose at the start; by default as the world shows it."),
            optional("to", "any", "rad or m", "Joint values or a named pose at the goal."),
            optional("target", "pose", "",
                     "Or the goal pose of the tool in the world, with any configuration."),
            optional("targets", "list", "", "Or several such poses, of which one is reached."),
            above_zero(defaulted("clearance", "real", "m", 2e-3,
                                 "Bodies nearer than this count as a contact.")),
            optional("planner", "any", "",
                     "Planner: name, or {name = ..., params = {...}}; see "
                     "provider.list(\"planner\"). The default if omitted."),
            optional("ik", "any", "", "Solver for targets; by default the robot's own."),
            optional("retimer", "any", "", "Provider that times the path; the default if omitted."),
            above_zero(defaulted("seconds", "real", "s", 10,
                                 "Time limit for the search and the shortcuts.")),
            between(defaulted("seed", "int", "", 1, "The same seed gives the same motion."), 0,
                    4294967295.0),
            between(defaulted("shortcuts", "int", "", 200, "Number of attempts at a shortcut."), 0,
                    100000),
            defaulted(
                "timed", "bool", "", true,
                "False: only the shortened path, without rounded corners, times and a recording."),
            between(defaulted("share", "real", "", 1.0, "Share of the limits to use."), 1e-3, 1),
            defaulted("torque_limits", "bool", "", true,
                      "Respect the limits of joint torques too, without carried objects."),
            above_zero(defaulted("velocity", "real", "rad/s or m/s", 1.0,
                                 "Velocity limit of joints without one.")),
            above_zero(defaulted("ramp", "real", "s", 0.25,
                                 "Time in which joints without an acceleration limit reach their "
                                 "greatest velocity.")),
            above_zero(defaulted("sample_time", "real", "s", 0.01,
                                 "Time between samples of the recording.")),
            watch_field()},
       .returns = {"map",
                   "",
                   "",
                   {field("length", "real", "m", "Length of the shortened path: " + lengths + "."),
                    field("found_length", "real", "m",
                          "Length of the path as the planner found it."),
                    field("goals", "int", "", "Number of free goal configurations."),
                    field("waypoints", "matrix", "", "Corners of the shortened path, one per row."),
                    field("planner", "string", "", "The provider that searched."),
                    field("seed", "int", "", "As given, or the default."),
                    field("work", "map", "",
                          "Effort: configurations checked, motions requested by the planner, exact "
                          "distances of pairs of bodies, searches (more than one if a path was not "
                          "free between its samples), shortcuts tried; and the times goal_seconds, "
                          "search_seconds, proof_seconds (to prove that the path is free), "
                          "shortcut_seconds, timing_seconds."),
                    field("notes", "list<string>", "", "Notes, as those of the recording."),
                    field("recording", "handle", "", "time, q, qd, qdd, x, y, z; if timed."),
                    field("duration", "real", "s", "Duration of the motion; if timed."),
                    field("joints", "list", "",
                          "Joint values of the samples, for a joint_spline; if timed."),
                    field("times", "real[]", "s", "Their times; if timed.")}},
       .effect = Effect::simulates,
       .run = plan_path});
  return all;
}

}  // namespace robomosp::ioci
