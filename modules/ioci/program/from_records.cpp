// SPDX-License-Identifier: Apache-2.0
// Programs of robots made of what a world has already: tasks, trajectories, recordings.
#include "program_source/from_records.h"

#include "ioci/core/commands.h"
#include "ioci/world/members.h"
#include "model/program_kinds.h"

namespace robomosp::ioci {
namespace {

using model::World;

evaluation::Sources sources(const CommandContext& ctx) {
  return {ctx.app.registry, ctx.app.derived, ctx.snapshot()};
}

/// The record of a program, and messages of what it does otherwise.
Result<Value> added(CommandContext& ctx, program_source::WrittenProgram written) {
  for (const std::string& n : written.notes)
    ctx.app.messages.post(Severity::warning, "program_differs", n, "program");
  model::Record r;
  r.name = std::move(written.name);
  r.body = model::OtherContent(program_kind(), std::move(written.program));
  RMP_TRY_ASSIGN(const AnyId made, ctx.edit().add(std::move(r)));
  return Value(Application::handle(made));
}

std::string name_wanted(const Map& args) {
  return has(args, "name") ? text_of(args, "name") : std::string();
}

Result<Value> from_trajectory(CommandContext& ctx, const Map& args) {
  const WorldId world = typed<World>(args, "world");
  const std::string where = name_in(ctx, AnyId(world));
  RMP_TRY_ASSIGN(const std::size_t robot, find_robot(ctx, world, *args.find("robot"), where));
  RMP_TRY_ASSIGN(const std::size_t trajectory,
                 find_trajectory(ctx, world, *args.find("trajectory"), where));
  RMP_TRY_ASSIGN(auto written, program_source::from_trajectory(sources(ctx), world, robot,
                                                               trajectory, integer(args, "points"),
                                                               name_wanted(args), ctx.progress));
  return added(ctx, std::move(written));
}

Result<Value> from_task(CommandContext& ctx, const Map& args) {
  const WorldId world = typed<World>(args, "world");
  RMP_TRY_ASSIGN(const std::size_t task,
                 find_task(ctx, world, *args.find("task"), name_in(ctx, AnyId(world))));
  RMP_TRY_ASSIGN(auto written, program_source::from_task(sources(ctx), world, task,
                                                         name_wanted(args), ctx.progress));
  return added(ctx, std::move(written));
}

Result<Value> from_recording(CommandContext& ctx, const Map& args) {
  const auto r = ctx.recording(*args.find("recording")->as_handle());
  RMP_TRY_ASSIGN(auto written,
                 program_source::from_recording(
                     sources(ctx), *r, has(args, "robot") ? text_of(args, "robot") : std::string(),
                     real(args, "tolerance"), name_wanted(args), ctx.progress));
  return added(ctx, std::move(written));
}

std::string with_cell_of_task(const char* rest) {
  return with_arm(
             "local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n"
             "cell:add_signal{name = \"ready\"}\n"
             "task.create{name = \"serve\", steps = {\n"
             "  {step = \"wait\", condition = \"ready == 1\"},\n"
             "  {step = \"repeat\", count = 2, steps = {\n"
             "    {step = \"move\", joints = {0.1, 0.2, 0.3, 0, 0, 0}, speed = 0.5},\n"
             "    {step = \"move\", joints = {0, 0, 0, 0, 0, 0}}}}}}\n"
             "cell:add_task{task = \"serve\", robot = \"arm\"}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(program_from_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec name =
      optional("name", "string", "", "Name of the program; by default that of its source.");
  all.push_back(
      {.name = "program.from_task",
       .classic = "",
       .summary = "Makes a program from a task of a world.",
       .details = "Moves, grips, signals, waits, calls and blocks become statements of the "
                  "language, targets become poses in the robot's base. A step that the language "
                  "cannot express is an error that names it: steps of other robots, conditions "
                  "over places and time, tools of single steps. Messages and the head of the "
                  "source list what is expressed differently.",
       .example = with_cell_of_task("local p = program.from_task{world = cell, task = \"serve\"}\n"
                                    "assert(p:check().correct)\n"
                                    "assert(p:source():find(\"WAIT FOR ready = TRUE\"))"),
       .params = {needed("world", "ref:world", "", "The world."),
                  needed("task", "any", "", "Task of it, by name."), name},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = from_task});
  all.push_back(
      {.name = "program.from_trajectory",
       .classic = "",
       .summary = "Makes a program from a trajectory of a world, for one of its robots.",
       .details = "Lines become MOVE LIN, arcs MOVE CIRCLE, joint motions MOVE PTP, and other "
                  "curves MOVE PATH through points on them. If a segment begins elsewhere, the "
                  "robot moves there first. Speeds or times are those of the segments.",
       .example = example_run("local p = program.from_trajectory{world = cell, robot = \"arm\",\n"
                              "  trajectory = \"stroke\"}\n"
                              "assert(p:check().correct and p:source():find(\"MOVE LIN\"))"),
       .params = {needed("world", "ref:world", "", "The world."),
                  needed("robot", "any", "", "Robot of it, by name."),
                  needed("trajectory", "any", "", "Trajectory of it, by name."),
                  between(defaulted("points", "int", "", 20,
                                    "Number of points for a curve that is neither line nor arc."),
                          2, 100'000),
                  name},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = from_trajectory});
  all.push_back(
      {.name = "program.from_recording",
       .classic = "",
       .summary = "Makes a program from the joint motion in a recording.",
       .details = "It keeps as few rows as reproduce the motion within the tolerance; each becomes "
                  "a MOVE PTP that takes the time between the rows and passes without a stop.",
       .example = example_run("local run = cell:inverse_kinematics{robot = \"arm\", trajectory = "
                              "\"stroke\"}\n"
                              "local p = program.from_recording{recording = run}\n"
                              "assert(p:check().correct and p:source():find(\"C_PASS\"))"),
       .params = {needed("recording", "ref:recording", "", "The recording."),
                  optional("robot", "string", "", "The robot, if the recording has several."),
                  above_zero(
                      defaulted("tolerance", "real", "", 1e-3,
                                "Greatest error of the joints between the kept rows [rad or m].")),
                  name},
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = from_recording});
  return all;
}

}  // namespace robomosp::ioci
