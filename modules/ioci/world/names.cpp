// SPDX-License-Identifier: Apache-2.0
// Which world, robot or target is meant: the active world, robots by description, the name of a
// world's target.
#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/robot/shown_robot.h"
#include "ioci/world/members.h"

namespace robomosp::ioci {
namespace {

using model::World;

Result<Value> active(CommandContext& ctx, const Map&) {
  const auto all = ctx.snapshot().list(Kind::world);
  if (all.empty())
    return error(ErrorCode::not_found, "there is no world",
                 "Create one with world.create, or load one with world.load.");
  return Value(Application::handle(all.back()));
}

Result<Value> robot_by_description(CommandContext& ctx, const Map& args) {
  const World& w = content<World>(ctx, args);
  const std::string wanted = text_of(args, "text");
  std::vector<std::string> same, within, known;
  for (const model::PlacedRobot& m : w.robots) {
    const std::string& description = ctx.snapshot().get(m.robot)->description;
    known.push_back(description.empty() ? m.name : description);
    if (description == wanted || m.name == wanted) same.push_back(m.name);
    else if (!wanted.empty() && description.find(wanted) != std::string::npos)
      within.push_back(m.name);
  }
  const auto& found = same.empty() ? within : same;
  if (found.size() == 1) return Value(found.front());
  const std::string where = name_in(ctx, ref(args, "id"));
  if (found.empty()) return unknown_name("robot of description", wanted, known).in(where);
  return error(ErrorCode::conflict,
               text::enumerate(found) + " all have the description " + text::quote(wanted),
               "Give more of the description, or use the names.", where);
}

Result<Value> target_transform(CommandContext& ctx, const Map& args) {
  return Value(ctx.snapshot().find(ref(args, "id"))->name + "." + std::string(kTarget));
}

}  // namespace

RMP_COMMANDS(world_name_commands) {
  std::vector<CommandSpec> all;
  all.push_back({.name = "world.active",
                 .classic = "Worlds GetActiveWorld",
                 .summary = "Returns the world that was created or loaded last and still exists.",
                 .details = "",
                 .example = "world.create{name = \"cell\"}\nlocal moon = world.create{name = "
                            "\"moon\"}\nassert(world.active().name == \"moon\")\n"
                            "moon:remove()\nassert(world.active().name == \"cell\")",
                 .params = {},
                 .returns = {"handle", "", "", {}},
                 .effect = Effect::reads,
                 .run = active});
  all.push_back(
      {.name = "world.robot_by_description",
       .classic = "World GetPRobotIdDesc",
       .summary = "Returns the name of the robot of a world that has a description.",
       .details =
           "A robot has priority if its description or its name in the world equals the text; "
           "otherwise the only one with the text in its description is returned.",
       .example = example_cell("arm:set{description = \"six joints, 5 kg\"}\n"
                               "assert(cell:robot_by_description(\"six joints\") == \"arm\")"),
       .params = {self("world"), needed("text", "string", "", "The description or a part of it.")},
       .returns = {"string", "", "Name of the member.", {}},
       .effect = Effect::reads,
       .run = robot_by_description});
  all.push_back(
      {.name = "world.target_transform",
       .classic = "World GetTargetId",
       .summary = "Returns the name of a world's target in the transform commands.",
       .details = "The target is the frame \"target\" of the world, or the world's origin if there "
                  "is no such frame; setting an element of it creates the frame.",
       .example = example_cell("transform.set(cell:target_transform(), \"P1\", 0.5)\n"
                               "assert(cell:frames()[1].name == \"target\")"),
       .params = {self("world")},
       .returns = {"string", "", "A name such as cell.target.", {}},
       .effect = Effect::reads,
       .run = target_transform});
  return all;
}

}  // namespace robomosp::ioci
