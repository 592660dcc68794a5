// SPDX-License-Identifier: Apache-2.0
// Named parameters of records: set, list, remove, rename.
#include <algorithm>

#include "ioci/core/commands.h"
#include "ioci/core/expressions.h"

namespace robomosp::ioci {
namespace {

model::Parametric& parametric(model::Record& r) { return *model::parametric_of(r.body); }
const model::Parametric& parametric(const CommandContext& ctx, AnyId id) {
  return *model::parametric_of(ctx.snapshot().find(id)->body);
}
/// The record of the argument `id`; an error if its kind has no parameters.
Result<AnyId> parametric_given(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, read_ref(ctx, "any", *args.find("id"), "id"));
  if (model::parametric_of(ctx.snapshot().find(id)->body)) return id;
  return error(ErrorCode::unsupported, name_in(ctx, id) + " has no parameters",
               "Records of this kind have plain numbers.");
}
std::string own_world(const CommandContext& ctx, AnyId id) {
  return id.kind == Kind::world ? ctx.snapshot().find(id)->name : std::string();
}

Result<void> need_parameter(const CommandContext& ctx, AnyId id, const std::string& name) {
  std::vector<std::string> known;
  for (const model::Parameter& p : parametric(ctx, id).parameters) {
    if (p.name == name) return {};
    known.push_back(p.name);
  }
  return unknown_name("parameter", name, known).in(name_in(ctx, id));
}

Result<Value> run_set_parameter(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, parametric_given(ctx, args));
  const std::string name = text_of(args, "name"), world = own_world(ctx, id);
  model::Parametric changed = parametric(ctx, id);
  auto done = set_parameter(ctx.snapshot(), world, changed, name, args);
  if (!done.ok())
    return std::move(done).error().in("parameter " + text::quote(name)).in(name_in(ctx, id));
  RMP_TRY(ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
    parametric(r) = changed;
    return {};
  }));
  return Value();
}

/// Where a parameter is used: paths of its record, and of others for a world's.
std::vector<std::string> uses(const CommandContext& ctx, AnyId id, const std::string& name) {
  const document::Snapshot& now = ctx.snapshot();
  const model::Record& own = *now.find(id);
  std::vector<std::string> out = model::uses_of(own.body, {"", name});
  if (id.kind != Kind::world) return out;
  for (std::string& s : model::uses_of(own.body, {own.name, name})) out.push_back(std::move(s));
  for (const AnyId user : now.users_of_worlds())
    for (const std::string& s : model::uses_of(now.find(user)->body, {own.name, name}))
      out.push_back(now.describe(user) + ": " + s);
  return out;
}

Result<Value> list_parameters(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, parametric_given(ctx, args));
  Value out = parameters_value(parametric(ctx, id));
  for (const model::Parameter& p : parametric(ctx, id).parameters) {
    List places;
    for (std::string& s : uses(ctx, id, p.name)) places.emplace_back(std::move(s));
    out.as_map()->find(p.name)->as_map()->set("uses", std::move(places));
  }
  return out;
}

Result<Value> run_remove_parameter(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, parametric_given(ctx, args));
  const std::string name = text_of(args, "name");
  RMP_TRY(need_parameter(ctx, id, name));
  if (const auto places = uses(ctx, id, name); !places.empty())
    return error(ErrorCode::conflict,
                 "cannot remove parameter " + text::quote(name) + ": it is used by " +
                     text::enumerate(places),
                 "Give these plain numbers or other expressions first.", name_in(ctx, id));
  RMP_TRY(ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
    erase_if(parametric(r).parameters, [&](const auto& p) { return p.name == name; });
    return {};
  }));
  return Value();
}

Result<Value> run_rename_parameter(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const AnyId id, parametric_given(ctx, args));
  const std::string name = text_of(args, "name"), to = text_of(args, "to");
  RMP_TRY(need_parameter(ctx, id, name));
  auto allowed = Expression::check_name(to, "parameter");
  if (!allowed.ok()) return std::move(allowed).error().in(name_in(ctx, id));
  if (to != name && model::find_parameter(parametric(ctx, id), to))
    return error(ErrorCode::conflict, "there is already a parameter named " + text::quote(to),
                 "Choose another name.", name_in(ctx, id));
  const std::string world = own_world(ctx, id);
  const auto follow = [&](const Expression::Name& n, bool is_own) {
    const bool is_meant =
        n.name == name && ((is_own && n.scope.empty()) || (!world.empty() && n.scope == world));
    return is_meant ? Expression::Name{n.scope, to} : n;
  };
  // The users first: until the world has the new name they keep their last values.
  if (!world.empty())
    for (const AnyId user : ctx.snapshot().users_of_worlds())
      RMP_TRY(ctx.edit().edit(user, [&](model::Record& r) -> Result<void> {
        model::rename_in(r.body, [&](const auto& n) { return follow(n, false); });
        return {};
      }));
  RMP_TRY(ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
    auto& parameters = parametric(r).parameters;
    for (std::size_t i = 0; i < parameters.size(); ++i)
      if (std::as_const(parameters)[i].name == name) parameters[i].name = to;
    model::rename_in(r.body, [&](const auto& n) { return follow(n, true); });
    return {};
  }));
  return Value();
}

/// Lua that makes a record with the parameters bore = 20 mm and wall = bore/4 + 2 mm, both used.
struct ParameterSample {
  const char* kind;  ///< of the record, or "record": commands for all kinds
  const char* variable;
  const char* make;
  const char* read;  ///< the number that `wall` becomes
};
constexpr const char* kParameters =
    "parameters = {bore = \"20 mm\", wall = {value = \"bore/4 + 2 mm\", description = \"around the "
    "bore\"}}";
constexpr ParameterSample kParameterSamples[] = {
    {"solid", "bush",
     "local bush = solid.create{name = \"bush\", $P,\n  root = {kind = \"cylinder\", name = "
     "\"body\", radius = \"bore/2 + wall\", height = \"30 mm\", position = {0, 0, \"wall\"}}}\n",
     "bush:tree().placement.position[3]"},
    {"object", "pair",
     "solid.create{name = \"pin\", root = {kind = \"cylinder\", radius = 0.01, height = 0.05}}\n"
     "local pair = object.create{name = \"pair\", $P,\n  parts = {{what = \"pin\", name = "
     "\"left\", "
     "position = {\"-wall\", 0, \"wall\"}}}}\n",
     "pair:describe().parts[1].placement.position[3]"},
    {"robot", "arm",
     "local arm = robot.create{name = \"arm\", $P,\n  links = {{a = \"bore + 300 mm\"}, {a = 0.2, "
     "d "
     "= \"wall\"}}}\n",
     "arm:link(2).d"},
    {"material", "foam",
     "local foam = material.create{name = \"foam\", $P, density = \"wall * (1 kg/m^4)\"}\n",
     "foam:describe().density"},
    {"trajectory", "stroke",
     "local stroke = trajectory.create{name = \"stroke\", $P, segments = {\n  {shape = \"line\", "
     "points = {{0.5, 0, 0.3}, {0.5, \"wall\", 0.3}}}}}\n",
     "stroke:describe().segments[1].points[2].position[2]"},
    {"task", "lift",
     "local lift = task.create{name = \"lift\", $P, steps = {\n  {step = \"move\", target = {0.5, "
     "0, \"wall\", 0, 0, 0}}}}\n",
     "lift:steps()[1].target.position[3]"},
    {"record", "foam",
     "local foam = record.create{kind = \"material\", name = \"foam\", $P, fields = {density = "
     "\"wall * (1 kg/m^4)\"}}\n",
     "foam:describe().density"},
    {"world", "cell",
     "solid.create{name = \"pin\", root = {kind = \"cylinder\", radius = 0.01, height = 0.05}}\n"
     "local cell = world.create{name = \"cell\", $P}\n"
     "cell:add_object{what = \"pin\", position = {\"bore\", 0, \"wall\"}}\n",
     "cell:objects()[1].placement.position[3]"},
};

void add_parameter_kind(std::vector<CommandSpec>& all, const ParameterSample& s) {
  const std::string kind = s.kind, v = s.variable, read = s.read;
  const bool is_any = kind == "record";
  const ParamSpec id = is_any ? needed("id", "ref:any", "", "A record of any kind.") : self(kind);
  // `foam:set_parameter(`, or `record.set_parameter(foam, `.
  const auto call = [&](const std::string& what, bool has_more = true) {
    return is_any ? "record." + what + "(" + v + (has_more ? ", " : "") : v + ":" + what + "(";
  };
  const std::string list_call =
      call("parameters", false) + ")" + (kind == "trajectory" ? ".parameters" : "");
  std::string make = s.make;
  make.replace(make.find("$P"), 2, kParameters);
  const std::string record = kind == "object" ? "an object" : "a " + kind;
  const bool is_world = kind == "world";
  const ParamSpec name = needed("name", "string", "", "Name of the parameter.");
  all.push_back(
      {.name = kind + ".set_parameter",
       .classic = "",
       .summary = "Sets a parameter of " + record + " to a value or an expression, or adds it.",
       .details = std::string("The value is a number, a quantity such as \"20 mm\", or an "
                              "expression over other parameters such as \"bore/4 + 2 mm\". All "
                              "dependent values are updated in the same step.") +
                  (is_world ? " Expressions of other records use it as "
                              "\"cell.bore\", with the world's name in front."
                            : ""),
       .example = make + call("set_parameter") + "\"bore\", \"40 mm\")\nassert(math.abs(" + read +
                  " - 0.012) < 1e-12)",
       .params = {id, name, optional("value", "any", "", "A number, a quantity, or an expression."),
                  optional("unit", "string", "",
                           "Unit of a plain number, or required unit of an expression; by default "
                           "that of the parameter, or of the expression."),
                  optional("description", "string", "", "Its description.")},
       .returns = {},
       .effect = Effect::edits,
       .run = run_set_parameter});
  // Those of a trajectory are among the answers of an older command of that name.
  if (kind != "trajectory")
    all.push_back({.name = kind + ".parameters",
                   .classic = "",
                   .summary = "Returns the parameters of " + record + " by name.",
                   .details = "In the form that " + kind + ".create takes as its parameters.",
                   .example = make + "local wall = " + list_call +
                              ".wall\nassert(wall.expression == \"bore/4 + 2 mm\" and "
                              "math.abs(wall.value - 0.007) < 1e-12 and wall.unit == \"m\")",
                   .params = {id},
                   .returns = {"map<map>",
                               "",
                               "One row per parameter.",
                               {field("value", "real", "", "Its value."),
                                field("unit", "string", "", "Unit of the value, in SI."),
                                field("text", "string", "", "Value and unit as text."),
                                field("expression", "string", "", "Its expression."),
                                field("description", "string", "", "Its description."),
                                field("uses", "list", "", "Expressions that use it.")}},
                   .effect = Effect::reads,
                   .run = list_parameters});
  all.push_back({.name = kind + ".remove_parameter",
                 .classic = "",
                 .summary = "Removes a parameter of " + record + "; refused while it is in use.",
                 .details = "",
                 .example = make + call("set_parameter") + "\"spare\", 3)\n" +
                            call("remove_parameter") + "\"spare\")\nassert(not " + list_call +
                            ".spare)\nassert(not pcall(" + (is_any ? kind : v) +
                            ".remove_parameter, " + v + ", \"bore\"))",
                 .params = {id, name},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = run_remove_parameter});
  all.push_back({.name = kind + ".rename_parameter",
                 .classic = "",
                 .summary = "Renames a parameter of " + record + ", in all expressions as well.",
                 .details = "",
                 .example = make + call("rename_parameter") + "\"bore\", \"hole\")\nassert(" +
                            list_call + ".wall.expression == \"hole/4 + 2 mm\")",
                 .params = {id, name, needed("to", "string", "", "The new name.")},
                 .returns = {},
                 .effect = Effect::edits,
                 .run = run_rename_parameter});
}

}  // namespace

RMP_COMMANDS(parameter_commands) {
  std::vector<CommandSpec> all;
  for (const ParameterSample& s : kParameterSamples) add_parameter_kind(all, s);
  return all;
}

}  // namespace robomosp::ioci
