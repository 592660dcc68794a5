// SPDX-License-Identifier: Apache-2.0
// Members of worlds: names, placements and changes that the commands of worlds share (layer:
// application, ioci only).
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "ioci/commands.h"

namespace robomosp::ioci {

/// Names of all objects, robots, trajectories, frames, lights and tasks.
[[nodiscard]] std::set<std::string> member_names(const model::World& w);
/// The given argument `name`, or one made of `wanted`; an error when the given one is taken.
[[nodiscard]] Result<std::string> member_name(const model::World& w, const Map& args,
                                              const std::string& wanted);
/// "there is no member ..." with near names.
[[nodiscard]] Error no_member(const model::World& w, const std::string& name);
/// The placement given by the fields of placement_fields(), as it was written.
[[nodiscard]] Result<model::Placement> given_placement(const CommandContext& ctx,
                                                       std::string_view path);

/// A member of a list by its name, or by the record it places when only one places it.
template <class Placed>
Result<std::size_t> find_member(const CommandContext& ctx, const std::vector<Placed>& list,
                                const Value& given, AnyId (*what)(const Placed&),
                                std::string_view kind, std::string_view path) {
  std::vector<std::string> known;
  if (const std::string* name = given.as_string())
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].name == *name) return i;
      known.push_back(list[i].name);
    }
  AnyId record;
  if (const Handle* h = given.as_handle()) {
    RMP_TRY_ASSIGN(record, Application::record_id(ctx.snapshot(), *h));
  } else if (const std::string* name = given.as_string()) {
    if (const auto k = kind_from(kind))
      if (const auto id = ctx.snapshot().find(*k, *name)) record = *id;
  }
  std::optional<std::size_t> found;
  for (std::size_t i = 0; record && i < list.size(); ++i)
    if (what(list[i]) == record) {
      if (found)
        return error(ErrorCode::conflict,
                     ctx.snapshot().describe(record) + " is placed more than once",
                     "Give the member's name.", std::string(path));
      found = i;
    }
  if (found) return *found;
  Error e = unknown_name(kind,
                         given.as_string()
                             ? *given.as_string()
                             : ctx.app.name_of(given.as_handle() ? *given.as_handle() : Handle{})
                                   .value_or(given.text()),
                         known);
  e.message += " in the world";
  if (known.empty() && e.hint.empty())
    e.hint = "It has none; add one with world.add_" + std::string(kind) + ".";
  return std::move(e).in(path);
}

inline AnyId robot_of(const model::PlacedRobot& r) { return r.robot; }
inline AnyId trajectory_of(const model::PlacedTrajectory& t) { return t.trajectory; }

/// The frame "target" of a world; while there is none, its origin.
inline constexpr std::string_view kTarget = "target";
[[nodiscard]] model::Placement target_of(const model::World& w);

/// Lua that makes a world `cell` with a six-joint arm `arm`, for examples; and one where it stands
/// ready at the start of the trajectory "stroke", a line of 50 mm.
[[nodiscard]] std::string example_cell(const std::string& rest);
[[nodiscard]] std::string example_run(const std::string& rest);

/// Changes the world `id`; what goes wrong names it.
template <class Fn>
Result<Value> change_world(CommandContext& ctx, const Map& args, Fn&& fn) {
  const AnyId id = ref(args, "id");
  auto done = change<model::World>(ctx, id, fn);
  if (!done.ok()) return std::move(done).error().in(name_in(ctx, id));
  return Value();
}

}  // namespace robomosp::ioci
