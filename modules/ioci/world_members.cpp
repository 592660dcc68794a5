// SPDX-License-Identifier: Apache-2.0
#include "ioci/world_members.h"

namespace robomosp::ioci {

using model::World;

std::set<std::string> member_names(const World& w) {
  std::set<std::string> out;
  const auto add = [&out](const auto& list) {
    for (const auto& m : list) out.insert(m.name);
  };
  add(w.objects);
  add(w.robots);
  add(w.trajectories);
  add(w.frames);
  add(w.lights);
  add(w.tasks);
  return out;
}

Result<std::string> member_name(const World& w, const Map& args, const std::string& wanted) {
  const auto taken = member_names(w);
  if (has(args, "name")) {
    const std::string name = text_of(args, "name");
    if (name.empty())
      return error(ErrorCode::invalid_argument, "the name is empty",
                   "Give a name or leave it out.");
    if (taken.contains(name))
      return error(ErrorCode::conflict, "there is already a member named " + text::quote(name),
                   "Names are unique within a world.");
    return name;
  }
  if (!taken.contains(wanted)) return wanted;
  for (int i = 2;; ++i)
    if (std::string name = wanted + "_" + std::to_string(i); !taken.contains(name)) return name;
}

Error no_member(const World& w, const std::string& name) {
  const auto all = member_names(w);
  return unknown_name("member", name, {all.begin(), all.end()});
}

Result<model::Placement> given_placement(const CommandContext& ctx, std::string_view path) {
  Map given;
  for (const ParamSpec& p : placement_fields(""))
    if (const Value* v = ctx.given(p.name)) given.set(p.name, *v);
  return read_placement_fields(given, path);
}

model::Placement target_of(const World& w) {
  for (const auto& f : w.frames)
    if (f.name == kTarget) return f.placement;
  return {};
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
