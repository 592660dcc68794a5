// SPDX-License-Identifier: Apache-2.0
// Where along a trajectory a robot cannot follow: a table of the places, and a picture of them.
#include "io/native.h"
#include "ioci/core/commands.h"
#include "ioci/view/picture.h"
#include "ioci/world/members.h"
#include "ioci/world/pair_remedy.h"
#include "kernel/fault.h"
#include "scene/build.h"
#include "sim/trajectory_faults.h"

namespace robomosp::ioci {
namespace {

/// "sample 37 of 400 (t = 0.36 s): it is out of reach"
std::string sentence_of(const sim::PathCheck& c, const sim::PathFault& f) {
  if (f.is_start) return "at the robot's present joint values, before it begins: " + f.why;
  return "sample " + std::to_string(f.worst + 1) + " of " + std::to_string(c.times.size()) +
         " (t = " + text::print_rounded(c.times[f.worst]) + " s): " + f.why;
}

const FaultCodes kTrajectoryCodes{
    {"trajectory.start", ErrorCode::conflict,
     "The robot is in contact or outside its limits before a trajectory begins."},
    {"trajectory.unreachable", ErrorCode::unreachable,
     "No joint values within the limits bring the tool to a sample of a trajectory."},
    {"trajectory.limit", ErrorCode::unreachable,
     "A joint passes its velocity, acceleration, jerk or torque limit on a trajectory."},
    {"trajectory.collision", ErrorCode::conflict, "Bodies touch along a trajectory."},
};

/// The fault as data: the trajectory's samples, and the robot's joints there.
Fault path_fault(const sim::PathCheck& c, const sim::PathFault& f, AnyId trajectory, AnyId world) {
  const std::string sentence = sentence_of(c, f);
  const std::size_t why = sentence.size() - f.why.size();
  Fault out = make_fault(
      "trajectory." + (f.is_start ? std::string("start") : std::string(sim::to_string(f.kind))),
      f.why, {}, sentence.substr(0, why >= 2 ? why - 2 : 0));
  out.subject.record = Application::handle(trajectory);
  out.subject.name = c.trajectory;
  if (!f.is_start) {
    out.extent.first = f.first + 1;
    out.extent.last = f.last + 1;
    out.extent.worst = f.worst + 1;
  }
  out.extent.from = c.times[f.first];
  out.extent.to = c.times[f.last];
  out.extent.at = c.times[f.worst];
  FaultWitness& w = out.witness;
  w.scene = Application::handle(world);
  w.robot = c.robot;
  const auto q =
      f.is_start ? c.start.begin() : c.q.begin() + static_cast<std::ptrdiff_t>(f.worst * c.dof);
  w.q.assign(q, q + static_cast<std::ptrdiff_t>(c.dof));
  if (f.joint >= 0) {
    const auto joint = static_cast<std::size_t>(f.joint);
    FaultJoint at_fault;
    at_fault.name = "joint " + std::to_string(joint + 1);
    at_fault.number = joint + 1;
    at_fault.value = w.q[joint];
    w.joints.push_back(std::move(at_fault));
  }
  if (!f.a.empty()) {
    w.bodies = {f.a, f.b};
    out.remedies.push_back(allow_pair_remedy(w.scene, f.a, f.b));
  }
  if (!f.is_start) {
    const Vec3& p = c.poses[f.worst].p;
    w.points.push_back({"sample " + std::to_string(f.worst + 1), p[0], p[1], p[2]});
  }
  if (f.excess > 0) {
    w.excess = f.excess;
    w.unit = f.unit;
  }
  return out;
}

Value row_of(PairTrials& trials, const sim::PathCheck& c, const sim::PathFault& f, AnyId trajectory,
             AnyId world) {
  Fault fault = path_fault(c, f, trajectory, world);
  trials.look_at(fault);
  const auto q =
      f.is_start ? c.start.begin() : c.q.begin() + static_cast<std::ptrdiff_t>(f.worst * c.dof);
  const double end = c.times.back();
  Map row{{"kind", f.is_start ? std::string("start") : std::string(sim::to_string(f.kind))},
          {"sample", f.worst + 1},
          {"first", f.first + 1},
          {"last", f.last + 1},
          {"time", c.times[f.worst]},
          {"from", c.times[f.first]},
          {"to", c.times[f.last]},
          {"share", end > 0 ? c.times[f.worst] / end : 0.0},
          {"q", NumericArray(std::vector<double>(q, q + static_cast<std::ptrdiff_t>(c.dof)))},
          {"why", f.why},
          {"text", sentence_of(c, f)},
          {"fault", fault_map(fault)}};
  if (!f.is_start) row.set("position", vec_value(c.poses[f.worst].p, "m"));
  if (f.joint >= 0) row.set("joint", Value(f.joint + 1));
  if (f.excess > 0) {
    row.set("excess", Value(f.excess));
    row.set("unit", Value(f.unit));
  }
  if (!f.a.empty()) {
    row.set("a", Value(f.a));
    row.set("b", Value(f.b));
  }
  return row;
}

/// The world with the robot at its last good sample and the way in the colours of its faults.
Result<void> draw(CommandContext& ctx, const Map& args, const sim::PathCheck& check,
                  const std::string& file) {
  RMP_TRY_ASSIGN(render::Options options, read_picture(args));
  if (options.look.caption.empty() && !check.faults.empty())
    options.look.caption = sentence_of(check, check.faults.front());
  scene::Extras extras;
  extras.frames = flag(args, "frames");
  extras.paths = scene::ShownPath::none;
  const auto q = check.q.begin() + static_cast<std::ptrdiff_t>(check.last_good() * check.dof);
  extras.robot_q[check.robot] = {q, q + static_cast<std::ptrdiff_t>(check.dof)};
  const scene::Source source{ctx.snapshot(), ctx.app.derived, ctx.app.registry};
  RMP_TRY_ASSIGN(scene::Built built, scene::build(source, ref(args, "id"), extras, ctx.progress));
  RMP_TRY(apply_visibility(ctx, args, ref(args, "id"), built));
  scene::mark_path(built.scene, check);
  RMP_TRY_ASSIGN(options.look.section, read_section(ctx, args, built.scene));
  RMP_TRY_ASSIGN(const auto drawer, renderer(ctx.app));
  RMP_TRY_ASSIGN(const std::string bytes, draw_png(*drawer, built.scene, options, ctx.progress));
  return io::write_file(file, bytes);
}

Result<Value> check(CommandContext& ctx, const Map& args) {
  const std::string file = has(args, "file") ? text_of(args, "file") : "";
  if (!file.empty())
    RMP_TRY(check_new_file(file, ".png", "Pictures are written as PNG files only."));
  sim::Run run;
  run.world = typed<model::World>(args);
  const model::World& world = content<model::World>(ctx, args);
  const std::string where = name_in(ctx, ref(args, "id"));
  RMP_TRY_ASSIGN(const std::size_t robot, find_robot(ctx, run.world, *args.find("robot"), where));
  RMP_TRY_ASSIGN(const std::size_t trajectory,
                 find_trajectory(ctx, run.world, *args.find("trajectory"), where));
  run.robot = world.robots[robot].name;
  run.trajectory = world.trajectories[trajectory].name;
  if (has(args, "sample_time")) run.sample_time = real(args, "sample_time");
  run.begins_on_path = text_of(args, "start") == "path";
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot(),
                                 &ctx.app.collision_models};
  RMP_TRY_ASSIGN(const sim::PathCheck done,
                 sim::check_path(simulator, run, flag(args, "collisions"), ctx.progress));
  List faults, notes;
  PairTrials trials(ctx);
  for (const sim::PathFault& f : done.faults)
    faults.push_back(
        row_of(trials, done, f, world.trajectories[trajectory].trajectory, ref(args, "id")));
  for (const std::string& n : done.notes) notes.emplace_back(n);
  Map out{{"is_good", done.faults.empty()},
          {"samples", done.times.size()},
          {"duration", done.times.back()},
          {"faults", std::move(faults)},
          {"notes", std::move(notes)}};
  if (!file.empty()) {
    RMP_TRY(draw(ctx, args, done, file));
    out.set("file", Value(file));
  }
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(path_check_commands) {
  CommandSpec c;
  c.name = "world.check";
  c.summary = "Finds and draws all places of a trajectory that a robot cannot follow.";
  c.details =
      "The robot follows by inverse kinematics and continues after failures. Where it can follow, "
      "velocities, accelerations, jerks and torques are compared with the limits of the joints, "
      "and the motion is checked for contact, as is the robot's configuration before it begins "
      "(kind start). A fault is a sequence of samples, described by the worst of them. The picture "
      "shows the path in green if it is good, in orange beyond a limit, in violet if bodies touch "
      "and in red if out of reach; the robot is drawn at the last good sample before the first "
      "fault.";
  c.example =
      "local arm = robot.get(\"puma560\")\n"
      "local cell = world.create{name = \"cell\"}\n"
      "cell:add_robot{robot = arm, name = \"arm\", q = \"ready\"}\n"
      "local t = arm:fk{q = \"ready\"}\nlocal p, a = t.position, t.rpy\n"
      "trajectory.create{name = \"out\", sample_time = 0.05, segments = {{shape = \"line\", points "
      "= {\n"
      "  {p[1], p[2], p[3], a[1], a[2], a[3]}, {p[1] + 1, p[2], p[3], a[1], a[2], a[3]}}}}}\n"
      "cell:add_trajectory{trajectory = \"out\"}\n"
      "local c = cell:check{robot = \"arm\", trajectory = \"out\"}\n"
      "assert(not c.is_good and c.faults[1].kind == \"unreachable\")";
  c.params = {
      self("world"),
      placed_robot_field(),
      placed_trajectory_field(),
      above_zero(optional("sample_time", "real", "s",
                          "Time between samples; by default that of the trajectory.")),
      choice(
          "start", {"robot", "path"},
          "Start of the joints. robot: the present configuration, with an approach if the first "
          "segment is a joint motion that begins elsewhere; path: the beginning of that segment."),
      defaulted("collisions", "bool", "", true, "Also checks for contact."),
      optional("file", "path", "", "A picture of the places, *.png.")};
  for (ParamSpec& p : picture_params(
           {.has_mass = false, .has_parts = false, .has_members = true, .has_fading = true}))
    c.params.push_back(std::move(p));
  c.returns = {"map",
               "",
               "",
               {field("is_good", "bool", "", "True if the robot can follow all of it."),
                field("samples", "int", "", "Number of samples."),
                field("duration", "real", "s", "Duration of the motion."),
                field("faults", "list", "",
                      "Tables, in order of time: kind (start, unreachable, limit, collision); the "
                      "worst sample, the first and the last, from 1; time, from and to [s]; share "
                      "of the motion; position [m] on the path; q; joint, excess and its unit, if "
                      "known; bodies a and b of a contact; why; text, a sentence; fault, the "
                      "same as data."),
                field("notes", "list", "", "What was not checked."),
                field("file", "string", "", "The picture.")}};
  c.effect = Effect::reads;
  c.sometimes = Effect::files_write;
  c.run = check;
  return {std::move(c)};
}

}  // namespace robomosp::ioci
