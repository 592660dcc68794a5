// SPDX-License-Identifier: Apache-2.0
// Members of worlds: names, placements and changes that the commands of worlds share (layer:
// application, ioci only).
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// Names of all objects, robots, trajectories, frames, lights, tasks and programs.
[[nodiscard]] std::set<std::string> member_names(const model::World& w);
/// The argument `name` if given, else a name made from `wanted`; an error if the given one is
/// taken.
[[nodiscard]] Result<std::string> member_name(const model::World& w, const Map& args,
                                              const std::string& wanted);
/// `wanted`, or the first free one of `wanted_2`, `wanted_3`, ...
[[nodiscard]] std::string free_member_name(const model::World& w, const std::string& wanted);
/// "there is no member ..." with near names.
[[nodiscard]] Error no_member(const model::World& w, const std::string& name);

/// Index of a robot in the list of a world: by its name there, in constant time, or by its record
/// if that is placed only once. Errors begin with `path`.
[[nodiscard]] Result<std::size_t> find_robot(const CommandContext&, WorldId, const Value& given,
                                             std::string_view path);
/// The same of a trajectory.
[[nodiscard]] Result<std::size_t> find_trajectory(const CommandContext&, WorldId,
                                                  const Value& given, std::string_view path);
/// The same of a task.
[[nodiscard]] Result<std::size_t> find_task(const CommandContext&, WorldId, const Value& given,
                                            std::string_view path);
/// The same of a program.
[[nodiscard]] Result<std::size_t> find_program(const CommandContext&, WorldId, const Value& given,
                                               std::string_view path);

/// Lua that makes a world `cell` with a six-joint arm `arm`, for examples; and one where it
/// is ready at the start of the trajectory "stroke", a line of 50 mm.
[[nodiscard]] std::string example_cell(const std::string& rest);
[[nodiscard]] std::string example_run(const std::string& rest);

/// The arguments of the command that adds to a list of the world ("robots"): the fields of its
/// elements, with the field `leader` in front and required. `frame`: that of the placement.
[[nodiscard]] Schema member_params(std::string_view list, std::string_view leader,
                                   const std::string& frame = "the world");

/// Changes the world `id`; errors name it.
template <class Fn>
Result<Value> change_world(CommandContext& ctx, const Map& args, Fn&& fn) {
  const AnyId id = ref(args, "id");
  auto done = change<model::World>(ctx, id, fn);
  if (!done.ok()) return std::move(done).error().in(name_in(ctx, id));
  return Value();
}

/// The arguments `robot` and `trajectory` of commands about one in a world.
[[nodiscard]] ParamSpec placed_robot_field();
[[nodiscard]] ParamSpec placed_trajectory_field();

}  // namespace robomosp::ioci
