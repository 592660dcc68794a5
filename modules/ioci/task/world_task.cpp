// SPDX-License-Identifier: Apache-2.0
// Commands for what worlds have for tasks: frames, lights, tasks, signals, held objects.
#include <algorithm>
#include <cmath>

#include "ioci/core/placement_argument.h"
#include "ioci/core/record_params.h"
#include "ioci/core/watchers.h"
#include "ioci/program/alone_inputs.h"
#include "ioci/program/in_world.h"
#include "ioci/program/run_files.h"
#include "ioci/simulation/run_start.h"
#include "ioci/simulation/task_physics.h"
#include "ioci/simulation/task_run.h"
#include "ioci/task/steps.h"
#include "ioci/world/members.h"
#include "task/run.h"

namespace robomosp::ioci {
namespace {

using model::World;

/// Adds what `make` gives under its name to a list of the world; the answer is the name.
template <class T>
Result<Value> add_member(CommandContext& ctx, const Map& args, std::vector<T> World::*list,
                         const std::string& wanted, T made) {
  RMP_TRY_ASSIGN(const Value none, change_world(ctx, args, [&](World& w) -> Result<void> {
                   RMP_TRY_ASSIGN(made.name, member_name(w, args, wanted));
                   (w.*list).push_back(made);
                   ctx.expressions.keep(w.parametric, made.name);
                   return {};
                 }));
  static_cast<void>(none);
  return Value(made.name);
}

Result<Value> add_frame(CommandContext& ctx, const Map& args) {
  model::PlacedFrame f;
  RMP_TRY(set_fields(f, args));
  RMP_TRY_ASSIGN(f.placement, placement_given(ctx, "placement"));
  return add_member(ctx, args, &World::frames, "frame", std::move(f));
}

Result<Value> add_light(CommandContext& ctx, const Map& args) {
  model::PlacedLight l;
  RMP_TRY_ASSIGN(l.placement, placement_given(ctx, "placement"));
  RMP_TRY(set_fields(l, args));
  return add_member(ctx, args, &World::lights, "light", std::move(l));
}

Result<Value> add_task(CommandContext& ctx, const Map& args) {
  model::PlacedTask t;
  RMP_TRY(set_fields(t, args));
  const std::string wanted = ctx.snapshot().find(AnyId(t.task))->name;
  return add_member(ctx, args, &World::tasks, wanted, std::move(t));
}

Error no_signal(const World& w, const std::string& name) {
  std::vector<std::string> known;
  for (const auto& s : w.signals) known.push_back(s.name);
  return unknown_name("signal", name, known);
}

/// A value in the unit of its signal.
Result<double> signal_value(const Value& v, const std::string& unit, std::string_view path) {
  RMP_TRY_ASSIGN(const Value checked, check_value(field("", "real", unit, ""), v, path));
  return checked.number();
}

Result<Value> add_signal(CommandContext& ctx, const Map& args) {
  model::Signal s;
  RMP_TRY(set_fields(s, args, {"initial"}));
  RMP_TRY_ASSIGN(s.initial, signal_value(*args.find("initial"), s.unit, "initial"));
  return change_world(ctx, args, [&](World& w) -> Result<void> {
    w.signals.push_back(s);
    return {};
  });
}

Result<Value> remove_signal(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "signal");
  return change_world(ctx, args, [&](World& w) -> Result<void> {
    if (std::erase_if(w.signals, [&](const auto& s) { return s.name == name; }) == 0)
      return no_signal(w, name);
    return {};
  });
}

Result<Value> set_signal(CommandContext& ctx, const Map& args) {
  const std::string name = text_of(args, "signal");
  const auto& before = content<World>(ctx, args).signals;
  const auto known = std::find_if(before.begin(), before.end(),
                                  [&](const model::Signal& s) { return s.name == name; });
  if (known == before.end()) return no_signal(content<World>(ctx, args), name);
  RMP_TRY_ASSIGN(const double value, signal_value(*args.find("value"), known->unit, "value"));
  return change_world(ctx, args, [&](World& w) -> Result<void> {
    const auto it = std::find_if(w.signals.begin(), w.signals.end(),
                                 [&](const model::Signal& s) { return s.name == name; });
    if (it == w.signals.end()) return no_signal(w, name);
    // The value of an expression is exact at the end of the command only.
    const bool is_whole = std::fabs(value - std::round(value)) < 1e-9;
    if (it->kind == model::SignalKind::digital &&
        (!is_whole || (std::round(value) != 0 && std::round(value) != 1)))
      return error(
          ErrorCode::invalid_argument,
          "the digital signal " + text::quote(name) + " cannot be " + text::print_rounded(value),
          "It is 0 or 1.");
    it->initial = value;
    return {};
  });
}

Result<Value> attach(CommandContext& ctx, const Map& args) {
  model::Attachment a;
  RMP_TRY(set_fields(a, args));
  RMP_TRY_ASSIGN(a.tool_T_object, placement_given(ctx, "placement"));
  return change_world(ctx, args, [&](World& w) -> Result<void> {
    std::erase_if(w.attachments, [&](const auto& old) { return old.object == a.object; });
    w.attachments.push_back(a);
    return {};
  });
}

Result<Value> detach(CommandContext& ctx, const Map& args) {
  const std::string object = text_of(args, "object");
  return change_world(ctx, args, [&](World& w) -> Result<void> {
    if (std::erase_if(w.attachments, [&](const auto& a) { return a.object == object; }) != 0)
      return {};
    return error(ErrorCode::unknown_name, "object " + text::quote(object) + " is not attached");
  });
}

Result<Value> run_task(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(task::TaskRun run, task_run(ctx, args));
  std::vector<std::string> until_fault;
  run.until_fault = &until_fault;
  const sim::Simulator simulator{ctx.app.registry, ctx.app.derived, ctx.snapshot(),
                                 &ctx.app.collision_models};
  auto recording = task::run(simulator, run, ctx.progress);
  if (!recording.ok()) {
    // There is no recording that would have them.
    for (const std::string& note : until_fault)
      ctx.app.messages.post(Severity::info, "program_note", note, "world.run_task");
    return std::move(recording).error().in(name_in(ctx, ref(args, "id")));
  }
  RMP_TRY_ASSIGN(auto noted, with_start_notes(ctx, *recording));
  return Value(Handle{"recording", ctx.app.recordings.add(std::move(noted))});
}

template <const char* (*field)()>
Result<Value> member_list(CommandContext& ctx, const Map& args) {
  Map all;
  set_members(all, ctx.snapshot(), content<World>(ctx, args));
  return *all.find(field());
}
const char* frames_field() { return "frames"; }
const char* lights_field() { return "lights"; }
const char* tasks_field() { return "tasks"; }
const char* signals_field() { return "signals"; }
const char* attachments_field() { return "attachments"; }

std::string with_cell(const char* rest) {
  return with_arm("local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n") +
         rest;
}
Schema light_params() {
  Schema s = led_by({"name", "kind", "colour", "intensity", "angle"},
                    record_params("world", "lights", "the world"));
  param_named(s, "kind").default_value = Value("point");
  param_named(s, "intensity").default_value = Value(1.0);
  param_named(s, "angle").default_value = Value(0.5);
  s.insert(s.begin(), self("world"));
  return s;
}

Schema frame_params() {
  Schema s = led_by({"name"}, record_params("world", "frames", "the world"));
  param_named(s, "name").doc = "Name in the world.";
  s.insert(s.begin(), self("world"));
  return s;
}

Schema attachment_params() {
  Schema s = led_by({"object", "robot", "link"},
                    record_params("world", "attachments", "the link or tool"));
  param_named(s, "object").required = true;
  ParamSpec& robot = param_named(s, "robot");
  robot.required = true;
  robot.doc = "Name of the robot in the world; may be omitted if the world has only one.";
  s.insert(s.begin(), self("world"));
  return s;
}

Schema signal_params() {
  Schema s = led_by({"name", "kind", "unit"}, record_params("world", "signals"));
  param_named(s, "name").required = true;
  param_named(s, "kind").default_value = Value("digital");
  ParamSpec& initial = param_named(s, "initial");
  initial.type = "bool or real";  // in the signal's unit
  initial.default_value = Value(0.0);
  s.insert(s.begin(), self("world"));
  return s;
}

std::string with_part(const char* rest) {
  return with_cell(
      (std::string("solid.create{name = \"part\", root = {kind = \"box\", x = 0.05, y = 0.05, z = "
                   "0.05}}\ncell:add_object{what = \"part\"}\n") +
       rest)
          .c_str());
}

}  // namespace

RMP_COMMANDS(world_task_commands) {
  std::vector<CommandSpec> all;
  const ReturnSpec made{"string", "", "Name of the member.", {}};
  const auto add = [&](const char* command, const char* summary, const char* details,
                       std::string example, Schema params, ReturnSpec returns,
                       Result<Value> (*run)(CommandContext&, const Map&), bool takes_expressions) {
    const Effect effect = returns.type == "list" ? Effect::reads : Effect::edits;
    all.push_back({.name = command,
                   .classic = "",
                   .summary = summary,
                   .details = details,
                   .example = std::move(example),
                   .params = std::move(params),
                   .returns = std::move(returns),
                   .effect = effect,
                   .run = run,
                   .takes_expressions = takes_expressions});
  };
  add("world.add_frame", "Adds a named frame to a world.", "Targets of tasks may be given in it.",
      with_cell("cell:add_frame{name = \"bench\", position = {0.5, 0, 0.3}}\n"
                "assert(cell:frames()[1].placement.position[1] == 0.5)"),
      frame_params(), made, add_frame, true);
  add("world.add_light", "Adds a light to a world.",
      "A sun and a spot shine along -z of their frame, with the same brightness at any distance. "
      "They and point lights replace the renderer's own lamp in pictures of the world, under a "
      "weaker sky; without them that lamp is used. Ambient light comes from all sides, and replaces "
      "the light of the studio's sky and floor: intensity 1 is as bright, 0 leaves none.",
      with_cell("cell:add_light{name = \"lamp\", kind = \"spot\", position = {0, 0, 2}, angle = "
                "\"30 deg\"}\nassert(cell:lights()[1].kind == \"spot\")"),
      light_params(), made, add_light, true);
  add("world.add_task", "Adds a task to a world.", "",
      with_cell("task.create{name = \"shift\", steps = {{step = \"move\", pose = \"ready\"}}}\n"
                "cell:add_task{task = \"shift\", robot = \"arm\"}\n"
                "assert(cell:tasks()[1].robot == \"arm\")"),
      led_by({"id", "task", "name", "robot"}, member_params("tasks", "task")), made, add_task,
      false);
  add("world.add_signal", "Adds a named signal between devices to a world.",
      "Tasks set it and wait for it. Its name is used in expressions: a letter, then letters, "
      "digits and _.",
      with_cell("cell:add_signal{name = \"part_ready\", from = \"arm\"}\n"
                "assert(cell:signals()[1].kind == \"digital\")"),
      signal_params(), {}, add_signal, false);
  add("world.remove_signal", "Removes a signal from a world.", "",
      with_cell("cell:add_signal{name = \"part_ready\"}\ncell:remove_signal(\"part_ready\")\n"
                "assert(#cell:signals() == 0)"),
      {self("world"), needed("signal", "string", "", "Its name.")}, {}, remove_signal, false);
  add("world.set_signal", "Sets a signal of a world.",
      "Runs of tasks start with this value. Callers of server.wait that wait for it continue, in "
      "this program and in connected ones.",
      with_cell("cell:add_signal{name = \"part_ready\"}\ncell:set_signal(\"part_ready\", 1)\n"
                "assert(cell:signals()[1].initial == 1)"),
      {self("world"), needed("signal", "string", "", "Its name."),
       needed("value", "any", "", "0 or 1, or any number for an analogue signal, in the SI unit.")},
      {}, set_signal, false);
  add("world.attach", "Attaches an object to a robot of a world, from the start of each run.",
      "The placement is that of the object in the frame of the link or tool. An object that is "
      "already held is taken over from its holder. Its mass counts in the dynamics of the robot: "
      "torques, time-optimal and forward runs.",
      with_part("cell:attach{object = \"part\", robot = \"arm\", position = {0, 0, 0.02}}\n"
                "assert(cell:attachments()[1].robot == \"arm\")"),
      attachment_params(), {}, attach, false);
  add("world.detach", "Releases an object that a robot of a world holds.",
      "Its frame is then its placement in the world.",
      with_part("cell:attach{object = \"part\", robot = \"arm\"}\ncell:detach(\"part\")\n"
                "assert(#cell:attachments() == 0)"),
      {self("world"), needed("object", "string", "", "Name of the object in the world.")}, {},
      detach, false);
  all.push_back(
      {.name = "world.run_task",
       .classic = "",
       .summary = "Runs tasks and programs of a world, all on one clock, and records robots, "
                  "signals and held objects.",
       .details =
           "Each task runs independently; moves and waits take time, all other steps take none. "
           "Tasks synchronise through signals. A condition over time or places ends a wait at the "
           "instant it becomes true; it must be true for longer than the time between rows. The "
           "recording has the columns <robot>.q1, <robot>.qd1, <robot>.qdd1, ..., signal.<name> "
           "and <object>.x, ...; its notes list objects taken and released, and messages. "
           "recording.compute adds torques and poses of a robot. A wait that can never become true "
           "is an error that names its step. Programs run with the bindings of their names in the "
           "world (program.bind); their output becomes notes, and <program>.line is the present "
           "line of each. With physics, objects that have a mass and are not held fall, touch and "
           "slide, and robots push them: conditions, grips and frames use their actual places. The "
           "run ends with the last task and program; let one wait until the objects are at rest.",
       .example = with_part(
           "task.create{name = \"shift\", steps = {\n  {step = \"attach\", object = \"part\"},\n  "
           "{step = \"move\", pose = \"ready\", duration = 2},\n  {step = \"detach\", object = "
           "\"part\"}}}\ncell:add_task{task = \"shift\", robot = \"arm\"}\nlocal r = "
           "cell:run_task{task = \"shift\"}\nlocal t = r:values(\"time\")\nassert(math.abs(t[#t] - "
           "2) < 1e-9)"),
       .params = {self("world"),
                  optional("task", "any", "",
                           "Name or names; if task and program are omitted, all of the world."),
                  optional("program", "any", "", "Name or names of programs in the world."),
                  choice("unbound", {"error", "free"},
                         "Whether signals of programs without a binding are an error, or belong to "
                         "the programs."),
                  values_field(), lines_field(), files_field(),
                  above_zero(defaulted("sample_time", "real", "s", 0.02, "Time between rows.")),
                  above_zero(defaulted("most_time", "real", "s", 3600.0,
                                       "Limit: a run that takes longer is an error.")),
                  above_zero(optional("duration", "real", "s", "The run ends at this time.")),
                  task_physics_field(), watch_field()},
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates,
       .sometimes = Effect::files_read | Effect::files_write,
       .run = run_task,
       .runs = RunKind::task});
  const auto list = [&](const char* command, const char* summary, const char* make,
                        Result<Value> (*run)(CommandContext&, const Map&),
                        std::vector<ParamSpec> fields) {
    add(command, summary, "", with_part(make), {self("world")},
        {"list", "", "One table each.", std::move(fields)}, run, false);
  };
  const ParamSpec its_name = field("name", "string", "", "Name in the world."),
                  its_place = field("placement", "map", "", "Pose in the world.");
  list("world.frames", "Lists the frames of a world.",
       "cell:add_frame{name = \"bench\"}\nassert(#cell:frames() == 1)", member_list<frames_field>,
       {its_name, its_place});
  list("world.lights", "Lists the lights of a world.",
       "cell:add_light{}\nassert(cell:lights()[1].name == \"light\")", member_list<lights_field>,
       {its_name, field("kind", "string", "", "sun, point or spot."), its_place,
        field("colour", "colour", "", "Its colour."),
        field("intensity", "real", "", "1 = as bright as the program's own lamp."),
        field("angle", "real", "rad", "Half the opening angle of a spot.")});
  list("world.tasks", "Lists the tasks of a world.", "assert(#cell:tasks() == 0)",
       member_list<tasks_field>,
       {its_name, field("task", "string", "", "The task."),
        field("robot", "string", "", "Robot for its steps that name none.")});
  list("world.signals", "Lists the signals of a world.",
       "cell:add_signal{name = \"go\"}\nassert(cell:signals()[1].name == \"go\")",
       member_list<signals_field>,
       {field("name", "string", "", "Its name."),
        field("kind", "string", "", "digital or analogue."),
        field("unit", "string", "", "SI unit of an analogue signal."),
        field("initial", "real", "", "Value when a run starts, in the SI unit."),
        field("from", "string", "", "The device that sets it."),
        field("to", "string", "", "The device that reads it."),
        field("description", "string", "", "Its text.")});
  list(
      "world.attachments", "Lists the objects that robots of a world hold.",
      "assert(#cell:attachments() == 0)", member_list<attachments_field>,
      {field("object", "string", "", "The held object."),
       field("robot", "string", "", "The robot that holds it."),
       field("link", "string", "", "The link or tool; \"\" = the robot's tool."),
       field("placement", "map", "", "Placement of the object in the frame of the link or tool.")});
  return all;
}

}  // namespace robomosp::ioci
