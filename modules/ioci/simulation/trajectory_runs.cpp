// SPDX-License-Identifier: Apache-2.0
// Runs of a robot along a trajectory of its world.
#include <algorithm>
#include <set>

#include "collision/collision.h"
#include "ioci/core/watchers.h"
#include "ioci/robot/robots.h"
#include "ioci/simulation/run_start.h"
#include "ioci/simulation/tip_load_arguments.h"
#include "ioci/world/members.h"
#include "model/placement.h"
#include "motion/cartesian_path.h"
#include "motion/segment.h"
#include "sim/loaded_runs.h"
#include "sim/recording_columns.h"
#include "spatial/pose.h"

namespace robomosp::ioci {
namespace {

using model::World;

constexpr double kMostSamples = 5e6;

sim::Simulator simulator_of(CommandContext& ctx) {
  return {ctx.app.registry, ctx.app.derived, ctx.snapshot(), &ctx.app.collision_models};
}

/// A run of a robot on a trajectory: `what(simulator, run)` makes its recording.
template <class What>
Result<Value> simulate_trajectory(CommandContext& ctx, const Map& args, What&& what) {
  const World& w = content<World>(ctx, args);
  const std::string where = name_in(ctx, ref(args, "id"));
  RMP_TRY_ASSIGN(const std::size_t robot,
                 find_robot(ctx, typed<World>(args), *args.find("robot"), where));
  RMP_TRY_ASSIGN(const std::size_t trajectory,
                 find_trajectory(ctx, typed<World>(args), *args.find("trajectory"), where));
  sim::Run run;
  run.world = typed<World>(args);
  run.robot = w.robots[robot].name;
  run.trajectory = w.trajectories[trajectory].name;
  if (has(args, "sample_time")) run.sample_time = real(args, "sample_time");
  run.tolerance = {real(args, "position_tolerance"), real(args, "rotation_tolerance")};
  run.objective = objective_of(args);
  RMP_TRY(check_objective_fields(ctx, args));
  run.begins_on_path = text_of(args, "start") == "path";
  run.influence = real(args, "influence");
  const sim::Simulator simulator = simulator_of(ctx);
  RMP_TRY_ASSIGN(auto recording, what(simulator, run));
  if (flag(args, "clearance")) {
    RMP_TRY_ASSIGN(recording, collision::with_clearance(simulator, *recording, ctx.progress));
  }
  RMP_TRY_ASSIGN(recording, with_start_notes(ctx, std::move(recording)));
  return Value(Handle{"recording", ctx.app.recordings.add(std::move(recording))});
}

Result<Value> inverse_kinematics(CommandContext& ctx, const Map& args) {
  return simulate_trajectory(ctx, args, [&](const sim::Simulator& simulator, const sim::Run& run) {
    return simulator.inverse_kinematics(run, ctx.progress);
  });
}
Result<Value> inverse_dynamics(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const sim::TipLoad load, read_tip_load(ctx, args));
  RMP_TRY_ASSIGN(
      auto recording,
      simulate_trajectory(ctx, args, [&](const sim::Simulator& simulator, const sim::Run& run) {
        return sim::inverse_dynamics(simulator, run, load, ctx.progress);
      }));
  const World& w = content<World>(ctx, args);
  const auto member = find_robot(ctx, typed<World>(args), *args.find("robot"), "");
  if (member.ok()) {
    RMP_TRY_ASSIGN(const auto m,
                   ctx.app.derived.robot_model(ctx.snapshot(), w.robots[*member].robot, w.gravity,
                                               ctx.progress));
    report_no_mass(ctx, *m, Severity::warning, ", so its links add nothing to its torques");
  }
  return recording;
}

Result<Value> time_optimal(CommandContext& ctx, const Map& args) {
  sim::RetimeOptions options;
  options.share = real(args, "share");
  options.has_torques = flag(args, "torque_limits");
  options.step = real(args, "step");
  if (has(args, "retimer")) {
    RMP_TRY_ASSIGN(options.retimer, read_provider(*args.find("retimer"), "retimer"));
  }
  RMP_TRY_ASSIGN(const sim::TipLoad load, read_tip_load(ctx, args));
  return simulate_trajectory(ctx, args, [&](const sim::Simulator& simulator, const sim::Run& run) {
    return sim::time_optimal(simulator, run, options, load, ctx.progress);
  });
}

/// Torques only mean something where links that move have masses, or a force acts.
Result<Value> simulate_motion(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args);
  RMP_TRY_ASSIGN(const std::size_t at, find_robot(ctx, typed<World>(args), *args.find("robot"),
                                                  name_in(ctx, ref(args, "id"))));
  RMP_TRY_ASSIGN(const auto m, ctx.app.derived.robot_model(ctx.snapshot(), w.robots[at].robot,
                                                           w.gravity, ctx.progress));
  RMP_TRY_ASSIGN(const sim::TipLoad load, read_tip_load(ctx, args));
  return has_mass(*m) || load.is_given() ? inverse_dynamics(ctx, args)
                                         : inverse_kinematics(ctx, args);
}

/// An error names the first segment that moves the tool instead of the joints.
Result<void> only_joint_segments(const CommandContext& ctx, TrajectoryId id) {
  std::set<TrajectoryId> seen{id};
  std::vector<TrajectoryId> open{id};
  while (!open.empty()) {
    const model::Record& record = *ctx.snapshot().find(AnyId(open.back()));
    open.pop_back();
    const auto& segments = std::get<model::Trajectory>(record.body).segments;
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const std::string where =
          "trajectory " + text::quote(record.name) + ", segment " + std::to_string(i + 1);
      if (segments[i].stored) {
        if (seen.insert(segments[i].stored).second) open.push_back(segments[i].stored);
        continue;
      }
      RMP_TRY_ASSIGN(const auto providers,
                     motion::providers_of(ctx.app.registry, segments[i], where));
      if (!providers.is_joint())
        return error(ErrorCode::invalid_argument, "it moves the tool, not the joints",
                     "Run such a trajectory with world.inverse_kinematics.", where);
    }
  }
  return {};
}

Result<Value> forward_kinematics(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args);
  RMP_TRY_ASSIGN(const std::size_t at,
                 find_trajectory(ctx, typed<World>(args), *args.find("trajectory"),
                                 name_in(ctx, ref(args, "id"))));
  RMP_TRY(only_joint_segments(ctx, w.trajectories[at].trajectory));
  return simulate_trajectory(
      ctx, args,
      [&](const sim::Simulator& simulator, const sim::Run& run) -> Result<recording::RecordingPtr> {
        RMP_TRY_ASSIGN(const auto joints, simulator.inverse_kinematics(run, ctx.progress));
        const std::vector<std::string> tool{"pose", "velocity"};
        RMP_TRY_ASSIGN(const auto all,
                       sim::with_quantities(simulator, *joints, tool, ctx.progress));
        recording::Recording out = *all;
        out.title = run.robot + " on " + run.trajectory + ": forward kinematics";
        return std::make_shared<const recording::Recording>(std::move(out));
      });
}

Result<Value> trajectory_in_base(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args);
  const std::string where = name_in(ctx, ref(args, "id"));
  RMP_TRY_ASSIGN(const std::size_t robot,
                 find_robot(ctx, typed<World>(args), *args.find("robot"), where));
  RMP_TRY_ASSIGN(const std::size_t at,
                 find_trajectory(ctx, typed<World>(args), *args.find("trajectory"), where));
  const document::Snapshot& now = ctx.snapshot();
  const model::PlacedTrajectory& placed = w.trajectories[at];
  const model::Trajectory& t = *now.get(placed.trajectory);
  RMP_TRY_ASSIGN(const auto path,
                 motion::Path::build(ctx.app.registry, placed.name, t, motion::stored_in(now)));
  const Pose world_T_base = spatial::compose(model::pose(w.robots[robot].placement),
                                             model::pose(now.get(w.robots[robot].robot)->base)),
             base_T_path =
                 spatial::compose(spatial::inverse(world_T_base), model::pose(placed.placement));
  const double step = has(args, "step") ? real(args, "step") : t.sample_time;
  if (path->duration() / step > kMostSamples)
    return error(ErrorCode::invalid_argument,
                 "a step of " + text::print(step) + " s makes more than " +
                     text::print(kMostSamples) + " samples",
                 "Give a longer step.", "step");
  const auto times = path->sample_times(step);
  std::vector<PathSample> samples(times.size());
  RMP_TRY(path->sample(times, samples));
  std::vector<double> rows;
  rows.reserve(7 * times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const model::Placement p = model::placement(spatial::compose(base_T_path, samples[i].pose));
    rows.insert(rows.end(), {times[i], p.position[0], p.position[1], p.position[2], p.angles[0],
                             p.angles[1], p.angles[2]});
  }
  return Value(NumericArray(std::move(rows), times.size(), 7));
}

}  // namespace

RMP_COMMANDS(world_run_commands) {
  std::vector<CommandSpec> all;
  Schema run_params{
      self("world"),
      placed_robot_field(),
      placed_trajectory_field(),
      above_zero(optional("sample_time", "real", "s",
                          "Time between samples; by default that of the trajectory.")),
      above_zero(defaulted("position_tolerance", "real", "m", 1e-9,
                           "Tolerance for reaching the position.")),
      above_zero(defaulted("rotation_tolerance", "real", "rad", 1e-9,
                           "Tolerance for reaching the rotation.")),
      choice("start", {"robot", "path"},
             "robot: the joints start at the present configuration. If the first segment of the "
             "trajectory is a path through several joint vectors, an approach to its beginning is "
             "added, which a note and the column approach report. path: the joints start at the "
             "beginning of that segment."),
      defaulted("clearance", "bool", "", false,
                "Also records the least distance between bodies, in the column clearance.")};
  for (ParamSpec& p :
       objective_fields("away from the world's other bodies and the robot's own links"))
    run_params.push_back(std::move(p));
  run_params.push_back(watch_field());
  // Of runs that have torques.
  auto loaded_params = run_params;
  for (ParamSpec& p : tip_load_fields("the path length of the tip since the trajectory began"))
    loaded_params.push_back(std::move(p));
  all.push_back(
      {.name = "world.inverse_kinematics",
       .classic = "World WorldInvKineSim(robot, trajectory, ~time_delay, ~kine_type)|World "
                  "InvKineWorldSim(robot, trajectory, ~time_delay, ~kine_type)",
       .summary = "Moves a robot's tool along a trajectory and records joint values, "
                  "speeds and accelerations.",
       .details = "Starts from the robot's present joint values, or as set by `start`. A sample "
                  "that cannot be reached is an error that gives its time. With an objective, a "
                  "solver that supports it follows the path if the robot's own solver does not.",
       .example = example_run("local r = cell:inverse_kinematics{robot = \"arm\", "
                              "trajectory = \"stroke\"}\nassert(#r:values(\"time\") > 2)"),
       .params = run_params,
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = inverse_kinematics,
       .runs = RunKind::simulation});
  all.push_back(
      {.name = "world.inverse_dynamics",
       .classic = "World WorldInvDynSim(robot, trajectory, ~time_delay, ~tau_option)|World "
                  "InvDynWorldSim(robot, trajectory, ~time_delay, ~tau_option)",
       .summary = "Moves a robot's tool along a trajectory and records the joint torques as well.",
       .details = "The torques are recorded as total and as gravity, inertial, velocity and "
                  "friction parts. With a force or moment on the robot at a tip, such as a cutting "
                  "force, tau includes it: this part is tau_external = -J^T F, and the columns "
                  "wrench1 to wrench6 (world axes) and path show the load and the path length. A "
                  "run under forces can use them again as its tip_wrench.",
       .example = example_run("local r = cell:inverse_dynamics{robot = \"arm\", trajectory = "
                              "\"stroke\"}\nassert(#r:values(\"tau1\") > 2)\n"
                              "local cut = cell:inverse_dynamics{robot = \"arm\", trajectory = "
                              "\"stroke\",\n  tip_force = {\"-20 N - 100 N/m * path\", 0, 0}, "
                              "tip_axes = \"tool\"}\n"
                              "local f, part = cut:values(\"tau_external1\"), "
                              "cut:values(\"tau1\")[3] - r:values(\"tau1\")[3]\n"
                              "assert(math.abs(f[3] - part) < 1e-9)"),
       .params = loaded_params,
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = inverse_dynamics,
       .runs = RunKind::simulation});
  auto optimal_params = loaded_params;
  optimal_params.push_back(
      between(defaulted("share", "real", "", 1.0, "Share of the joints' limits to use."), 0.01, 1));
  optimal_params.push_back(
      defaulted("torque_limits", "bool", "", true, "Respect the torque limits too."));
  optimal_params.push_back(
      above_zero(defaulted("step", "real", "s", 0.01, "Time between samples of the result.")));
  optimal_params.push_back(optional("retimer", "any", "",
                                    "Provider, see provider.list(\"retimer\"), by name or with "
                                    "its parameters."));
  all.push_back(
      {.name = "world.time_optimal",
       .classic = "",
       .summary = "Runs a trajectory's path as fast as the joints' limits allow, and records it.",
       .details = "The joint path is computed as in world.inverse_kinematics, at the trajectory's "
                  "sample time; the speed of the trajectory itself is ignored. The path is then "
                  "run from rest to rest within velocity, acceleration and torque limits, with "
                  "stops at corners of the joint path. A force on the robot needs its share of the "
                  "torques; it may be a constant or depend on `path`, not on `time`.",
       .example = example_run("local slow = cell:inverse_kinematics{robot = \"arm\", trajectory = "
                              "\"stroke\"}\nlocal fast = cell:time_optimal{robot = \"arm\", "
                              "trajectory = \"stroke\"}\nlocal a, b = slow:values(\"time\"), "
                              "fast:values(\"time\")\nassert(b[#b] < a[#a])"),
       .params = optimal_params,
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = time_optimal,
       .runs = RunKind::simulation});
  all.push_back(
      {.name = "world.simulate",
       .classic = "World WorldSimulate",
       .summary = "Moves a robot's tool along a trajectory and records joint motion and torques.",
       .details =
           "Joint torques are recorded if moving links have masses or a force acts at a tip: it is "
           "then the same as world.inverse_dynamics, otherwise as world.inverse_kinematics.",
       .example = example_run("local r = cell:simulate{robot = \"arm\", trajectory = "
                              "\"stroke\"}\nassert(#r:values(\"tau1\") > 2)"),
       .params = loaded_params,
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = simulate_motion,
       .runs = RunKind::simulation});
  all.push_back(
      {.name = "world.forward_kinematics",
       .classic = "World WorldfKineSim",
       .summary =
           "Moves a robot's joints along a joint trajectory and records the motion of the tool.",
       .details = "All segments of the trajectory move joints (such as ptp or joint_spline). The "
                  "recording has q, qd and qdd of the joints, x, y, z, roll, pitch and yaw of the "
                  "tool in the world, and its velocities.",
       .example = example_cell(
           "trajectory.create{name = \"swing\", segments = {{shape = \"ptp\", joints = {{0, 0, "
           "0, 0, 0, 0}, {0.5, 0, 0, 0, 0, 0}}}}}\ncell:add_trajectory{trajectory = \"swing\"}\n"
           "local r = cell:forward_kinematics{robot = \"arm\", trajectory = \"swing\"}\n"
           "local y = r:values(\"y\")\nassert(math.abs(y[#y] - 0.5 * math.sin(0.5)) < 1e-9)"),
       .params = run_params,
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .run = forward_kinematics,
       .runs = RunKind::simulation});
  all.push_back(
      {.name = "world.trajectory_in_base",
       .classic = "World ComputeBaseTjc(robot, trajectory, step)",
       .summary = "Samples a trajectory of a world in the base frame of a robot.",
       .details = "A controller of the robot takes these poses.",
       .example = example_run(
           "cell:place{member = \"arm\", position = {1, 0, 0}}\n"
           "local there, here = trajectory.points(\"stroke\"), cell:trajectory_in_base{robot = "
           "\"arm\", trajectory = \"stroke\"}\n"
           "assert(math.abs(there[1][2] - here[1][2] - 1) < 1e-12)"),
       .params = {self("world"), placed_robot_field(), placed_trajectory_field(),
                  above_zero(optional("step", "real", "s",
                                      "Time between samples; by default that of the trajectory."))},
       .returns = {"matrix", "", "Columns: time [s], x, y, z [m], roll, pitch, yaw [rad].", {}},
       .effect = Effect::reads,
       .run = trajectory_in_base});
  return all;
}

}  // namespace robomosp::ioci
