// SPDX-License-Identifier: Apache-2.0
// The command program.run, and what runs of tasks and programs are asked for.
#include "ioci/simulation/task_run.h"

#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/program/alone_inputs.h"
#include "ioci/program/in_world.h"
#include "ioci/program/run_files.h"
#include "ioci/simulation/task_physics.h"
#include "ioci/world/members.h"

namespace robomosp::ioci {
namespace {

Result<Value> run_program(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  Map asked = args;
  asked.erase("id");
  const bool is_placed = !places_of(ctx.snapshot(), id, args).empty();
  if (!is_placed && has(args, "robot")) {
    // A world for the program alone.
    const std::string name = ctx.snapshot().find(id)->name;
    std::string world_name = name + "_cell";
    for (int k = 2; ctx.snapshot().find(Kind::world, world_name); ++k)
      world_name = name + "_cell_" + std::to_string(k);
    RMP_TRY_ASSIGN(const Value world, ctx.dispatch("world.create", Map{{"name", world_name}}));
    RMP_TRY(ctx.dispatch("world.add_robot", Map{{"id", world}, {"robot", *args.find("robot")}}));
    RMP_TRY(ctx.dispatch("world.add_program",
                         Map{{"id", world}, {"program", Application::handle(id)}}));
  } else if (!is_placed) {
    return error(
        ErrorCode::invalid_argument, "no world has this program",
        "Give robot = ... to run it alone in a new world, or place it with world.add_program.",
        name_in(ctx, id));
  } else if (has(args, "robot")) {
    return error(ErrorCode::invalid_argument, "the program already has a world",
                 "Leave robot out; program.bind{kind = \"robot\"} changes it.", "robot");
  }
  RMP_TRY_ASSIGN(const ProgramPlace place, place_of(ctx, args));
  Map run{{"id", Application::handle(AnyId(place.world))}, {"program", place.placed->name}};
  for (const char* each :
       {"unbound", "values", "lines", "files", "sample_time", "most_time", "duration", "physics"})
    if (has(args, each)) run.set(each, *args.find(each));
  return ctx.dispatch("world.run_task", run);
}

}  // namespace

Result<task::TaskRun> task_run(CommandContext& ctx, const Map& args) {
  task::TaskRun run;
  run.world = typed<model::World>(args);
  const auto each = [](const Value& given) {
    const List* list = given.as_list();
    return list ? *list : List{given};
  };
  if (has(args, "task"))
    for (const Value& one : each(*args.find("task"))) {
      RMP_TRY_ASSIGN(const std::size_t at, find_task(ctx, run.world, one, "task"));
      run.tasks.push_back(ctx.snapshot().get(run.world)->tasks[at].name);
    }
  std::vector<ProgramPlace> programs = programs_of(ctx.snapshot(), run.world);
  if (has(args, "program")) {
    std::vector<ProgramPlace> wanted;
    for (const Value& one : each(*args.find("program"))) {
      RMP_TRY_ASSIGN(const std::size_t at, find_program(ctx, run.world, one, "program"));
      if (std::any_of(wanted.begin(), wanted.end(), [&](const auto& w) { return w.at == at; }))
        return error(ErrorCode::invalid_argument,
                     "program " + text::quote(programs[at].placed->name) + " is given twice",
                     "Name each once.", "program");
      wanted.push_back(programs[at]);
    }
    programs = std::move(wanted);
  } else if (has(args, "task")) {
    programs.clear();
  }
  run.has_tasks = has(args, "task") || !has(args, "program");
  RMP_TRY_ASSIGN(const auto values, read_presets(args.find("values"), "values"));
  if (!values.empty() && programs.size() != 1)
    return error(ErrorCode::invalid_argument,
                 "values are for one program, but " + std::to_string(programs.size()) + " run",
                 "Name the one with program = ...", "values");
  std::vector<std::string> names;
  for (const ProgramPlace& p : programs) names.push_back(p.placed->name);
  const auto files = program_folder(args);
  RMP_TRY_ASSIGN(const auto lines, read_lines(args.find("lines"), names, "lines"));
  for (const ProgramPlace& p : programs) {
    task::ProgramInWorld one;
    one.lines = lines[run.programs.size()];
    one.files = files;
    RMP_TRY_ASSIGN(one.code, compile_program(ctx, p.placed->program, &p));
    one.placement = *p.placed;
    one.frees_unbound = text_of(args, "unbound") == "free";
    one.values = values;
    run.programs.push_back(std::move(one));
  }
  run.sample_time = real(args, "sample_time");
  run.most_time = real(args, "most_time");
  if (has(args, "duration")) run.duration = real(args, "duration");
  RMP_TRY_ASSIGN(run.physics, task_physics(ctx, args));
  return run;
}

RMP_COMMANDS(program_run_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec world =
                      optional("world", "ref:world", "", "The world, if several have the program."),
                  there = optional("name_there", "string", "",
                                   "Its name there, if the world has it several times.");
  all.push_back(
      {.name = "program.run",
       .classic = "",
       .summary = "Runs a program alone in its world, and records it.",
       .details = "A program that is in no world is placed in a new one that contains only the "
                  "given robot. Recording and errors are those of world.run_task.",
       .example = with_arm("local rest = program.create{name = \"rest\", source = [[\n"
                           "PROGRAM rest;\n"
                           "BEGIN\n"
                           "  WAIT 0.5 SEC;\n"
                           "  WRITELN('done');\n"
                           "ENDPROGRAM;\n"
                           "]]}\nlocal r = rest:run{robot = arm}\n"
                           "assert(r:notes()[1] == \"t = 0.5 s: rest: done\")"),
       .params = {self("program"), world, there,
                  optional("robot", "ref:robot", "", "For a program that is in no world."),
                  choice(
                      "unbound", {"error", "free"},
                      "Whether signals without a binding are an error or belong to the program."),
                  values_field(), lines_field(), files_field(),
                  above_zero(defaulted("sample_time", "real", "s", 0.02, "Time between rows.")),
                  above_zero(defaulted("most_time", "real", "s", 3600.0,
                                       "Limit: a run that takes longer is an error.")),
                  above_zero(optional("duration", "real", "s", "The run ends at this time.")),
                  task_physics_field()},
       .returns = {"handle", "", "The recording.", {}},
       .effect = Effect::simulates | Effect::edits,
       .sometimes = Effect::files_read | Effect::files_write,
       .run = run_program});
  return all;
}

}  // namespace robomosp::ioci
