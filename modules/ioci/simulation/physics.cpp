// SPDX-License-Identifier: Apache-2.0
// Contact physics of worlds.
#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/core/watchers.h"
#include "ioci/simulation/live_runs.h"
#include "ioci/simulation/run_start.h"
#include "ioci/simulation/task_physics.h"
#include "kernel/type.h"
#include "sim/physics.h"

namespace robomosp::ioci {
namespace {

using model::Robot;
using model::World;

Schema object_fields() {
  return {
      needed("name", "string", "", "Name of the object in the world."),
      defaulted("fixed", "bool", "", false, "Whether it is fixed."),
      between(optional("friction", "real", "", "Its Coulomb coefficient."), 0, 1e6),
      between(optional("restitution", "real", "", "Its restitution."), 0, 1),
      optional("velocity", "vec3", "m/s", "Velocity at the start, world axes."),
      optional("angular_velocity", "vec3", "rad/s", "Angular velocity at the start, world axes.")};
}
Schema robot_fields() {
  return {needed("name", "string", "", "Name of the robot in the world."),
          choice("drive", {"moved", "controlled", "limp"},
                 "Moved along its motion regardless of contacts; driven by the torques of a "
                 "controller; or without torques."),
          optional("controller", "any", "",
                   "Name, or {name = ..., params = {...}}; by default the robot's own."),
          between(optional("friction", "real", "", "Coulomb coefficient of its links."), 0, 1e6),
          between(optional("restitution", "real", "", "Restitution of its links."), 0, 1),
          defaulted(
              "self_contact", "bool", "", false,
              "Whether its links touch each other, except for pairs that collision checks skip.")};
}
Schema action_fields() {
  ParamSpec time =
      optional("time", "real", "s", "Start time; by default the end of the action before.");
  time.min = 0;
  ParamSpec duration = optional("duration", "real", "s",
                                "Duration of a move to q (by default as short as the joints' "
                                "velocities allow); for other actions a pause.");
  duration.min = 0;
  ParamSpec speed = optional("speed", "real", "m/s or rad/s",
                             "Speed of gripping; by default the joint's greatest velocity.");
  speed.min = 0;
  return {choice("action", {"move", "grasp", "grip", "release", "wait"},
                 "Grasping ties an object to the tool's link; gripping presses with a joint's "
                 "force, and friction holds.",
                 true),
          std::move(time),
          std::move(duration),
          optional("robot", "string", "",
                   "The robot that acts; by default that of the action before, or the only one."),
          optional("q", "any", "rad or m", "Goal: joint values or the name of a pose."),
          optional("recording", "ref:recording", "",
                   "Move along its columns q1, q2 and so on; if it has several robots, as "
                   "recordings of tasks and programs do, along those of this one, as in left.q1."),
          optional("trajectory", "string", "", "Move the tool along a trajectory of the world."),
          optional("object", "string", "",
                   "Object to grasp, by default the one that the tool touches; or to release, by "
                   "default all."),
          optional("tool", "string", "", "Tool that grasps; by default the first."),
          optional("joint", "string", "", "Joint that grips, until the robot releases."),
          optional("force", "real", "N or N m",
                   "Force of the grip; positive in the direction of increasing joint value."),
          std::move(speed)};
}

std::string fields_text(const Schema& fields) {
  std::string out;
  for (const ParamSpec& f : fields) {
    out += out.empty() ? "" : "; ";
    out += f.name + (f.unit.empty() ? "" : " [" + f.unit + "]");
    if (!f.choices.empty()) {
      std::string words;
      for (const std::string& c : f.choices) words += (words.empty() ? "" : ", ") + c;
      out += " (" + words + ")";
    }
    std::string doc = f.doc;
    if (!doc.empty() && doc.back() == '.') doc.pop_back();
    out += ": " + doc;
  }
  return out + ".";
}

ParamSpec friction_field() {
  return between(defaulted("friction", "real", "", 0.5,
                           "Coulomb coefficient; for two bodies the geometric mean is used."),
                 0, 1e6);
}
ParamSpec restitution_field() {
  return between(
      defaulted(
          "restitution", "real", "", 0.0,
          "Ratio of the speeds after and before an impact; for two bodies the greater is used."),
      0, 1);
}
ParamSpec engine_field() {
  return optional(
      "engine", "any", "",
      "Engine: name, or {name = ..., params = {...}}; the default provider if omitted.");
}
ParamSpec objects_field() {
  return optional(
      "objects", "list", "",
      "Objects with settings that differ from the defaults. " + fields_text(object_fields()));
}
Schema task_physics_fields() {
  return {friction_field(), restitution_field(),
          above_zero(defaulted("step", "real", "s", 0.001,
                               "Step of the engine; shortened so that rows fall on steps.")),
          objects_field(), engine_field()};
}

/// Calls fn(fields, path) for the entries of a list argument.
template <class Fn>
Result<void> each(CommandContext& ctx, const Map& args, const std::string& name,
                  const Schema& schema, Fn&& fn) {
  if (!has(args, name)) return {};
  const List* list = args.find(name)->as_list();
  if (!list)
    return error(ErrorCode::invalid_argument, args.find(name)->text() + " is not a list",
                 "Give a list of tables.", name);
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string path = name + "[" + std::to_string(i + 1) + "]";
    RMP_TRY_ASSIGN(const Map m, read_map(ctx, schema, (*list)[i], path));
    RMP_TRY(fn(m, path));
  }
  return {};
}

std::optional<double> maybe(const Map& m, const std::string& name) {
  return has(m, name) ? std::optional(real(m, name)) : std::nullopt;
}

/// Joint values of the robot that acts.
Result<std::vector<double>> read_target(CommandContext& ctx, const World& w,
                                        const std::string& robot, const Value& q,
                                        const std::string& path) {
  const auto placed = std::find_if(w.robots.begin(), w.robots.end(),
                                   [&](const auto& r) { return r.name == robot; });
  if (placed == w.robots.end()) {
    std::vector<std::string> known;
    for (const auto& r : w.robots) known.push_back(r.name);
    return unknown_name("robot", robot, known).in(path);
  }
  RMP_TRY_ASSIGN(const auto m, ctx.app.derived.robot_model(ctx.snapshot(), placed->robot, w.gravity,
                                                           ctx.progress));
  return read_q(q, *ctx.snapshot().get(placed->robot), m->joints, path + ".q");
}

/// What bodies are like, and the engine with its step: what runs with and without tasks say alike.
Result<void> read_bodies(CommandContext& ctx, const Map& args, sim::PhysicsRun& run) {
  run.step = real(args, "step");
  run.friction = real(args, "friction");
  run.restitution = real(args, "restitution");
  if (has(args, "engine")) {
    RMP_TRY_ASSIGN(run.engine, read_provider(*args.find("engine"), "engine"));
  }
  return each(ctx, args, "objects", object_fields(),
              [&](const Map& m, const std::string&) -> Result<void> {
                sim::PhysicsObjectSettings s;
                s.name = text_of(m, "name");
                s.is_fixed = flag(m, "fixed");
                s.friction = maybe(m, "friction");
                s.restitution = maybe(m, "restitution");
                if (has(m, "velocity")) s.velocity = vec3(m, "velocity");
                if (has(m, "angular_velocity")) s.angular_velocity = vec3(m, "angular_velocity");
                run.objects.push_back(std::move(s));
                return {};
              });
}

/// The arguments of world.simulate_physics.
Result<sim::PhysicsRun> read_physics_run(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args);
  sim::PhysicsRun run;
  run.world = typed<World>(args);
  if (has(args, "duration")) run.duration = real(args, "duration");
  run.sample_time = real(args, "sample_time");
  RMP_TRY(read_bodies(ctx, args, run));
  RMP_TRY(each(ctx, args, "robots", robot_fields(),
               [&](const Map& m, const std::string& path) -> Result<void> {
                 sim::PhysicsRobotSettings s;
                 s.name = text_of(m, "name");
                 const std::string drive = text_of(m, "drive");
                 s.drive = drive == "controlled" ? sim::RobotDrive::controlled
                           : drive == "limp"     ? sim::RobotDrive::limp
                                                 : sim::RobotDrive::moved;
                 if (has(m, "controller")) {
                   RMP_TRY_ASSIGN(s.controller,
                                  read_provider(*m.find("controller"), path + ".controller"));
                 }
                 s.friction = maybe(m, "friction");
                 s.restitution = maybe(m, "restitution");
                 s.self_contact = flag(m, "self_contact");
                 run.robots.push_back(std::move(s));
                 return {};
               }));
  std::string robot = w.robots.size() == 1 ? w.robots[0].name : std::string();
  RMP_TRY(each(ctx, args, "actions", action_fields(),
               [&](const Map& m, const std::string& path) -> Result<void> {
                 sim::PhysicsAction a;
                 const std::string word = text_of(m, "action");
                 a.kind = word == "grasp"     ? sim::PhysicsAction::Kind::grasp
                          : word == "grip"    ? sim::PhysicsAction::Kind::grip
                          : word == "release" ? sim::PhysicsAction::Kind::release
                          : word == "wait"    ? sim::PhysicsAction::Kind::wait
                                              : sim::PhysicsAction::Kind::move;
                 a.time = maybe(m, "time");
                 if (has(m, "duration")) a.duration = real(m, "duration");
                 if (has(m, "robot")) robot = text_of(m, "robot");
                 a.robot = robot;
                 if (has(m, "q")) {
                   RMP_TRY_ASSIGN(a.q, read_target(ctx, w, robot, *m.find("q"), path));
                 }
                 if (has(m, "recording")) {
                   const Handle* h = m.find("recording")->as_handle();
                   a.recorded = h ? ctx.app.recordings.find(h->number) : nullptr;
                   if (!a.recorded)
                     return error(ErrorCode::stale_handle, "the recording no longer exists",
                                  "Simulate again.", path + ".recording");
                 }
                 if (has(m, "trajectory")) a.trajectory = text_of(m, "trajectory");
                 if (has(m, "object")) a.object = text_of(m, "object");
                 if (has(m, "tool")) a.tool = text_of(m, "tool");
                 if (has(m, "joint")) a.joint = text_of(m, "joint");
                 if (has(m, "force")) a.force = real(m, "force");
                 if (has(m, "speed")) a.speed = real(m, "speed");
                 run.actions.push_back(std::move(a));
                 return {};
               }));
  return run;
}

Result<Value> simulate_physics(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto run, read_physics_run(ctx, args));
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot()};
  RMP_TRY_ASSIGN(auto recording, sim::simulate_physics(simulator, run, ctx.progress));
  for (const std::string& note : recording->notes)
    ctx.app.messages.post(Severity::info, "physics", note, name_in(ctx, ref(args, "id")));
  RMP_TRY_ASSIGN(recording, with_start_notes(ctx, std::move(recording)));
  return Value(Handle{"recording", ctx.app.recordings.add(std::move(recording))});
}

std::string physics_object_type() { return map_type(object_fields()); }
std::string physics_robot_type() {
  Schema s = robot_fields();
  retype(s, "controller", "provider:controller");
  return map_type(s);
}
std::string physics_action_type() {
  Schema s = action_fields();
  retype(s, "robot", "member:robot of id");
  retype(s, "q", "joints of robot or member:pose of robot @when(action is move)");
  retype(s, "recording", "ref:recording @when(action is move)");
  retype(s, "trajectory", "member:trajectory of id @when(action is move)");
  retype(s, "object", "member:object of id @when(action is grasp, grip, release)");
  retype(s, "tool", "member:tip of robot @when(action is move, grasp)");
  retype(s, "joint", "member:joint of robot @when(action is grip)");
  retype(s, "force", "real @when(action is grip)");
  retype(s, "speed", "real @when(action is grip)");
  return map_type(s);
}
std::string task_physics_type() {
  Schema s = task_physics_fields();
  retype(s, "objects", "list<type:physics_object>");
  retype(s, "engine", "provider:physics");
  return map_type(s);
}
const NamedType kPhysicsObjectType("physics_object", "map", physics_object_type);
const NamedType kPhysicsRobotType("physics_robot", "map", physics_robot_type);
const NamedType kPhysicsActionType("physics_action", "map", physics_action_type);
const NamedType kTaskPhysicsType("task_physics", "map", task_physics_type);

}  // namespace

ParamSpec task_physics_field() {
  return optional(
      "physics", "any", "",
      "true, or a table: contact physics on the same clock. " + fields_text(task_physics_fields()));
}

Result<std::optional<sim::PhysicsRun>> task_physics(CommandContext& ctx, const Map& args) {
  std::optional<sim::PhysicsRun> out;
  if (!has(args, "physics")) return out;
  const Value& given = *args.find("physics");
  const bool* is_wanted = given.as_bool();
  if (is_wanted && !*is_wanted) return out;
  if (!is_wanted && !given.as_map())
    return error(ErrorCode::invalid_argument, "it must be true, false or a table",
                 "Give physics = true, or physics = {friction = 0.3}.", "physics");
  RMP_TRY_ASSIGN(const Map m,
                 read_map(ctx, task_physics_fields(), is_wanted ? Value(Map{}) : given, "physics"));
  RMP_TRY(read_bodies(ctx, m, out.emplace()).in("physics"));
  return out;
}

Result<LiveSource> live_physics(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(auto run, read_physics_run(ctx, args));
  LiveSource out;
  out.asks = {{PhysicsEngine::kInterfaceId, run.engine}};
  for (const auto& placed : content<World>(ctx, args).robots) {
    const Robot& r = *ctx.snapshot().get(placed.robot);
    const auto drive = std::find_if(run.robots.begin(), run.robots.end(),
                                    [&](const auto& s) { return s.name == placed.name; });
    out.asks.emplace_back(IkSolver::kInterfaceId, r.ik);
    if (drive == run.robots.end() || drive->drive != sim::RobotDrive::controlled) continue;
    out.asks.emplace_back(InverseDynamics::kInterfaceId, r.inverse_dynamics);
    out.asks.emplace_back(Controller::kInterfaceId,
                          drive->controller.name.empty() ? r.controller : drive->controller);
  }
  out.pulls = run.pulls = std::make_shared<sim::Pulls>();
  out.source = [&registry = ctx.app.registry, &derived = ctx.app.derived,
                snapshot = ctx.app.document.now(), run = std::move(run)](
                   const sim::RunState* from, sim::RowSink& sink, Progress& progress) {
    return sim::simulate_physics({registry, derived, *snapshot}, run, progress, &sink, from);
  };
  return out;
}

RMP_COMMANDS(physics_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "world.simulate_physics",
       .classic = "",
       .summary = "Simulates contact physics: objects fall, touch, slide and stack, and robots "
                  "move, grasp and carry them.",
       .details = "Objects have the mass of their solids' materials; fixed objects and those "
                  "without mass do not move. Steps are fixed: equal calls give equal bits. "
                  "Columns: time, q, qd and, for driven robots, tau of the robot that acts first "
                  "(of others as `name.q1`), of each object that can move `name.x`, `.y`, `.z`, "
                  "the quaternion `.qw`, `.qx`, `.qy`, `.qz` and `.contact_force`, and contacts "
                  "and contact_force of all. view.render{recording, at} and the desktop play it.",
       .example =
           "material.create{name = \"wood\", density = 600}\n"
           "solid.create{name = \"floor\", root = {kind = \"box\", x = 2, y = 2, z = 0.1}}\n"
           "solid.create{name = \"box\", material = \"wood\", root = {kind = \"box\", x = 0.1, y = "
           "0.1, z = 0.1}}\n"
           "local cell = world.create{name = \"cell\"}\n"
           "cell:add_object{what = \"floor\", position = {0, 0, -0.1}}\n"
           "cell:add_object{what = \"box\", position = {0, 0, 0.05}}\n"
           "local fall = cell:simulate_physics{duration = 0.5}\n"
           "local z = fall:values(\"box.z\")\n"
           "assert(math.abs(z[#z]) < 1e-3)",
       .params =
           {self("world"),
            above_zero(optional("duration", "real", "s",
                                "Duration; by default to the end of the last action.")),
            optional("actions", "list", "",
                     "Actions of robots, in order. " + fields_text(action_fields())),
            optional("robots", "list", "",
                     "Robots that are not driven kinematically. " + fields_text(robot_fields())),
            objects_field(), friction_field(), restitution_field(),
            above_zero(
                defaulted("step", "real", "s", 0.001, "Step of the engine and of controllers.")),
            above_zero(defaulted("sample_time", "real", "s", 0.01,
                                 "Time between samples of the recording, a multiple of the step.")),
            engine_field(), watch_field()},
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = simulate_physics,
       .runs = RunKind::simulation});
  return all;
}

}  // namespace robomosp::ioci
