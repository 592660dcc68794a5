// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/core/record_params.h"
#include "ioci/records/field_values.h"
#include "ioci/records/tool_centre_points.h"
#include "kernel/fresh_names.h"

namespace robomosp::ioci {
namespace {

using model::Object;
using model::ObjectPart;

Schema make_part_schema() {
  Schema s = led_by({"what", "name", "material"}, record_params("object", "parts", "the object"));
  param_named(s, "what").required = true;
  param_named(s, "name").doc = "Name of the part within the object; by default that of the solid.";
  return s;
}
const Schema& part_schema() {
  static const Schema all = make_part_schema();
  return all;
}

FreshNames part_names(const Object& o) {
  FreshNames names;
  for (const ObjectPart& p : o.parts) names.take(p.name);
  return names;
}

Result<void> append(CommandContext& ctx, Object& o, FreshNames& taken, const Map& checked,
                    const Map& given, std::string_view path) {
  ObjectPart part;
  RMP_TRY(set_fields(part, checked, {"name"}));
  RMP_TRY_ASSIGN(part.placement, read_placement_fields(given, path));
  const std::string wanted =
      has(checked, "name") ? text_of(checked, "name") : ctx.snapshot().find(part.what)->name;
  part.name = taken.fresh(wanted);
  if (has(checked, "name") &&
      (part.name != wanted || wanted.empty() || wanted.find('.') != std::string::npos))
    return error(part.name != wanted ? ErrorCode::conflict : ErrorCode::invalid_argument,
                 part.name != wanted ? "there are two parts named " + text::quote(wanted)
                                     : text::quote(wanted) + " cannot name a part",
                 "Names must be unique within an object and must not contain a dot.",
                 std::string(path));
  ctx.expressions.keep(o.parametric, part.name);
  o.parts.push_back(std::move(part));
  return {};
}

/// The fields of an object itself.
Schema make_object_schema() {
  Schema s =
      led_by({"overlap"}, without(record_params("object", ""), {"measured", "parts", "tcps"}));
  param_named(s, "overlap").default_value = Value(std::string(model::kOverlapWords.front()));
  return s;
}
const Schema& object_schema() {
  static const Schema all = make_object_schema();
  return all;
}

/// Sets the one field `name` of an object or part, if `schema` has it.
template <class T>
Result<bool> set_one_field(const CommandContext& ctx, const Schema& schema, T& to,
                           const std::string& name, const Value& value, const std::string& path) {
  const ParamSpec* p = find_param(schema, name);
  if (!p) return false;
  RMP_TRY_ASSIGN(const Value checked,
                 check_value(*p, value, path, [&ctx](std::string_view kinds, const Value& v) {
                   return ctx.resolve(kinds, v);
                 }));
  RMP_TRY(set_fields(to, Map{{name, checked}}));
  return true;
}

Result<Value> create_object(CommandContext& ctx, const Map& args) {
  Object o;
  RMP_TRY(set_fields(o, args));
  o.parametric = ctx.expressions.own();
  FreshNames taken;
  if (const Value* parts = args.find("parts"))
    for (std::size_t i = 0; i < parts->as_list()->size(); ++i) {
      Value given = (*parts->as_list())[i];
      const std::string path = "parts[" + std::to_string(i + 1) + "]";
      if (const Map* raw = given.as_map()) {
        RMP_TRY_ASSIGN(given, ctx.expressions.read(part_schema(), *raw, path));
      }
      RMP_TRY_ASSIGN(const Map checked, read_map(ctx, part_schema(), given, path));
      RMP_TRY(append(ctx, o, taken, checked, *given.as_map(), path));
    }
  if (const Value* tcps = args.find("tcps"))
    for (std::size_t i = 0; i < tcps->as_list()->size(); ++i) {
      Value given = (*tcps->as_list())[i];
      const std::string path = "tcps[" + std::to_string(i + 1) + "]";
      if (const Map* raw = given.as_map()) {
        RMP_TRY_ASSIGN(given, ctx.expressions.read(tcp_schema(), *raw, path));
      }
      RMP_TRY_ASSIGN(const Map checked, read_map(ctx, tcp_schema(), given, path));
      RMP_TRY(append_tcp(ctx, o, checked, *given.as_map(), path));
    }
  RMP_TRY_ASSIGN(const auto id, ctx.edit().add(text_of(args, "name"), std::move(o)));
  return Value(Application::handle(id));
}

Result<Value> add_part(CommandContext& ctx, const Map& args) {
  Map given;
  for (const ParamSpec& p : part_schema())
    if (const Value* v = ctx.given(p.name)) given.set(p.name, *v);
  std::string made;
  auto done = change<Object>(ctx, ref(args, "id"), [&](Object& o) -> Result<void> {
    FreshNames taken = part_names(o);
    RMP_TRY(append(ctx, o, taken, args, given, name_in(ctx, ref(args, "id"))));
    made = o.parts.back().name;
    return {};
  });
  if (!done.ok()) return std::move(done).error();
  return Value(made);
}

Result<Value> remove_part(CommandContext& ctx, const Map& args) {
  const AnyId id = ref(args, "id");
  auto done = change<Object>(ctx, id, [&](Object& o) -> Result<void> {
    RMP_TRY_ASSIGN(const std::size_t at, find_part(o, text_of(args, "part")));
    o.parts.erase(o.parts.begin() + static_cast<std::ptrdiff_t>(at));
    return {};
  });
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value();
}

Result<Value> set_object(CommandContext& ctx, const Map& args) {
  const std::string path = text_of(args, "path");
  const AnyId id = ref(args, "id");
  auto read = ctx.expressions.read_at(ctx.snapshot().find(id)->body, path, *args.find("value"));
  if (!read.ok()) return std::move(read).in(name_in(ctx, id)).error();
  const Value& value = *read;
  RMP_TRY_ASSIGN(const bool is_done, set_component(ctx, id, path, value));
  if (is_done) return Value();
  auto done = change<Object>(ctx, id, [&](Object& o) -> Result<void> {
    ctx.expressions.keep(o.parametric);
    RMP_TRY_ASSIGN(const bool is_own, set_one_field(ctx, object_schema(), o, path, value, path));
    if (is_own) return {};
    const auto dot = path.find('.');
    RMP_TRY_ASSIGN(const std::size_t at, find_part(o, path.substr(0, dot)));
    ObjectPart& part = o.parts[at];
    const std::string name = dot == std::string::npos ? "" : path.substr(dot + 1);
    RMP_TRY_ASSIGN(const bool placed, set_placement(part.placement, name, value, path));
    if (placed) return {};
    if (name == "material" &&
        (value.is_nil() || (value.as_string() && value.as_string()->empty()))) {
      part.material = {};
      return {};
    }
    if (name == "name") {
      const std::string wanted = value.as_string() ? *value.as_string() : std::string();
      if (wanted.empty() || wanted.find('.') != std::string::npos)
        return error(ErrorCode::invalid_argument, value.text() + " cannot name a part",
                     "Use letters, digits and _.", path);
      if (wanted != part.name && part_names(o).is_taken(wanted))
        return error(ErrorCode::conflict, "there is already a part named " + text::quote(wanted),
                     {}, path);
      part.name = wanted;
      return {};
    }
    const Schema& fields = part_schema();
    RMP_TRY_ASSIGN(const bool is_set, set_one_field(ctx, fields, part, name, value, path));
    if (is_set) return {};
    std::vector<std::string> known;
    for (const ParamSpec& p : fields) known.push_back(p.name);
    Error e = unknown_name("field", name, known);
    e.message += " of part " + text::quote(part.name);
    return e;
  });
  if (!done.ok() && done.error().code == ErrorCode::unknown_name &&
      model::find(model::content(ctx.snapshot().find(id)->body), path))
    done = set_path(ctx, id, path, *args.find("value"));
  if (!done.ok()) return std::move(done).in(name_in(ctx, id)).error();
  return Value();
}

Result<Value> object_mass(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto b, ctx.app.derived.mass(ctx.snapshot(), ref(args, "id"), ctx.progress));
  return Value(body_mass_map(b, about_of(args)));
}

Result<Value> dynamic_vector(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto b, ctx.app.derived.mass(ctx.snapshot(), ref(args, "id"), ctx.progress));
  const auto& m = b.mass;
  // An object by itself has no motor and no friction: the last five stand for a robot's link.
  return Value(
      NumericArray({m.mass, m.com[0], m.com[1], m.com[2], m.inertia.xx, m.inertia.yy, m.inertia.zz,
                    m.inertia.xy, m.inertia.yz, m.inertia.xz, 0, 1, 0, 0, 0}));
}

const char* const kBolt =
    "material.create{name = \"steel\", density = 7850}\n"
    "solid.create{name = \"pin\", material = \"steel\", root = {kind = \"cylinder\", radius = "
    "0.01, height = 0.05}}\n"
    "local bolt = object.create{name = \"bolt\", parts = {{what = \"pin\", name = \"shank\"}, "
    "{what = \"pin\", name = \"head\", position = {0, 0, 0.05}}}}\n";
std::string with_bolt(const char* rest) { return std::string(kBolt) + rest; }

}  // namespace

Result<std::size_t> find_part(const model::Object& o, std::string_view name) {
  std::vector<std::string> known;
  for (std::size_t i = 0; i < o.parts.size(); ++i) {
    if (o.parts[i].name == name) return i;
    known.push_back(o.parts[i].name);
  }
  return unknown_name("part", name, known);
}

RMP_COMMANDS(object_commands) {
  std::vector<CommandSpec> all;
  Schema create_params{needed("name", "string", "", "Name, unique among objects."),
                       optional("parts", "list", "", "Its parts."),
                       optional("tcps", "list", "",
                                "Tool centre points: tables with name and placement, as in "
                                "object.add_tcp.")};
  for (const ParamSpec& p : object_schema()) create_params.push_back(p);
  create_params.push_back(parameters_field());
  all.push_back(
      {.name = "object.create",
       .classic = "",
       .summary = "Makes an object, an assembly of solids and other objects.",
       .details = "A part is a table: what (a solid or object), name, placement or position with "
                  "angles, and a material that replaces that of the solid.",
       .example = with_bolt("assert(#bolt:describe().parts == 2)"),
       .params = std::move(create_params),
       .returns = {"handle", "", "", {}},
       .effect = Effect::edits,
       .run = create_object,
       .takes_expressions = true});
  Schema part = part_schema();
  part.insert(part.begin(), self("object"));
  all.push_back({.name = "object.add_part",
                 .classic = "",
                 .summary = "Adds a part to an object.",
                 .details = "",
                 .example = with_bolt("bolt:add_part{what = \"pin\", name = \"tip\", position = "
                                      "{0, 0, -0.05}}\nassert(#bolt:describe().parts == 3)"),
                 .params = std::move(part),
                 .returns = {"string", "", "Name of the part.", {}},
                 .effect = Effect::edits,
                 .run = add_part,
                 .takes_expressions = true});
  all.push_back(
      {.name = "object.remove_part",
       .classic = "",
       .summary = "Removes a part from an object.",
       .details = "The solid itself is kept.",
       .example = with_bolt("bolt:remove_part(\"head\")\nassert(#bolt:describe().parts == 1)"),
       .params = {self("object"), needed("part", "string", "", "Its name.")},
       .returns = {},
       .effect = Effect::edits,
       .run = remove_part});
  all.push_back(
      {.name = "object.set",
       .classic = "",
       .summary = "Changes one field of an object or of a part.",
       .details = "The path is overlap or description, or a part's name and one of its fields: "
                  "\"head.position\", \"head.position.z\", \"head.rpy\", \"head.material\", "
                  "\"head.what\", \"head.name\"; or any other path of record.set.",
       .example =
           with_bolt("bolt:set{path = \"head.position.z\", value = \"60 "
                     "mm\"}\nassert(bolt:describe().parts[2].placement.position[3] == 0.06)"),
       .params = {self("object"), needed("path", "string", "", "Path of the value."),
                  needed("value", "any", "", "The new value.")},
       .returns = {},
       .effect = Effect::edits,
       .run = set_object,
       .takes_expressions = true});
  all.push_back({.name = "object.mass",
                 .classic = "",
                 .summary = "Returns mass, centre of mass and inertia of an object, following its "
                            "rule for overlapping volume.",
                 .details = "",
                 .example = with_bolt(
                     "assert(math.abs(bolt:mass().mass - 7850 * math.pi * 0.01^2 * 0.1) < 1e-9)"),
                 .params = {self("object"), about_field()},
                 .returns = {"map", "", "", body_mass_fields()},
                 .effect = Effect::reads,
                 .run = object_mass});
  all.push_back(
      {.name = "object.dynamics_vector",
       .classic = "PObject vGetDynamicp",
       .summary = "Returns the dynamic parameters of an object as 15 numbers, in the order of the "
                  "program of 2006.",
       .details = "mass, rx, ry, rz, Ixx, Iyy, Izz, Ixy, Iyz, Ixz, Jm, G, B, Tc+, Tc-. Inertia "
                  "about the centre of mass, elements of the tensor; an object has no motor, so Jm "
                  "= 0, G = 1 and no friction.",
       .example = with_bolt("assert(#bolt:dynamics_vector() == 15)"),
       .params = {self("object")},
       .returns = {"array", "", "15 numbers, SI.", {}},
       .effect = Effect::reads,
       .run = dynamic_vector});
  return all;
}

}  // namespace robomosp::ioci
