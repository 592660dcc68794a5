// SPDX-License-Identifier: Apache-2.0
// Objects that are mounted on robots as tools.
#include <algorithm>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "evaluation/attached_tools.h"
#include "ioci/core/placement_argument.h"
#include "ioci/core/record_params.h"
#include "ioci/robot/robots.h"
#include "model/placement.h"

namespace robomosp::ioci {
namespace {

using model::AttachedTool;
using model::Robot;
using text::quote;

/// The attached tool that the robot's own centre point is on; null = none is.
AttachedTool* leading(Robot& r) {
  for (AttachedTool& t : r.attached)
    if (r.tcp == t.name || r.tcp.starts_with(t.name + ".")) return &t;
  return nullptr;
}

Result<AttachedTool*> find_attached(Robot& r, const std::string& name) {
  std::vector<std::string> known;
  for (AttachedTool& t : r.attached) {
    if (t.name == name) return &t;
    known.push_back(t.name);
  }
  if (known.empty())
    return error(ErrorCode::unknown_name, "nothing is attached to it",
                 "Attach a tool with robot.attach.");
  return unknown_name("attached tool", name, known);
}

/// The one that `name` says, else the one that leads, else the only one.
Result<AttachedTool*> which_attached(Robot& r, const std::string& name, const char* argument) {
  if (!name.empty()) return find_attached(r, name);
  if (AttachedTool* t = leading(r)) return t;
  if (r.attached.size() == 1) return &r.attached.front();
  if (r.attached.empty()) return find_attached(r, name);
  std::vector<std::string> known;
  for (const AttachedTool& t : r.attached) known.push_back(t.name);
  return error(ErrorCode::invalid_argument,
               text::enumerate(known) + " are attached, but none of them is the robot's tool",
               std::string("Name one with ") + argument + ".");
}

/// What `tcp` says: nothing = not given; "" = none.
Result<std::optional<std::string>> wanted_point(const Map& args) {
  const Value* v = args.find("tcp");
  if (!v || v->is_nil()) return std::optional<std::string>{};
  if (const bool* b = v->as_bool(); b && !*b) return std::optional(std::string());
  if (const std::string* s = v->as_string(); s && !s->empty()) return std::optional(*s);
  return error(ErrorCode::invalid_argument, v->text() + " is not a centre point",
               "Give the name of one, such as \"tip\", or false for the robot's tool frame.",
               "tcp");
}

/// Makes a centre point of a tool the robot's tool: the one named, else the first, else the
/// object's own frame where it has none.
Result<void> lead(const CommandContext& ctx, Robot& r, const AttachedTool& t,
                  const std::optional<std::string>& point) {
  if (t.link != static_cast<std::int32_t>(r.links.size()) - 1)
    return error(
        ErrorCode::invalid_argument,
        "tool " + quote(t.name) + " is not on the last link, which carries the robot's tool",
        "Name its centre points as tip instead, such as tip = " + quote(t.name) + ".", "tcp");
  const auto& points = evaluation::tool_centre_points(ctx.snapshot(), t.what);
  if (!point) {
    r.tcp = points.empty() ? t.name : t.name + "." + points.front().name;
    return {};
  }
  std::string name = *point;
  if (name.starts_with(t.name + ".")) name.erase(0, t.name.size() + 1);
  std::vector<std::string> known;
  for (const auto& p : points) {
    if (p.name == name) {
      r.tcp = t.name + "." + name;
      return {};
    }
    known.push_back(p.name);
  }
  if (name == t.name) {
    r.tcp = name;
    return {};
  }
  if (known.empty())
    return error(ErrorCode::unknown_name,
                 name_in(ctx, t.what) + " has no tool centre point " + quote(name),
                 "It has none; Add one with object.add_tcp.", "tcp");
  return unknown_name("tool centre point", name, known).in("tcp");
}

/// A tool without mass is often one whose material was forgotten.
Result<void> tell_mass(CommandContext& ctx, const std::string& robot, const AttachedTool& t) {
  RMP_TRY_ASSIGN(const auto mass, ctx.app.derived.mass(ctx.snapshot(), t.what, ctx.progress));
  if (!(mass.mass.mass > 0))
    ctx.app.messages.post(Severity::warning, "tool_without_mass",
                          robot + ": tool " + quote(t.name) +
                              " has no mass, since its solids have no material. Give them one, or "
                              "the object a measured mass.",
                          "ioci");
  return {};
}

std::string name_for(const CommandContext& ctx, const Map& args, AnyId what) {
  if (has(args, "name")) return text_of(args, "name");
  std::string name = ctx.snapshot().find(what)->name;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

Result<Value> attach(CommandContext& ctx, const Map& args) {
  AttachedTool t;
  RMP_TRY(set_fields(t, args));
  t.what = ref(args, "tool");
  t.name = name_for(ctx, args, t.what);
  RMP_TRY_ASSIGN(const auto point, wanted_point(args));
  RMP_TRY_ASSIGN(t.placement, placement_given(ctx, "placement"));
  RMP_TRY(change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    const auto last = static_cast<std::int32_t>(r.links.size()) - 1;
    t.link = last;
    if (has(args, "link")) {
      RMP_TRY_ASSIGN(t.link, read_link(r, *args.find("link"), true, "link"));
    }
    if (!has_placement(ctx) && t.link == last) t.placement = r.tool;  // where its flange is
    const bool has_points = !evaluation::tool_centre_points(ctx.snapshot(), t.what).empty();
    if (point ? !point->empty() : t.link == last && has_points && !leading(r))
      RMP_TRY(lead(ctx, r, t, point));
    ctx.expressions.keep(r.parametric, "attached." + t.name);
    r.attached.push_back(t);
    return {};
  }));
  RMP_TRY(tell_mass(ctx, name_in(ctx, ref(args, "id")), t));
  return Value(t.name);
}

Result<Value> detach(CommandContext& ctx, const Map& args) {
  return change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY_ASSIGN(const AttachedTool* t, which_attached(r, text_of(args, "tool"), "tool"));
    if (leading(r) == t) r.tcp.clear();
    r.attached.erase(r.attached.begin() + (t - r.attached.data()));
    return {};
  });
}

/// Mounts the tool of the arguments where another one is; what its expressions say of the place
/// stays with the place.
void mount_instead(const CommandContext& ctx, Robot& r, AttachedTool& t, const Map& args) {
  const std::string before = "attached." + t.name + ".";
  t.what = ref(args, "tool");
  t.name = name_for(ctx, args, t.what);
  std::map<std::string, std::string> kept;
  for (const auto& [path, text] : r.parametric.expressions)
    kept[path.starts_with(before) ? "attached." + t.name + "." + path.substr(before.size())
                                  : path] = text;
  r.parametric.expressions = std::move(kept);
}

Result<void> make_change(const CommandContext& ctx, Robot& r, const Map& args,
                         const std::optional<std::string>& point,
                         std::optional<AttachedTool>& mounted) {
  const bool brings = has(args, "tool");
  if (point && point->empty() && !brings) {
    r.tcp.clear();
    return {};
  }
  std::string from = has(args, "from") ? text_of(args, "from") : std::string();
  if (!brings && from.empty())
    for (const AttachedTool& t : r.attached)
      if (*point == t.name || point->starts_with(t.name + ".")) from = t.name;
  RMP_TRY_ASSIGN(AttachedTool * t, which_attached(r, from, "from"));
  const bool is_last = t->link + 1 == static_cast<std::int32_t>(r.links.size());
  bool leads = leading(r) == t;
  if (brings) {
    if (leads) r.tcp.clear();
    mount_instead(ctx, r, *t, args);
    mounted = *t;
  }
  if (!point && !leads)  // as with a tool that is attached to where none leads
    leads =
        is_last && !leading(r) && !evaluation::tool_centre_points(ctx.snapshot(), t->what).empty();
  return (point ? !point->empty() : leads) ? lead(ctx, r, *t, point) : Result<void>{};
}

Result<Value> change_tool(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto point, wanted_point(args));
  const bool brings = has(args, "tool");
  if (!brings && !point)
    return error(ErrorCode::invalid_argument, "neither tool nor tcp is given",
                 "Give the object to mount, or another centre point.");
  if (!brings && has(args, "name"))
    return error(ErrorCode::invalid_argument, "name is for a tool being mounted",
                 "Give tool as well, or leave name out.", "name");
  std::optional<AttachedTool> mounted;
  std::string leads;
  RMP_TRY(change_robot(ctx, args, [&](Robot& r) -> Result<void> {
    RMP_TRY(make_change(ctx, r, args, point, mounted));
    leads = r.tcp.empty() ? "tool" : r.tcp;
    return {};
  }));
  if (mounted) RMP_TRY(tell_mass(ctx, name_in(ctx, ref(args, "id")), *mounted));
  return Value(leads);
}

std::string with_torch(const char* rest) {
  return with_arm(
             "material.create{name = \"brass\", density = 8500}\n"
             "solid.create{name = \"barrel\", material = \"brass\", root = {kind = \"cylinder\", "
             "radius = 0.01, height = 0.2}}\n"
             "local torch = object.create{name = \"torch\", parts = {{what = \"barrel\"}}, tcps = "
             "{{name = \"tip\", position = {0, 0, 0.215}}}}\n") +
         rest;
}

}  // namespace

RMP_COMMANDS(attached_tool_commands) {
  std::vector<CommandSpec> all;
  const ParamSpec point = optional(
      "tcp", "any", "",
      "Centre point that becomes the robot's tool, as used by inverse kinematics and trajectories. "
      "False: the robot keeps its own tool frame. If omitted: the first centre point of the tool, "
      "if it is on the last link and no centre point of another tool is the robot's tool.");
  Schema params = led_by({"what", "name", "link"}, record_params("robot", "attached", "the link"));
  params[0].name = "tool";
  params[0].required = true;
  params[0].doc = "The tool, mounted by its own frame.";
  params[1].doc = "Name of the tool on this robot; by default that of the object.";
  params[2].doc = "Number or name of the link, or \"base\"; by default the last one.";
  params.insert(params.begin() + 3, point);
  params.insert(params.begin(), self("robot"));
  all.push_back(
      {.name = "robot.attach",
       .classic = "",
       .summary = "Mounts an object as a tool: body, mass and centre points together.",
       .details = "Without a placement a tool on the last link is mounted at the robot's own tool "
                  "frame (robot.set_tool), its flange. The body moves, is drawn, weighs and "
                  "collides as a part of that link. The mass comes from the object, whatever the "
                  "robot's own masses are, and follows its edits. Every centre point is a tip such "
                  "as \"torch.tip\", and \"torch\" is the object's own frame.",
       .example = with_torch("local before = arm:mass().mass\narm:attach{tool = torch}\n"
                             "assert(arm:tool().position[3] == 0.215)\n"
                             "assert(math.abs(arm:mass().mass - before - torch:mass().mass) < "
                             "1e-12)"),
       .params = std::move(params),
       .returns = {"string", "", "Name of the tool on this robot.", {}},
       .effect = Effect::edits,
       .run = attach,
       .takes_expressions = true});
  all.push_back(
      {.name = "robot.detach",
       .classic = "",
       .summary = "Removes an attached tool.",
       .details = "If its centre point was the robot's tool, the robot's own tool frame is used "
                  "again. The object is kept.",
       .example = with_torch("arm:attach{tool = torch}\narm:detach()\n"
                             "assert(arm:tool().position[3] == 0)"),
       .params =
           {self("robot"),
            optional(
                "tool", "string", "",
                "Name of the tool; by default the one that is the robot's tool, or the only one.")},
       .returns = {},
       .effect = Effect::edits,
       .run = detach});
  all.push_back(
      {.name = "robot.change_tool",
       .classic = "",
       .summary =
           "Replaces a tool by another object, or makes another centre point the robot's tool.",
       .details = "With tool, the new one takes link and placement of the old one; body, mass and "
                  "centre point change together, as one undo step. With tcp alone (\"tip\", or "
                  "\"camera.lens\" of another attached tool) nothing is mounted.",
       .example = with_torch(
           "local pen = object.create{name = \"pen\", parts = {{what = \"barrel\"}}, tcps = {{name "
           "= \"point\", position = {0, 0, 0.2}}}}\narm:attach{tool = torch}\n"
           "assert(arm:change_tool{tool = pen} == \"pen.point\")\n"
           "assert(arm:tool().position[3] == 0.2)\nassert(arm:change_tool{tcp = false} == "
           "\"tool\")"),
       .params = {self("robot"), optional("tool", "ref:object|solid", "", "The new tool."), point,
                  optional("from", "string", "",
                           "Name of the tool to replace; by default the one that is the robot's "
                           "tool, or the only one."),
                  optional("name", "string", "",
                           "Name of the new tool; by default that of the object.")},
       .returns =
           {"string", "", "The robot's tool now: \"torch.tip\", or \"tool\" for its own.", {}},
       .effect = Effect::edits,
       .run = change_tool});
  return all;
}

}  // namespace robomosp::ioci
