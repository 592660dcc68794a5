// SPDX-License-Identifier: Apache-2.0
// Commands that make and change tasks.
#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/task/steps.h"

namespace robomosp::ioci {
namespace {

using model::Task;
using model::TaskStep;

Result<std::vector<TaskStep>> read_list(const CommandContext& ctx, const List& list,
                                        std::int32_t parent, std::size_t at) {
  std::vector<TaskStep> out;
  for (std::size_t i = 0; i < list.size(); ++i) {
    RMP_TRY_ASSIGN(auto steps, read_steps(ctx, list[i], "steps[" + std::to_string(i + 1) + "]"));
    const auto offset = static_cast<std::int32_t>(at + out.size());
    for (TaskStep& s : steps) s.parent = s.parent < 0 ? parent : s.parent + offset;
    std::move(steps.begin(), steps.end(), std::back_inserter(out));
  }
  return out;
}

Result<Value> create(CommandContext& ctx, const Map& args) {
  Task t;
  t.description = text_of(args, "description");
  RMP_TRY_ASSIGN(t.parametric,
                 read_parameters(ctx.snapshot(), {}, args.find("parameters"), "parameters"));
  if (has(args, "steps")) {
    RMP_TRY_ASSIGN(t.steps, read_list(ctx, *args.find("steps")->as_list(), -1, 0));
  }
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(text_of(args, "name"), std::move(t)));
  return Value(Application::handle(id));
}

template <class Fn>
Result<Value> change_task(CommandContext& ctx, const Map& args, Fn&& fn) {
  const AnyId id = ref(args, "id");
  auto done = change<Task>(ctx, id, fn);
  if (!done.ok()) return std::move(done).error().in(name_in(ctx, id));
  return Value();
}

Result<Value> set(CommandContext& ctx, const Map& args) {
  return change_task(ctx, args, [&](Task& t) -> Result<void> {
    t.description = text_of(args, "description");
    return {};
  });
}

/// Index of a step given by its number, 1 is the first.
Result<std::size_t> step_at(const Task& t, const Map& args, std::string_view name) {
  const auto i = integer(args, name);
  if (i >= 1 && i <= static_cast<std::int64_t>(t.steps.size()))
    return static_cast<std::size_t>(i - 1);
  return error(ErrorCode::invalid_argument, "there is no step " + std::to_string(i),
               "It has " + std::to_string(t.steps.size()) + ".", std::string(name));
}

/// One behind the last step of the block `i`, or of the step alone.
std::size_t end_of(const Task& t, std::size_t i) {
  std::size_t end = i + 1;
  while (end < t.steps.size() && t.steps[end].parent >= static_cast<std::int32_t>(i)) ++end;
  return end;
}

/// Steps that stood at `from` or behind it stand `by` farther on now.
void shift_parents(std::vector<TaskStep>& steps, std::size_t first, std::size_t from,
                   std::ptrdiff_t by) {
  for (std::size_t i = first; i < steps.size(); ++i)
    if (steps[i].parent >= static_cast<std::int32_t>(from))
      steps[i].parent += static_cast<std::int32_t>(by);
}

void insert(Task& t, std::size_t at, std::vector<TaskStep> steps) {
  shift_parents(t.steps, at, at, static_cast<std::ptrdiff_t>(steps.size()));
  t.steps.insert(t.steps.begin() + static_cast<std::ptrdiff_t>(at),
                 std::make_move_iterator(steps.begin()), std::make_move_iterator(steps.end()));
}

void erase(Task& t, std::size_t begin, std::size_t end) {
  t.steps.erase(t.steps.begin() + static_cast<std::ptrdiff_t>(begin),
                t.steps.begin() + static_cast<std::ptrdiff_t>(end));
  shift_parents(t.steps, begin, end, -static_cast<std::ptrdiff_t>(end - begin));
}

Result<Value> add_step(CommandContext& ctx, const Map& args) {
  if (has(args, "before") && has(args, "parent"))
    return error(ErrorCode::invalid_argument,
                 "a step is inserted either before a step or at the end of a block",
                 "Give before or parent, not both.");
  std::size_t at = 0;
  RMP_TRY_ASSIGN(const Value none, change_task(ctx, args, [&](Task& t) -> Result<void> {
                   at = t.steps.size();
                   std::int32_t parent = -1;
                   if (has(args, "before")) {
                     RMP_TRY_ASSIGN(at, step_at(t, args, "before"));
                     parent = t.steps[at].parent;
                   } else if (has(args, "parent") && integer(args, "parent") != 0) {
                     RMP_TRY_ASSIGN(const std::size_t block, step_at(t, args, "parent"));
                     if (!is_block(t.steps[block].kind))
                       return error(ErrorCode::invalid_argument,
                                    "step " + std::to_string(block + 1) + " is " +
                                        text::quote(to_string(t.steps[block].kind)) +
                                        " and contains no steps",
                                    "Blocks are repeat, if and else.", "parent");
                     parent = static_cast<std::int32_t>(block);
                     at = end_of(t, block);
                   }
                   RMP_TRY_ASSIGN(auto steps, read_list(ctx, List{*args.find("step")}, parent, at));
                   insert(t, at, std::move(steps));
                   return {};
                 }));
  static_cast<void>(none);
  return Value(static_cast<std::int64_t>(at + 1));
}

Result<Value> remove_step(CommandContext& ctx, const Map& args) {
  return change_task(ctx, args, [&](Task& t) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t at, step_at(t, args, "index"));
    erase(t, at, end_of(t, at));
    return {};
  });
}

Result<Value> set_step(CommandContext& ctx, const Map& args) {
  return change_task(ctx, args, [&](Task& t) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t at, step_at(t, args, "index"));
    const std::int32_t parent = t.steps[at].parent;
    RMP_TRY_ASSIGN(auto steps, read_list(ctx, List{*args.find("step")}, parent, at));
    if (steps.size() == 1 && is_block(steps[0].kind) && is_block(t.steps[at].kind)) {
      t.steps[at] = std::move(steps[0]);  // a block keeps what is in it
      return {};
    }
    erase(t, at, end_of(t, at));
    insert(t, at, std::move(steps));
    return {};
  });
}

Result<Value> move_step(CommandContext& ctx, const Map& args) {
  return change_task(ctx, args, [&](Task& t) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t from, step_at(t, args, "index"));
    const bool has_block = has(args, "parent"), has_next = has(args, "before");
    if (has_block && has_next)
      return error(ErrorCode::invalid_argument, "both before and parent are given",
                   "Give the step that follows, or the block that it goes to the end of.",
                   "parent");
    // Without both it becomes the last step.
    std::size_t to = t.steps.size();
    std::int32_t parent = TaskStep().parent;
    if (has_next) {
      RMP_TRY_ASSIGN(to, step_at(t, args, "before"));
      parent = t.steps[to].parent;
    }
    if (has_block) {
      RMP_TRY_ASSIGN(const std::size_t block, step_at(t, args, "parent"));
      if (!is_block(t.steps[block].kind))
        return error(ErrorCode::invalid_argument,
                     "step " + std::to_string(block + 1) + " is " +
                         text::quote(to_string(t.steps[block].kind)) + " and contains no steps",
                     "Blocks are repeat, if and else.", "parent");
      parent = static_cast<std::int32_t>(block);
      to = end_of(t, block);
    }
    const std::size_t end = end_of(t, from);
    const bool is_in_itself = has_block && parent >= static_cast<std::int32_t>(from) &&
                              parent < static_cast<std::int32_t>(end);
    if (is_in_itself)
      return error(ErrorCode::invalid_argument,
                   "step " + std::to_string(from + 1) + " cannot be moved into itself", {},
                   "parent");
    if (has_next && to >= from && to < end)
      return error(ErrorCode::invalid_argument,
                   "step " + std::to_string(from + 1) + " cannot be before step " +
                       std::to_string(to + 1) + ", which is itself or within it",
                   {}, "before");
    std::vector<TaskStep> moved(t.steps.begin() + static_cast<std::ptrdiff_t>(from),
                                t.steps.begin() + static_cast<std::ptrdiff_t>(end));
    const std::size_t count = end - from;
    const std::size_t at = to > from ? to - count : to;
    // The new place of the block that the steps come into.
    std::int32_t into = parent;
    if (parent >= static_cast<std::int32_t>(end)) into -= static_cast<std::int32_t>(count);
    erase(t, from, end);
    for (std::size_t i = 0; i < moved.size(); ++i)
      moved[i].parent = i == 0 ? into
                               : moved[i].parent + static_cast<std::int32_t>(at) -
                                     static_cast<std::int32_t>(from);
    insert(t, at, std::move(moved));
    return {};
  });
}

Result<Value> steps(CommandContext& ctx, const Map& args) {
  return steps_value(ctx.snapshot(), content<Task>(ctx, args));
}

std::string with_task(const char* rest) {
  return std::string(
             "local shift = task.create{name = \"shift\", steps = {\n  {step = \"move\", robot = "
             "\"arm\", pose = \"home\"},\n  {step = \"repeat\", count = 2, steps = {{step = "
             "\"wait\", time = \"500 ms\"}}}}}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(task_commands) {
  std::vector<CommandSpec> all;
  const std::string steps_help = step_doc();
  const ParamSpec index = needed("index", "int", "", "Number of the step, 1 is the first.");
  const ParamSpec step = needed("step", "map", "", "The step.");
  const ParamSpec description = optional("description", "string", "", "Purpose of the program.");
  all.push_back({.name = "task.create",
                 .classic = "",
                 .summary = "Makes a task of steps.",
                 .details = steps_help,
                 .example = with_task("assert(#shift:steps() == 3)"),
                 .params = {needed("name", "string", "", "Name, unique among tasks."),
                            optional("steps", "list", "", "Its steps, in order."), description,
                            parameters_field()},
                 .returns = {"handle", "", "", {}},
                 .effect = Effect::edits,
                 .run = create});
  ParamSpec must = description;
  must.required = true;
  all.push_back({.name = "task.set",
                 .classic = "",
                 .summary = "Changes the description of a task.",
                 .details = "",
                 .example = with_task("shift:set{description = \"to and fro\"}\n"
                                      "assert(shift:describe().description == \"to and fro\")"),
                 .params = {self("task"), must},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set});
  all.push_back(
      {.name = "task.add_step",
       .classic = "",
       .summary = "Adds a step to a task.",
       .details = std::string("It is added at the end of the task, at the end of the block "
                              "`parent`, or before the step `before`. ") +
                  steps_help,
       .example = with_task("local at = shift:add_step{step = {step = \"message\", text = "
                            "\"once more\"}, parent = 2}\nassert(at == 4 and "
                            "shift:steps()[4].parent == 2)"),
       .params = {self("task"), step,
                  optional("parent", "int", "", "Number of a block; 0 is the task itself."),
                  optional("before", "int", "", "Number of the step that will follow it.")},
       .returns = {"int", "", "Its number.", {}},
       .effect = Effect::edits,
       .run = add_step});
  all.push_back({.name = "task.set_step",
                 .classic = "",
                 .summary = "Replaces a step by another one.",
                 .details = "A block without new steps keeps those of the old one.",
                 .example = with_task("shift:set_step(2, {step = \"repeat\", count = 5})\n"
                                      "assert(shift:steps()[2].count == 5 and #shift:steps() == "
                                      "3)"),
                 .params = {self("task"), index, step},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = set_step});
  all.push_back(
      {.name = "task.move_step",
       .classic = "",
       .summary = "Moves a step, with the steps in it, before another.",
       .details = "Or to the end of a block, or of the task if neither is given.",
       .example = with_task("shift:move_step{index = 2, before = 1}\n"
                            "assert(shift:steps()[1].step == \"repeat\" and "
                            "shift:steps()[2].parent == 1)\n"
                            "shift:move_step{index = 2}\n"
                            "assert(shift:steps()[3].step == \"wait\" and "
                            "shift:steps()[3].parent == 0)"),
       .params = {self("task"), index,
                  optional("before", "int", "", "Number of the step that will follow it."),
                  optional("parent", "int", "",
                           "Number of a block; the step becomes the last in it.")},
       .returns = {},
       .effect = Effect::edits,
       .run = move_step});
  all.push_back({.name = "task.remove_step",
                 .classic = "",
                 .summary = "Removes a step with the steps in it.",
                 .details = "",
                 .example = with_task("shift:remove_step(2)\nassert(#shift:steps() == 1)"),
                 .params = {self("task"), index},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = remove_step});
  all.push_back(
      {.name = "task.steps",
       .classic = "",
       .summary = "Lists the steps of a task.",
       .details = "The steps of a block follow it; parent is its number, 0 the task.",
       .example = with_task("assert(shift:steps()[3].time == 0.5)"),
       .params = {self("task")},
       .returns = {"list", "", "One table per step: number, parent, step and its fields.", {}},
       .effect = Effect::reads,
       .run = steps});
  return all;
}

}  // namespace robomosp::ioci
