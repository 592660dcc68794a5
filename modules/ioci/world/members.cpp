// SPDX-License-Identifier: Apache-2.0
#include "ioci/world/members.h"

#include <algorithm>

#include "document/world_index.h"
#include "ioci/core/record_params.h"

namespace robomosp::ioci {

using model::World;

namespace {

/// A member of a list by its name, or by the record it places when only one places it.
template <class Placed>
Result<std::size_t> find_member(const CommandContext& ctx, WorldId world, document::MemberList kept,
                                const std::vector<Placed>& list, const Value& given,
                                AnyId (*what)(const Placed&), std::string_view kind,
                                std::string_view path) {
  if (const std::string* name = given.as_string())
    if (const auto at = document::world_index(ctx.snapshot(), world)->find(kept, *name)) return *at;
  AnyId record;
  if (const Handle* h = given.as_handle()) {
    RMP_TRY_ASSIGN(record, Application::record_id(ctx.snapshot(), *h));
  } else if (given.as_string()) {
    if (const auto named = ctx.app.resolve(ctx.snapshot(), kind, given); named.ok()) {
      RMP_TRY_ASSIGN(record, Application::record_id(ctx.snapshot(), *named));
    }
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
  std::vector<std::string> known;
  if (given.as_string())
    for (const Placed& p : list) known.push_back(p.name);
  Error e = unknown_name(
      kind,
      given.as_string()
          ? *given.as_string()
          : ctx.name_of(given.as_handle() ? *given.as_handle() : Handle{}).value_or(given.text()),
      known);
  e.message += " in the world";
  if (known.empty() && e.hint.empty())
    e.hint = "It has none; add one with world.add_" + std::string(kind) + ".";
  return std::move(e).in(path);
}

AnyId robot_of(const model::PlacedRobot& r) { return r.robot; }
AnyId trajectory_of(const model::PlacedTrajectory& t) { return t.trajectory; }
AnyId task_of(const model::PlacedTask& t) { return t.task; }
AnyId program_of(const model::PlacedProgram& p) { return p.program; }

/// Whether `is_it` of one of the lists of members, whose names are each other's.
template <class Fn>
bool any_list(const World& w, Fn&& is_it) {
  return is_it(w.objects) || is_it(w.robots) || is_it(w.trajectories) || is_it(w.frames) ||
         is_it(w.lights) || is_it(w.tasks) || is_it(w.programs);
}
template <class Fn>
void each_list(const World& w, Fn&& see) {
  any_list(w, [&](const auto& list) {
    see(list);
    return false;
  });
}

bool has_member(const World& w, const std::string& name) {
  return any_list(w, [&](const auto& list) {
    // Names of one length in a row differ in their last digits.
    return std::any_of(list.begin(), list.end(), [&](const auto& m) {
      return m.name.size() == name.size() && m.name.back() == name.back() && m.name == name;
    });
  });
}

}  // namespace

Result<std::size_t> find_robot(const CommandContext& ctx, WorldId world, const Value& given,
                               std::string_view path) {
  return find_member(ctx, world, document::MemberList::robots, ctx.snapshot().get(world)->robots,
                     given, robot_of, "robot", path);
}

Result<std::size_t> find_trajectory(const CommandContext& ctx, WorldId world, const Value& given,
                                    std::string_view path) {
  return find_member(ctx, world, document::MemberList::trajectories,
                     ctx.snapshot().get(world)->trajectories, given, trajectory_of, "trajectory",
                     path);
}

Result<std::size_t> find_task(const CommandContext& ctx, WorldId world, const Value& given,
                              std::string_view path) {
  return find_member(ctx, world, document::MemberList::tasks, ctx.snapshot().get(world)->tasks,
                     given, task_of, "task", path);
}

Result<std::size_t> find_program(const CommandContext& ctx, WorldId world, const Value& given,
                                 std::string_view path) {
  return find_member(ctx, world, document::MemberList::programs,
                     ctx.snapshot().get(world)->programs, given, program_of, "program", path);
}

namespace {

/// The number behind `wanted` and an underline, 0 when the name is another.
std::size_t number_behind(std::string_view name, std::string_view wanted) {
  if (name.size() < wanted.size() + 2 || !name.starts_with(wanted) || name[wanted.size()] != '_')
    return 0;
  const std::string_view digits = name.substr(wanted.size() + 1);
  constexpr std::size_t kMostDigits = 9;
  if (digits.size() > kMostDigits || digits.front() == '0') return 0;
  std::size_t n = 0;
  for (const char c : digits) {
    if (c < '0' || c > '9') return 0;
    n = n * 10 + static_cast<std::size_t>(c - '0');
  }
  return n;
}

}  // namespace

std::string free_member_name(const World& w, const std::string& wanted) {
  bool is_taken = false;
  std::size_t count = 0;
  each_list(w, [&](const auto& list) { count += list.size(); });
  std::vector<char> numbers(count + 3);  // one pass: worlds have thousands of members
  each_list(w, [&](const auto& list) {
    for (const auto& m : list) {
      if (m.name == wanted) is_taken = true;
      else if (const std::size_t n = number_behind(m.name, wanted); n && n <= count + 2)
        numbers[n] = 1;
    }
  });
  if (!is_taken) return wanted;
  std::size_t n = 2;
  while (n < numbers.size() && numbers[n]) ++n;
  return wanted + "_" + std::to_string(n);
}

std::set<std::string> member_names(const World& w) {
  std::set<std::string> out;
  each_list(w, [&out](const auto& list) {
    for (const auto& m : list) out.insert(m.name);
  });
  return out;
}

Result<std::string> member_name(const World& w, const Map& args, const std::string& wanted) {
  if (has(args, "name")) {
    const std::string name = text_of(args, "name");
    if (name.empty())
      return error(ErrorCode::invalid_argument, "the name is empty",
                   "Give a name or leave it out.");
    if (has_member(w, name))
      return error(ErrorCode::conflict, "there is already a member named " + text::quote(name),
                   "Names must be unique within a world.");
    return name;
  }
  return free_member_name(w, wanted);
}

Error no_member(const World& w, const std::string& name) {
  const auto all = member_names(w);
  return unknown_name("member", name, {all.begin(), all.end()});
}

Schema member_params(std::string_view list, std::string_view leader, const std::string& frame) {
  Schema s = led_by({leader, "name"}, record_params("world", list, frame));
  param_named(s, leader).required = true;
  param_named(s, "name").doc =
      "Name of the member, unique in the world; by default that of the record.";
  s.insert(s.begin(), self("world"));
  return s;
}

ParamSpec placed_robot_field() {
  return needed("robot", "any", "",
                "Name of the member, or the robot; may be omitted if the world has only one.");
}
ParamSpec placed_trajectory_field() {
  return needed("trajectory", "any", "", "Name of the member, or the trajectory.");
}

std::string example_cell(const std::string& rest) {
  return with_arm("local cell = world.create{name = \"cell\"}\ncell:add_robot{robot = arm}\n") +
         rest;
}

std::string example_run(const std::string& rest) {
  return example_cell(
      "local start = arm:fk{q = \"ready\"}\nlocal p, a = start.position, start.rpy\n"
      "trajectory.create{name = \"stroke\", sample_time = 0.05, segments = {{shape = \"line\", "
      "points = {\n"
      "  {p[1], p[2], p[3], a[1], a[2], a[3]}, {p[1], p[2] + 0.05, p[3], a[1], a[2], a[3]}}}}}\n"
      "cell:add_trajectory{trajectory = \"stroke\"}\narm:set_joints(\"ready\")\n" +
      rest);
}

}  // namespace robomosp::ioci
