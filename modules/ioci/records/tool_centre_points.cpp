// SPDX-License-Identifier: Apache-2.0
// Tool centre points, which make tools of objects.
#include "ioci/records/tool_centre_points.h"

#include <algorithm>
#include <vector>

#include "ioci/core/record_params.h"

namespace robomosp::ioci {
namespace {

using model::Object;
using model::ToolCentrePoint;

Result<Value> add_tcp(CommandContext& ctx, const Map& args) {
  Map given;
  for (const ParamSpec& p : tcp_schema())
    if (const Value* v = ctx.given(p.name)) given.set(p.name, *v);
  const AnyId id = ref(args, "id");
  RMP_TRY(change<Object>(
      ctx, id, [&](Object& o) { return append_tcp(ctx, o, args, given, name_in(ctx, id)); }));
  return Value();
}

Result<Value> remove_tcp(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  const std::string name = text_of(args, "name");
  for (const AnyId other : ctx.snapshot().list(Kind::robot)) {
    const auto& r = *ctx.snapshot().get(RobotId{other.number});
    for (const model::AttachedTool& t : r.attached)
      if (t.what == id && r.tcp == t.name + "." + name)
        return error(
            ErrorCode::conflict,
            "the centre point " + text::quote(name) + " is the tool of " + name_in(ctx, other),
            "Choose another one there with robot.change_tool.", name_in(ctx, id));
  }
  auto done = change<Object>(ctx, id, [&](Object& o) -> Result<void> {
    std::vector<std::string> known;
    for (std::size_t i = 0; i < o.tcps.size(); ++i) {
      if (o.tcps[i].name == name) {
        o.tcps.erase(o.tcps.begin() + static_cast<std::ptrdiff_t>(i));
        return {};
      }
      known.push_back(o.tcps[i].name);
    }
    return unknown_name("tool centre point", name, known);
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value();
}

Result<Value> tcps(CommandContext& ctx, const Map& args) {
  List out;
  for (const ToolCentrePoint& t : content<Object>(ctx, args).tcps) {
    Map row = pose_map(model::pose(t.placement));
    row.set("name", t.name);
    row.set("placement", placement_value(t.placement));
    out.emplace_back(std::move(row));
  }
  return Value(std::move(out));
}

std::string with_torch(const char* rest) {
  return std::string(
             "solid.create{name = \"barrel\", root = {kind = \"cylinder\", radius = 0.01, height = "
             "0.2}}\nlocal torch = object.create{name = \"torch\", parameters = {stick_out = \"15 "
             "mm\"}, parts = {{what = \"barrel\"}},\n  tcps = {{name = \"tip\", position = {0, 0, "
             "\"200 mm + stick_out\"}}}}\n") +
         rest;
}

}  // namespace

const Schema& tcp_schema() {
  static const Schema all = [] {
    Schema s = record_params("object", "tcps", "the object");
    param_named(s, "name").required = true;
    return s;
  }();
  return all;
}

Result<void> append_tcp(CommandContext& ctx, Object& o, const Map& checked, const Map& given,
                        std::string_view path) {
  ToolCentrePoint t;
  RMP_TRY(set_fields(t, checked));
  if (t.name.find('.') != std::string::npos)
    return error(
        ErrorCode::invalid_argument, text::quote(t.name) + " has a dot",
        "A centre point is named after a dot, as in torch.tip, so its name cannot contain a dot.",
        std::string(path));
  if (std::any_of(o.tcps.begin(), o.tcps.end(), [&](const auto& k) { return k.name == t.name; }))
    return error(ErrorCode::conflict,
                 "there are two tool centre points named " + text::quote(t.name),
                 "Names must be unique within an object.", std::string(path));
  RMP_TRY_ASSIGN(t.placement, read_placement_fields(given, path));
  ctx.expressions.keep(o.parametric, "tcps." + t.name);
  o.tcps.push_back(std::move(t));
  return {};
}

RMP_COMMANDS(tool_centre_point_commands) {
  std::vector<CommandSpec> all;
  Schema add = tcp_schema();
  add.insert(add.begin(), self("object"));
  all.push_back({.name = "object.add_tcp",
                 .classic = "",
                 .summary = "Adds a tool centre point, which makes an object a tool.",
                 .details =
                     "robot.attach mounts the object by its own frame, z away from the flange; its "
                     "centre points are then tips of the robot. The first one is the default. Its "
                     "numbers may be expressions: object.set(\"tcps.tip.position.z\", ...).",
                 .example = with_torch("torch:add_tcp{name = \"nozzle\", position = {0, 0, 0.2}}\n"
                                       "assert(#torch:tcps() == 2)"),
                 .params = std::move(add),
                 .returns = {},
                 .effect = Effect::edits,
                 .run = add_tcp,
                 .takes_expressions = true});
  all.push_back({.name = "object.remove_tcp",
                 .classic = "",
                 .summary = "Removes a tool centre point.",
                 .details = "A centre point that a robot uses as its tool cannot be removed.",
                 .example = with_torch("torch:remove_tcp(\"tip\")\nassert(#torch:tcps() == 0)"),
                 .params = {self("object"), needed("name", "string", "", "Its name.")},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = remove_tcp});
  all.push_back(
      {.name = "object.tcps",
       .classic = "",
       .summary = "Lists the tool centre points of an object.",
       .details = "",
       .example = with_torch("torch:set_parameter(\"stick_out\", \"20 mm\")\n"
                             "assert(math.abs(torch:tcps()[1].position[3] - 0.22) < 1e-12)"),
       .params = {self("object")},
       .returns = {"list",
                   "",
                   "In the object's frame.",
                   {field("name", "string", "", "Its name."),
                    field("pose", "pose", "", "4x4 homogeneous matrix."),
                    field("position", "vec3", "m", "Position."),
                    field("rpy", "vec3", "rad", "Roll, pitch, yaw."),
                    field("quaternion", "real[]", "", "w, x, y, z."),
                    field("placement", "map", "", "The placement as it was written.")}},
       .effect = Effect::reads,
       .run = tcps});
  return all;
}

}  // namespace robomosp::ioci
