// SPDX-License-Identifier: Apache-2.0
// Forward dynamic simulation: robots move under torques and controllers.
#include <algorithm>
#include <optional>

#include "ioci/core/commands.h"
#include "ioci/core/watchers.h"
#include "ioci/simulation/live_runs.h"
#include "ioci/simulation/run_start.h"
#include "ioci/simulation/tip_load_arguments.h"
#include "ioci/world/members.h"
#include "sim/forward_simulation.h"

namespace robomosp::ioci {
namespace {

using model::Robot;
using model::World;

/// Name of a member given by name, or by the record that it places.
template <class Placed>
Result<std::string> member_name(const CommandContext& ctx, const std::vector<Placed>& all,
                                const Value& given, AnyId (*what)(const Placed&),
                                std::string_view kind) {
  std::vector<std::string> known;
  for (const Placed& p : all) {
    if (given.as_string() && *given.as_string() == p.name) return p.name;
    known.push_back(p.name);
  }
  RMP_TRY_ASSIGN(const AnyId id, read_ref(ctx, kind, given, kind));
  for (const Placed& p : all)
    if (what(p) == id) return p.name;
  return unknown_name(kind, given.as_string() ? *given.as_string() : ctx.snapshot().describe(id),
                      known);
}
AnyId robot_of(const model::PlacedRobot& p) { return p.robot; }
AnyId trajectory_of(const model::PlacedTrajectory& p) { return p.trajectory; }

Result<std::vector<double>> numbers(const Map& args, const std::string& name) {
  std::vector<double> out = reals(args, name);
  if (const std::string* words = args.find(name)->as_string()) {
    RMP_TRY_ASSIGN(const Value read, check_value(field("", "real[]", "", ""), *words, name));
    out = reals(&read);
  }
  if (out.empty())
    return error(ErrorCode::invalid_argument, args.find(name)->text() + " is not a list of numbers",
                 "Give one number for each, or a recording.", name);
  return out;
}

/// Expressions of the time for some of x, y, z, roll, pitch, yaw.
Result<void> read_base_motion(const Map& args, sim::ForwardRun& run) {
  if (!has(args, "base_motion")) return {};
  const Map* given = args.find("base_motion")->as_map();
  if (!given)
    return error(ErrorCode::invalid_argument,
                 args.find("base_motion")->text() + " is not a table of expressions",
                 "Give such as {x = \"0.1 m * sin(2 rad/s * time)\"}.", "base_motion");
  run.base_motion.emplace();
  const std::vector<std::string> known(sim::kBaseNumbers.begin(), sim::kBaseNumbers.end());
  for (const auto& [name, value] : *given) {
    const auto at = std::find(known.begin(), known.end(), name);
    if (at == known.end()) return unknown_name("number", name, known).in("base_motion");
    const std::string* words = value.as_string();
    if (!words)
      return error(ErrorCode::invalid_argument, value.text() + " is not an expression",
                   "Write it in quotes, with units.", "base_motion." + name);
    (*run.base_motion)[static_cast<std::size_t>(at - known.begin())] = *words;
  }
  return {};
}

/// The arguments that both commands have.
Result<sim::ForwardRun> read_forward_run(CommandContext& ctx, const Map& args, const Robot& robot,
                                         const RobotModel& m) {
  sim::ForwardRun run;
  if (has(args, "duration")) run.duration = real(args, "duration");
  run.sample_time = real(args, "sample_time");
  if (has(args, "q")) {
    RMP_TRY_ASSIGN(run.q, read_q(*args.find("q"), robot, m.joints, "q"));
  }
  if (has(args, "qd")) {
    RMP_TRY_ASSIGN(run.qd, numbers(args, "qd"));
  }
  if (given_handle(ctx, args, "tau")) {
    RMP_TRY_ASSIGN(run.recorded_tau, given_recording(ctx, args, "tau"));
  } else if (has(args, "tau")) {
    RMP_TRY_ASSIGN(run.tau, numbers(args, "tau"));
  }
  if (has(args, "controller")) {
    run.is_controlled = true;
    RMP_TRY_ASSIGN(run.controller, read_provider(*args.find("controller"), "controller"));
  }
  if (given_handle(ctx, args, "reference")) {
    RMP_TRY_ASSIGN(run.recorded_q, given_recording(ctx, args, "reference"));
    run.is_controlled = true;
  } else if (has(args, "reference")) {
    RMP_TRY_ASSIGN(run.hold, read_q(*args.find("reference"), robot, m.joints, "reference"));
    run.is_controlled = true;
  }
  if (run.recorded_tau && run.recorded_tau->rows() > 0 && !run.is_controlled &&
      !has(args, "duration"))
    run.duration = run.recorded_tau->columns.front().values.back();
  run.control_period = real(args, "control_period");
  RMP_TRY_ASSIGN(run.load, read_tip_load(ctx, args));
  RMP_TRY(read_base_motion(args, run));
  if (has(args, "integrator")) {
    RMP_TRY_ASSIGN(run.integrator, read_provider(*args.find("integrator"), "integrator"));
  }
  run.relative_tolerance = real(args, "relative_tolerance");
  run.absolute_tolerance = real(args, "absolute_tolerance");
  if (!ctx.given("relative_tolerance") && !ctx.given("absolute_tolerance")) {
    run.loosened = sim::loosening(m.dof());
    run.relative_tolerance *= run.loosened;
    run.absolute_tolerance *= run.loosened;
  }
  run.step = real(args, "step");
  run.friction = flag(args, "friction");
  run.breakaway = real(args, "breakaway");
  run.restitution = real(args, "restitution");
  const std::string limits = text_of(args, "limits");
  run.at_limit = limits == "report"   ? sim::AtLimit::report
                 : limits == "ignore" ? sim::AtLimit::ignore
                                      : sim::AtLimit::stop;
  return run;
}

Result<Value> simulated(CommandContext& ctx, const sim::ForwardRun& run) {
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot()};
  RMP_TRY_ASSIGN(auto recording, sim::forward_dynamics(simulator, run, ctx.progress));
  RMP_TRY_ASSIGN(recording, with_start_notes(ctx, std::move(recording)));
  return Value(Handle{"recording", ctx.app.recordings.add(std::move(recording))});
}

/// The arguments of world.simulate_dynamics.
Result<sim::ForwardRun> read_in_world(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args);
  const std::string where = name_in(ctx, ref(args, "id"));
  auto name = member_name(ctx, w.robots, *args.find("robot"), robot_of, "robot");
  if (!name.ok()) return std::move(name).error().in(where);
  const auto placed = std::find_if(w.robots.begin(), w.robots.end(),
                                   [&](const auto& p) { return p.name == *name; });
  const Robot* robot = ctx.snapshot().get(placed->robot);
  RMP_TRY_ASSIGN(const auto m, ctx.app.derived.robot_model(ctx.snapshot(), placed->robot, w.gravity,
                                                           ctx.progress));
  RMP_TRY_ASSIGN(auto run, read_forward_run(ctx, args, *robot, *m));
  run.world = typed<World>(args);
  run.robot = *name;
  if (has(args, "trajectory")) {
    RMP_TRY_ASSIGN(run.trajectory, member_name(ctx, w.trajectories, *args.find("trajectory"),
                                               trajectory_of, "trajectory"));
    run.is_controlled = true;
  }
  if (has(args, "base_trajectory")) {
    RMP_TRY_ASSIGN(run.base_trajectory,
                   member_name(ctx, w.trajectories, *args.find("base_trajectory"), trajectory_of,
                               "trajectory"));
  }
  report_no_mass(ctx, *m, Severity::warning, ", so it cannot move as a real one does");
  return run;
}

Result<Value> simulate_in_world(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto run, read_in_world(ctx, args));
  return simulated(ctx, run);
}

/// The arguments of robot.simulate.
Result<sim::ForwardRun> read_alone(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto m, model_of(ctx, args));
  RMP_TRY_ASSIGN(auto run, read_forward_run(ctx, args, content<Robot>(ctx, args), *m));
  run.record = typed<Robot>(args);
  return run;
}

Result<Value> simulate_alone(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto run, read_alone(ctx, args));
  return simulated(ctx, run);
}

/// Who computes a run of a robot record.
LiveSource live(CommandContext& ctx, RobotId robot, sim::ForwardRun run) {
  const Robot& r = *ctx.snapshot().get(robot);
  LiveSource out;
  out.asks = {{ForwardDynamics::kInterfaceId, r.forward_dynamics},
              {InverseDynamics::kInterfaceId, r.inverse_dynamics},
              {Integrator::kInterfaceId, run.integrator}};
  if (run.is_controlled)
    out.asks.emplace_back(Controller::kInterfaceId,
                          run.controller.name.empty() ? r.controller : run.controller);
  if (!run.trajectory.empty()) out.asks.emplace_back(IkSolver::kInterfaceId, r.ik);
  out.pulls = run.pulls = std::make_shared<sim::Pulls>();
  out.source = [&registry = ctx.app.registry, &derived = ctx.app.derived,
                snapshot = ctx.app.document.now(), run = std::move(run)](
                   const sim::RunState* from, sim::RowSink& sink, Progress& progress) {
    return sim::forward_dynamics({registry, derived, *snapshot}, run, progress, &sink, from);
  };
  return out;
}

Schema run_params(Schema first, Schema references) {
  first.push_back(above_zero(optional(
      "duration", "real", "s",
      "Duration; by default that of the trajectory, or of the recording in tau or reference.")));
  first.push_back(above_zero(
      defaulted("sample_time", "real", "s", 0.01, "Time between samples of the recording.")));
  first.push_back(optional("q", "any", "rad or m",
                           "Joint values at the start, or the name of a pose; by default those of "
                           "the reference or as shown."));
  first.push_back(optional(
      "qd", "any", "rad/s or m/s",
      "Joint velocities at the start; by default those of the reference, otherwise zeros."));
  first.push_back(optional("tau", "any", "N m or N",
                           "Torques of the motors: one for each joint, or a recording with columns "
                           "tau1, tau2 and so on. None if omitted."));
  first.push_back(optional("controller", "any", "",
                           "Controller that computes the torques instead: name, or {name = ..., "
                           "params = {...}}; the robot's own if only a reference is given."));
  for (ParamSpec& p : references) first.push_back(std::move(p));
  first.push_back(optional("reference", "any", "rad or m",
                           "Reference of the controller: a recording with columns q1, q2 and so "
                           "on, or joint values or a pose to hold."));
  first.push_back(
      above_zero(defaulted("control_period", "real", "s", 0.001,
                           "Update period of the controller; it holds its torques in between.")));
  for (ParamSpec& p : tip_load_fields("the path length of the tip along the reference"))
    first.push_back(std::move(p));
  first.push_back(
      optional("base_motion", "map", "",
               "Motion of the robot's mounting frame relative to its placement, in its own axes: "
               "smooth expressions of `time` for some of x, y, z, roll, pitch and yaw."));
  first.push_back(optional(
      "integrator", "any", "",
      "Integrator: name, or {name = ..., params = {...}}; by default the default provider."));
  first.push_back(above_zero(defaulted(
      "relative_tolerance", "real", "", 1e-10,
      "Relative tolerance of a variable-step integrator. With more than 1000 velocities both "
      "default tolerances are greater by (velocities / 1000)^2, like rounding errors.")));
  first.push_back(above_zero(defaulted("absolute_tolerance", "real", "", 1e-12,
                                       "Absolute tolerance of a variable-step integrator.")));
  first.push_back(above_zero(defaulted(
      "step", "real", "s", 0.001, "Step of a fixed-step integrator; first guess for others.")));
  first.push_back(defaulted("friction", "bool", "", true, "Whether the joints have friction."));
  first.push_back(between(
      defaulted("breakaway", "real", "", 1.0, "Static friction over Coulomb friction."), 1, 1000));
  first.push_back(choice("limits", {"stop", "report", "ignore"},
                         "Action at a joint limit: stop the joint, add a note, or none."));
  first.push_back(between(
      defaulted("restitution", "real", "", 0.0, "Ratio of the speeds after and before a stop."), 0,
      1));
  first.push_back(watch_field());
  return first;
}

std::string with_stroke(const std::string& rest) {
  return with_arm(
             "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm, q = "
             "\"ready\"}\nlocal start = arm:fk{q = \"ready\"}\nlocal p, a = start.position, "
             "start.rpy\n"
             "trajectory.create{name = \"stroke\", sample_time = 0.05, segments = {{shape = "
             "\"line\", points = {\n"
             "  {p[1], p[2], p[3], a[1], a[2], a[3]}, {p[1], p[2] + 0.05, p[3], a[1], a[2], "
             "a[3]}}}}}\n"
             "cell:add_trajectory{trajectory = \"stroke\"}\n") +
         rest;
}

}  // namespace

Result<LiveSource> live_dynamics(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(auto run, read_in_world(ctx, args));
  const World& w = content<World>(ctx, args);
  const auto placed = std::find_if(w.robots.begin(), w.robots.end(),
                                   [&](const auto& p) { return p.name == run.robot; });
  return live(ctx, placed->robot, std::move(run));
}
Result<LiveSource> live_robot(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(auto run, read_alone(ctx, args));
  return live(ctx, typed<Robot>(args), std::move(run));
}

RMP_COMMANDS(simulation_commands) {
  std::vector<CommandSpec> all;
  const std::string details =
      "Columns: time, q, qd, qdd, tau, tau_friction and tau_stop of the joints, kinetic, potential "
      "and their sum energy, x, y, z of the tool, with a force at a tip wrench1 to wrench6 (world "
      "axes), and with a reference error of the joints and tip_error. Coulomb friction holds a "
      "joint at rest up to its breakaway torque; torques are limited to the joints' max_force. "
      "recording.notes lists limits reached, joints that came to rest and moved again, torques "
      "limited, remarks of the integrator, and the solver of a long chain without a selected one.";
  all.push_back(
      {.name = "world.simulate_dynamics",
       .classic = "World WorldFwdDynSim|World FwdDynWorldSim(robot, duration, qd, ~time_delay, "
                  "integrator, step, ~torque_flag, tau)|World WorldfDynSim(robot, tau, duration)",
       .summary = "Simulates a robot under torques or a controller and records its motion.",
       .details = details,
       .example = with_stroke(
           "local fall = cell:simulate_dynamics{robot = \"arm\", duration = 0.1}\n"
           "assert(#fall:values(\"energy\") == 11)\n"
           "local run = cell:simulate_dynamics{robot = \"arm\", trajectory = \"stroke\", "
           "controller = \"computed_torque\", duration = 0.2}\n"
           "assert(run:values(\"tip_error\")[21] < 1e-3)"),
       .params = run_params(
           {self("world"), placed_robot_field()},
           {optional("trajectory", "any", "",
                     "Reference of the tool for the controller: a trajectory of the world."),
            optional("base_trajectory", "any", "",
                     "Motion of the robot's mounting frame: a trajectory of the world.")}),
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = simulate_in_world,
       .runs = RunKind::simulation});
  all.push_back(
      {.name = "robot.simulate",
       .classic = "",
       .summary = "Simulates a robot without a world under torques or a controller and records its "
                  "motion.",
       .details = "Gravity is 9.81 m/s^2 along -z of its mounting. " + details,
       .example = with_arm("local swing = arm:simulate{q = \"ready\", duration = 0.1}\n"
                           "local e = swing:values(\"energy\")\n"
                           "assert(math.abs(e[11] - e[1]) < 1e-9 * math.abs(e[1]))\n"
                           "local held = arm:simulate{q = \"ready\", reference = \"ready\", "
                           "controller = \"pd_gravity\", duration = 0.1}\n"
                           "assert(held:values(\"tip_error\")[11] < 1e-6)\n"
                           "local shaken = arm:simulate{q = \"ready\", duration = 0.1, "
                           "base_motion = {z = \"0.01 m * (1 - cos(30 rad/s * time))\"}}\n"
                           "assert(shaken:values(\"energy\")[11] ~= e[11])"),
       .params = run_params({self("robot")}, {}),
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = simulate_alone,
       .runs = RunKind::simulation});
  return all;
}

}  // namespace robomosp::ioci
