// SPDX-License-Identifier: Apache-2.0
// Tools of a robot and what it carries.
#include <algorithm>

#include "evaluation/attached_tools.h"
#include "ioci/core/placement_argument.h"
#include "ioci/core/record_params.h"
#include "ioci/robot/robots.h"
#include "model/placement.h"

namespace robomosp::ioci {
namespace {

using model::Robot;
using model::RobotTool;

Result<RobotTool*> find_tool(Robot& r, const std::string& name) {
  std::vector<std::string> known{"tool"};
  for (RobotTool& t : r.tools) {
    if (t.name == name) return &t;
    known.push_back(t.name);
  }
  return unknown_name("tool", name, known);
}

bool is_main(const Map& args) { return !has(args, "tool") || text_of(args, "tool") == "tool"; }

/// The robot with attached tools as further tools.
Result<Robot> equipped(const CommandContext& ctx, const Map& args) {
  return evaluation::with_tool_frames(ctx.snapshot(), ctx.snapshot().find(ref(args, "id"))->name,
                                      content<Robot>(ctx, args));
}

Result<Value> tool(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(Robot r, equipped(ctx, args));
  model::Placement at = r.tool;
  if (!is_main(args)) {
    RMP_TRY_ASSIGN(const RobotTool* t, find_tool(r, text_of(args, "tool")));
    at = t->placement;
  }
  Map out = pose_map(model::pose(at));
  out.set("placement", placement_value(at));
  return Value(std::move(out));
}

Result<Value> set_tool(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto placement, placement_given(ctx, "tool"));
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    if (is_main(args)) {
      if (has(args, "link"))
        return error(ErrorCode::invalid_argument, "the first tool is on the last link",
                     "Add a tool to another link with robot.add_tool.");
      if (!r.tcp.empty())
        return error(ErrorCode::conflict,
                     "its tool is the centre point " + text::quote(r.tcp) + " of an attached tool",
                     "Move it with object.set, or remove the tool with robot.detach.");
      r.tool = placement;
      return {};
    }
    for (model::AttachedTool& t : r.attached) {
      if (t.name != text_of(args, "tool")) continue;
      if (has_placement(ctx)) t.placement = placement;
      if (has(args, "link")) {
        RMP_TRY_ASSIGN(t.link, read_link(r, *args.find("link"), true, "link"));
      }
      return {};
    }
    RMP_TRY_ASSIGN(RobotTool * t, find_tool(r, text_of(args, "tool")));
    RMP_TRY(set_fields(*t, args));
    if (has_placement(ctx)) t->placement = placement;
    if (has(args, "link")) {
      RMP_TRY_ASSIGN(t->link, read_link(r, *args.find("link"), true, "link"));
    }
    return {};
  });
}

Result<Value> add_tool(CommandContext& ctx, const Map& args) {
  RobotTool t;
  RMP_TRY(set_fields(t, args));
  RMP_TRY_ASSIGN(t.placement, placement_given(ctx, "tool"));
  RMP_TRY(read_mass(args, t.payload, ""));
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY_ASSIGN(t.link, read_link(r, *args.find("link"), true, "link"));
    r.tools.push_back(t);
    return {};
  });
}

Result<Value> remove_tool(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    for (const model::AttachedTool& t : r.attached)
      if (t.name == text_of(args, "name"))
        return error(ErrorCode::invalid_argument, text::quote(t.name) + " is an attached tool",
                     "Remove it with robot.detach.");
    RMP_TRY_ASSIGN(const RobotTool* t, find_tool(r, text_of(args, "name")));
    r.tools.erase(r.tools.begin() + (t - r.tools.data()));
    return {};
  });
}

Result<Value> set_payload(CommandContext& ctx, const Map& args) {
  const bool has_mass = has(args, "mass") && real(args, "mass") > 0;
  for (const char* name : {"com", "inertia"})
    if (has(args, name) && !has_mass)
      return error(ErrorCode::invalid_argument,
                   std::string("the payload has no mass, so its ") + name + " has no effect",
                   "Give its mass, or give nothing to remove the payload.", name);
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    std::optional<MassProperties>* payload = &r.payload;
    if (!is_main(args)) {
      RMP_TRY_ASSIGN(RobotTool * t, find_tool(r, text_of(args, "tool")));
      payload = &t->payload;
    }
    payload->reset();
    RMP_TRY(read_mass(args, *payload, ""));
    if (*payload && (*payload)->mass == 0) payload->reset();
    return {};
  });
}

Result<Value> tools(CommandContext& ctx, const Map& args) {
  const Robot& plain = content<Robot>(ctx, args);
  RMP_TRY_ASSIGN(const Robot r, equipped(ctx, args));
  List out;
  const auto put = [&](const std::string& name, std::int32_t link, const model::Placement& at,
                       const std::optional<MassProperties>& payload) -> Result<void> {
    Map row{{"name", name},
            {"link", link < 0 ? std::string("base") : r.links[static_cast<std::size_t>(link)].name},
            {"placement", placement_value(at)}};
    if (payload) row.set("payload", mass_value(*payload));
    if (name == "tool" && !plain.tcp.empty()) row.set("tcp", plain.tcp);
    for (const model::AttachedTool& t : plain.attached) {
      if (t.name != name) continue;
      row.set("what", ref_value(ctx.snapshot(), t.what));
      RMP_TRY_ASSIGN(const auto mass, ctx.app.derived.mass(ctx.snapshot(), t.what, ctx.progress));
      if (mass.mass.mass > 0) row.set("payload", mass_value(mass.mass));
    }
    out.emplace_back(std::move(row));
    return {};
  };
  RMP_TRY(put("tool", static_cast<std::int32_t>(r.links.size()) - 1, r.tool, r.payload));
  for (const RobotTool& t : r.tools) RMP_TRY(put(t.name, t.link, t.placement, t.payload));
  return Value(std::move(out));
}

}  // namespace

RMP_COMMANDS(robot_tool_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec which = optional(
      "tool", "string", "", "Name of an additional tool; by default the one on the last link.");
  all.push_back({.name = "robot.tool",
                 .classic = "PRobot mGetToolHMT",
                 .summary = "Returns a tool's frame in the frame of its link.",
                 .details = "",
                 .example = with_arm("assert(arm:tool().pose[4][4] == 1)"),
                 .params = {self("robot"), which},
                 .returns = {"map",
                             "",
                             "",
                             {field("pose", "pose", "", "4x4 homogeneous matrix."),
                              field("position", "vec3", "m", "Position."),
                              field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                              field("quaternion", "real[]", "", "w, x, y, z."),
                              field("placement", "map", "", "The placement as it was written.")}},
                 .effect = Effect::reads,
                 .run = tool});
  // The payload is given by mass, com and inertia; robot.set_payload changes it.
  Schema add_params =
      led_by({"name", "link"}, without(record_params("robot", "tools", "its link"), {"payload"}));
  Schema tool_params = without(add_params, {"name", "link"});
  tool_params.insert(tool_params.begin(), self("robot"));
  tool_params.push_back(which);
  ParamSpec link = param_named(add_params, "link");
  link.doc = "Another link for an additional tool.";
  tool_params.push_back(std::move(link));
  param_named(add_params, "name").required = true;
  param_named(add_params, "link").required = true;
  add_params.insert(add_params.begin(), self("robot"));
  for (ParamSpec& p : mass_fields("Mass of the payload.", "the tool's frame"))
    add_params.push_back(std::move(p));
  all.push_back(
      {.name = "robot.set_tool",
       .classic = "",
       .summary = "Sets a tool's frame in the frame of its link.",
       .details = "",
       .example = with_arm(
           "arm:set_tool{position = {0, 0, \"150 mm\"}}\nassert(arm:tool().position[3] == 0.15)"),
       .params = std::move(tool_params),
       .returns = {},
       .effect = Effect::edits,
       .run = set_tool});
  all.push_back({.name = "robot.add_tool",
                 .classic = "",
                 .summary = "Adds a tool: another tip for kinematics.",
                 .details = "",
                 .example = with_arm("arm:add_tool{name = \"camera\", link = 3, position = {0, 0, "
                                     "0.1}, mass = 0.2}\nlocal t = arm:fk{q = \"ready\", tip = "
                                     "\"camera\"}\nassert(#arm:tools() == 2)"),
                 .params = std::move(add_params),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = add_tool});
  all.push_back({.name = "robot.remove_tool",
                 .classic = "",
                 .summary = "Removes an additional tool.",
                 .details = "",
                 .example = with_arm("arm:add_tool{name = \"camera\", link = 3}\n"
                                     "arm:remove_tool(\"camera\")\nassert(#arm:tools() == 1)"),
                 .params = {self("robot"), needed("name", "string", "", "Name of the tool.")},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = remove_tool});
  all.push_back(
      {.name = "robot.tools",
       .classic = "",
       .summary = "Lists the tools with their links and payloads.",
       .details = "The first is the one on the last link. Attached tools follow, each with its "
                  "centre points after it.",
       .example = with_arm("assert(arm:tools()[1].link == \"link6\")"),
       .params = {self("robot")},
       .returns = {"list",
                   "",
                   "",
                   {field("name", "string", "", "Name; the first is called tool."),
                    field("link", "string", "", "The link that carries it."),
                    field("placement", "map", "",
                          "Placement in the link's frame, as it was written."),
                    field("payload", "map", "", "Mass, com and inertia in the tool's frame."),
                    field("tcp", "string", "",
                          "Of the first tool: the centre point of an attached tool that it uses."),
                    field("what", "any", "", "Object or solid of an attached tool.")}},
       .effect = Effect::reads,
       .run = tools});
  Schema payload_params{self("robot"), which};
  for (ParamSpec& p : mass_fields("Mass; 0 or no value removes the payload.", "the tool's frame"))
    payload_params.push_back(std::move(p));
  all.push_back(
      {.name = "robot.set_payload",
       .classic = "",
       .summary = "Sets the payload of a tool; it adds to the mass of the tool's link.",
       .details = "",
       .example = with_arm("local before = arm:mass().mass\narm:set_payload{mass = 2, com = "
                           "{0, 0, 0.05}}\nassert(math.abs(arm:mass().mass - before - 2) < "
                           "1e-12)"),
       .params = std::move(payload_params),
       .returns = {},
       .effect = Effect::edits,
       .run = set_payload});
  return all;
}

}  // namespace robomosp::ioci
