// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/expressions.h"

#include <algorithm>
#include <queue>
#include <unordered_map>

#include "ioci/core/commands.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "kernel/units.h"
#include "model/field_path.h"

namespace robomosp::ioci {
namespace {

using text::quote;

/// Whether a text that is no quantity was meant as an expression, for the choice of its message.
bool looks_like_expression(std::string_view s) {
  s = text::trim(s);
  if (s.empty()) return false;
  const char c = s.front();
  if ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '(' || c == '\'')
    return true;
  return s.find_first_of("+*(") != std::string_view::npos ||
         s.find(" - ") != std::string_view::npos;
}

std::string join(const std::string& prefix, std::string_view name) {
  return prefix.empty() ? std::string(name) : prefix + "." + std::string(name);
}

std::vector<std::string> axes(const std::string& path) {
  return {path + ".x", path + ".y", path + ".z"};
}

/// Units of the three numbers of a field of a placement; empty = it is none.
std::vector<std::string_view> placement_units(std::string_view name) {
  if (name == "position") return {"m", "m", "m"};
  if (name == "cylindrical") return {"m", "rad", "m"};
  if (name == "spherical") return {"m", "rad", "rad"};
  if (name == "rpy" || name == "xyz" || name == "zyz") return {"rad", "rad", "rad"};
  return {};
}
/// What the path calls it: the numbers of a position have one name in all coordinates.
std::string_view placement_path(std::string_view name) {
  return name == "cylindrical" || name == "spherical" ? "position" : name;
}

/// Unit of a new parameter: radians are dropped where that leaves something with a name, so that
/// `radius * angle` is in metres.
std::string unit_of(const Quantity& q) {
  units::Dimension plain = q.dimension;
  plain[3] = 0;
  const bool is_named = !units::kind_of(q.dimension).starts_with("a quantity");
  const bool would_be = !units::kind_of(plain).starts_with("a quantity");
  return units::si_name(!is_named && would_be && same_kind(plain, q.dimension) ? plain
                                                                               : q.dimension);
}

}  // namespace

Expressions::Expressions(const document::Snapshot& snapshot, model::Parametric own,
                         std::string own_name)
    : snapshot_(&snapshot),
      own_(std::move(own)),
      own_name_(std::move(own_name)),
      worlds_(snapshot.world_parameters()) {}

Expression::Lookup Expressions::lookup() const { return model::lookup(own_, own_name_, worlds_); }

Result<Expressions> expressions_of(const CommandContext& ctx, const CommandSpec& spec,
                                   const Map& args) {
  const document::Snapshot& now = ctx.snapshot();
  model::Parametric own;
  std::string own_world;
  const Value* id_given = args.find("id");
  if (id_given && !spec.params.empty() && spec.params.front().name == "id") {
    const auto handle =
        ctx.resolve(std::string_view(spec.params.front().type).substr(4), *id_given);
    if (!handle.ok()) return Expressions();  // the schema's check says what is wrong
    const auto id = Application::record_id(now, *handle);
    if (!id.ok()) return Expressions();
    const model::Record& record = *now.find(*id);
    if (const auto* p = model::parametric_of(record.body)) own = *p;
    if (id->kind == Kind::world) own_world = record.name;
  } else {
    if (const Value* name = args.find("name");
        name && name->as_string() && spec.name.starts_with("world."))
      own_world = *name->as_string();
    RMP_TRY_ASSIGN(own, read_parameters(now, own_world, args.find("parameters"), "parameters"));
  }
  return Expressions(now, std::move(own), std::move(own_world));
}

std::optional<Result<double>> GivenExpressions::read(std::string_view text, std::string_view unit,
                                                     double min, double max) {
  const auto e = Expression::compile(text);
  if (!e.ok()) {
    // Words without an operator are rather wrong words than wrong expressions.
    const bool has_operator = text.find_first_of("+-*/^(") != std::string_view::npos;
    if (has_operator && looks_like_expression(text)) return Result<double>(e.error());
    return std::nullopt;
  }
  if (e->is_literal()) return std::nullopt;
  if (!known_) {
    auto known = expressions_of(ctx_, spec_, args_);
    if (!known.ok()) return Result<double>(std::move(known).error());
    known_ = std::move(*known);
  }
  // A single word without any parameters is rather a wrong word.
  const bool is_word =
      e->names().size() == 1 && e->names()[0].scope.empty() && e->names()[0].name == e->text();
  if (is_word && known_->own().parameters.empty()) return std::nullopt;
  const auto value = [&]() -> Result<double> {
    if (unit != model::kAnyUnit && unit != model::kByJoint)
      return e->evaluate(known_->lookup(), unit);
    RMP_TRY_ASSIGN(const Quantity q, e->evaluate(known_->lookup()));
    return model::in_unit(q, unit, e->text());
  }();
  if (!value.ok()) return value;
  return Result<double>(marks_.near(*value, min, max, e->text()));
}

Result<void> GivenExpressions::keep(document::Transaction& edits) const {
  if (marks_.empty()) return {};
  std::vector<std::string> kept;
  const std::vector<AnyId> touched = edits.touched();
  for (const AnyId id : touched) {
    const model::Record* record = edits.now().find(id);
    if (!record) continue;
    std::vector<std::pair<std::string, std::string>> found;  // path and text
    model::for_each_number(
        model::content(record->body), [&](const double& v) { return marks_.find(v) != nullptr; },
        [&](const std::string& path, const double& v) {
          if (model::number_in(record->body, path) == &v) found.emplace_back(path, *marks_.find(v));
        });
    if (found.empty()) continue;
    const std::string shown = edits.now().describe(id);
    if (!model::parametric_of(record->body))
      return error(ErrorCode::unsupported,
                   shown + " cannot be set by the expression " + text::quote(found[0].second),
                   "Records of this kind have plain numbers.");
    RMP_TRY(edits.edit(id, [&](model::Record& r) -> Result<void> {
      auto& expressions = model::parametric_of(r.body)->expressions;
      for (const auto& [path, text] : found) expressions[path] = text;
      return {};
    }));
    for (auto& [path, text] : found) kept.push_back(std::move(text));
  }
  for (const std::string& text : marks_.texts())
    if (std::find(kept.begin(), kept.end(), text) == kept.end())
      return error(
          ErrorCode::unsupported,
          "the expression " + text::quote(text) + " is not kept: this command uses the number only",
          "Give the number itself, or set the numbers of the record with record.set.");
  return {};
}

void Expressions::note(const std::string& path, std::optional<std::string> text) {
  for (auto& [known, before] : found_)
    if (known == path) {
      if (text) before = std::move(text);  // a number may be the one read from a text before
      return;
    }
  found_.emplace_back(path, std::move(text));
}

Result<Value> Expressions::number(const Value& value, std::string_view unit,
                                  const std::string& path, const std::string& where) {
  const std::string* s = value.as_string();
  const bool is_open = unit == model::kAnyUnit || unit == model::kByJoint;
  if (!s || (!is_open && units::read_quantity(*s, unit == "1" ? std::string_view() : unit).ok())) {
    note(path, std::nullopt);
    return value;
  }
  const auto e = Expression::compile(*s);
  if (!e.ok() && looks_like_expression(*s)) return Error(e.error()).in(where);
  if (e.ok() && is_open) {
    auto q = e->evaluate(lookup());
    auto read = q.ok() ? model::in_unit(*q, unit, e->text()) : Result<double>(q.error());
    if (!read.ok()) return std::move(read).error().in(where);
    note(path, e->is_literal() ? std::nullopt : std::optional(e->text()));
    return Value(*read);
  }
  if (!e.ok() || e->is_literal()) return value;  // the schema says what is wrong with it
  auto read = e->evaluate(model::lookup(own_, own_name_, worlds_), unit);
  if (!read.ok()) return std::move(read).error().in(where);
  note(path, e->text());
  return Value(*read);
}

Result<Value> Expressions::numbers(const Value& value, const std::vector<std::string_view>& units,
                                   const std::vector<std::string>& paths,
                                   const std::string& where) {
  const List* list = value.as_list();
  if (!list || list->size() != paths.size()) {
    for (const std::string& path : paths) note(path, std::nullopt);
    return value;
  }
  List out;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    RMP_TRY_ASSIGN(
        Value v, number((*list)[i], units[i], paths[i], where + "[" + std::to_string(i + 1) + "]"));
    out.push_back(std::move(v));
  }
  return Value(std::move(out));
}

Result<Value> Expressions::pose(const Value& value, const std::string& path,
                                const std::string& where) {
  const auto under = [&](std::string_view name) { return axes(join(path, name)); };
  if (const List* list = value.as_list(); list && list->size() == 6) {
    std::vector<std::string> paths = under("position");
    for (std::string& p : under("rpy")) paths.push_back(std::move(p));
    return numbers(value, {"m", "m", "m", "rad", "rad", "rad"}, paths, where);
  }
  for (const char* name : {"position", "rpy", "xyz", "zyz"})
    for (const std::string& p : under(name)) note(p, std::nullopt);
  const Map* map = value.as_map();
  if (!map) return value;
  Map out;
  for (const auto& [key, v] : *map) {
    const auto units = placement_units(key);
    if (units.empty()) {
      out.set(key, v);
      continue;
    }
    RMP_TRY_ASSIGN(Value read, numbers(v, units, under(placement_path(key)), join(where, key)));
    out.set(key, std::move(read));
  }
  return Value(std::move(out));
}

Result<Value> Expressions::field(const ParamSpec& spec, const Value& value,
                                 const std::string& prefix, const std::string& where) {
  const std::string path = join(prefix, spec.name);
  const std::string_view type = plain_type(spec.type);
  if (type == "real") return number(value, spec.unit, path, where);
  // In a node or part "placement" is the place itself; a robot's "base" and "tool" are places.
  if (type == "pose") return pose(value, spec.name == "placement" ? prefix : path, where);
  if (type != "vec3") return value;
  const auto units = placement_units(spec.name);
  return units.empty()
             ? numbers(value, {spec.unit, spec.unit, spec.unit}, axes(path), where)
             : numbers(value, units, axes(join(prefix, placement_path(spec.name))), where);
}

Result<Map> Expressions::read(const Schema& schema, const Map& given, std::string_view where,
                              const std::string& prefix) {
  if (!snapshot_) return given;
  Map out;
  for (const auto& [key, value] : given) {
    const ParamSpec* spec = find_param(schema, key);
    if (!spec || value.is_nil()) {
      out.set(key, value);
      continue;
    }
    RMP_TRY_ASSIGN(Value v, field(*spec, value, prefix, join(std::string(where), key)));
    out.set(key, std::move(v));
  }
  // Texts beside the numbers, as solid.tree gives them.
  const Value* texts = find_param(schema, "expressions") ? given.find("expressions") : nullptr;
  if (const Map* map = texts ? texts->as_map() : nullptr)
    for (const auto& [path, value] : *map) {
      const std::string at = join(std::string(where), "expressions." + path);
      if (!value.as_string())
        return error(ErrorCode::invalid_argument, value.text() + " is not an expression",
                     "Give a text such as \"bore/2\".", at);
      auto e = Expression::compile(*value.as_string());
      if (!e.ok()) return std::move(e).error().in(at);
      auto read = e->evaluate(model::lookup(own_, own_name_, worlds_));
      if (!read.ok()) return std::move(read).error().in(at);
      note(join(prefix, path), e->text());
    }
  return out;
}

Result<Value> Expressions::read_at(const model::Body& body, const std::string& path,
                                   const Value& value) {
  if (!snapshot_) return value;
  if (const auto n = model::number_at(body, path)) return number(value, n->unit, path, path);
  const auto dot = path.rfind('.');
  const std::string name = path.substr(dot == std::string::npos ? 0 : dot + 1);
  const std::string parent = dot == std::string::npos ? "" : path.substr(0, dot);
  if (name == "placement") return pose(value, parent, path);
  if (const auto units = placement_units(name); !units.empty())
    return numbers(value, units, axes(join(parent, placement_path(name))), path);
  // The component of a notation that is not the present one: set_placement() knows better.
  return value;
}

void Expressions::keep(model::Parametric& into, std::string_view prefix) {
  for (auto& [path, text] : found_) {
    std::string full = join(std::string(prefix), path);
    if (text) into.expressions[std::move(full)] = std::move(*text);
    else into.expressions.erase(full);
  }
  found_.clear();
}

Result<bool> set_component(CommandContext& ctx, AnyId id, const std::string& path,
                           const Value& value) {
  const auto n = model::number_at(ctx.snapshot().find(id)->body, path);
  const bool is_angle = path.size() > 6 && (path.find(".rpy.", path.size() - 6) != path.npos ||
                                            path.find(".xyz.", path.size() - 6) != path.npos ||
                                            path.find(".zyz.", path.size() - 6) != path.npos);
  if (!n || (!is_angle && path.find(".profile.") == path.npos)) return false;
  RMP_TRY_ASSIGN(const Value number,
                 check_value(field("", "real", std::string(n->unit), ""), value, path));
  RMP_TRY(ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
    model::set_number(r.body, path, number.number());
    ctx.expressions.keep(*model::parametric_of(r.body));
    return {};
  }));
  return true;
}

// --- parameters ----------------------------------------------------------------------------

ParamSpec parameters_field() {
  return optional("parameters", "map", "",
                  "Named quantities for the expressions of this record: {bore = \"20 mm\", wall = "
                  "{value = \"bore/4 + 2 mm\", description = \"...\"}}.");
}

namespace {

Schema parameter_schema() {
  return {optional("value", "any", "", ""),         optional("unit", "string", "", ""),
          optional("expression", "string", "", ""), optional("description", "string", "", ""),
          optional("text", "string", "", ""),       optional("uses", "list", "", "")};
}

}  // namespace

namespace {

/// A parameter as `given` makes it of what it was; nullptr = it is new.
Result<model::Parameter> given_parameter(const model::Parameter* before, const std::string& name,
                                         const Map& given, const Expression::Lookup& known) {
  RMP_TRY(Expression::check_name(name, "parameter"));
  const bool is_new = !before;
  model::Parameter v = is_new ? model::Parameter{} : *before;
  v.name = name;
  if (has(given, "description")) v.description = text_of(given, "description");
  std::optional<units::Unit> unit;
  if (has(given, "unit")) {
    RMP_TRY_ASSIGN(unit, units::parse(text_of(given, "unit")));
  }
  const Value* value = has(given, "expression") ? given.find("expression") : given.find("value");
  if (value && value->is_nil()) value = nullptr;
  if (!value) {
    if (is_new)
      return error(ErrorCode::invalid_argument,
                   "the new parameter " + quote(name) + " has no value",
                   "Give value = \"20 mm\", a number, or an expression.");
    if (unit && unit->dimension != model::quantity_of(v).dimension)
      return error(ErrorCode::invalid_argument,
                   "parameter " + quote(name) + " is " +
                       units::kind_of(model::quantity_of(v).dimension) + ", not " +
                       units::kind_of(unit->dimension),
                   "Give its new value as well.");
  } else if (value->is_number()) {
    v.expression.clear();
    v.value = unit ? units::to_si(value->number(), *unit) : value->number();
    if (unit) v.unit = units::si_name(unit->dimension);
  } else if (const std::string* s = value->as_string()) {
    RMP_TRY_ASSIGN(const Expression e, Expression::compile(*s));
    RMP_TRY_ASSIGN(const Quantity q, e.evaluate(known));
    // A plain number is in the unit given, in that of the parameter, or has none.
    const bool is_bare = e.is_literal() && q.dimension == units::Dimension{};
    if (is_bare) {
      if (unit) v.unit = units::si_name(unit->dimension);
      v.value = unit ? units::to_si(q.value, *unit) : q.value;
    } else {
      if (unit && !q.fits_any && !same_kind(unit->dimension, q.dimension))
        return error(ErrorCode::invalid_argument,
                     quote(e.text()) + " is " + units::kind_of(q.dimension) + ", but the unit is " +
                         quote(text_of(given, "unit")),
                     "Leave the unit out, or give one that fits.");
      v.unit = unit ? units::si_name(unit->dimension) : q.fits_any ? v.unit : unit_of(q);
      v.value = q.value;
    }
    v.expression = e.is_literal() ? std::string() : e.text();
  } else {
    return error(ErrorCode::invalid_argument, value->text() + " is not the value of a parameter",
                 "Give a number, a quantity such as \"20 mm\", or an expression.");
  }
  return v;
}

}  // namespace

Result<void> set_parameter(const document::Snapshot& snapshot, const std::string& own_world,
                           model::Parametric& p, const std::string& name, const Map& given) {
  const auto it = std::find_if(p.parameters.begin(), p.parameters.end(),
                               [&](const model::Parameter& v) { return v.name == name; });
  const bool is_new = it == p.parameters.end();
  const model::WorldParameters worlds = snapshot.world_parameters();
  RMP_TRY_ASSIGN(model::Parameter v, given_parameter(is_new ? nullptr : &*it, name, given,
                                                     model::lookup(p, own_world, worlds)));
  if (is_new) p.parameters.push_back(std::move(v));
  else p.parameters[static_cast<std::size_t>(it - p.parameters.begin())] = std::move(v);
  return {};
}

Result<model::Parametric> read_parameters(const document::Snapshot& snapshot,
                                          const std::string& own_world, const Value* value,
                                          std::string_view where) {
  model::Parametric p;
  if (!value || value->is_nil() || (value->as_list() && value->as_list()->empty())) return p;
  const Map* map = value->as_map();
  if (!map)
    return error(ErrorCode::invalid_argument, value->text() + " is not a table of parameters",
                 "Give {bore = \"20 mm\", wall = \"bore/4\"}.", std::string(where));
  struct Entry {
    std::string name;
    Map given;
    std::vector<std::size_t> followers;  ///< entries whose text names this one
    std::size_t waits_for = 0;           ///< entries that its own text names
    std::size_t round = 0;               ///< in which it is set, by those that it waits for
    bool is_set = false;
  };
  std::vector<Entry> entries;
  std::unordered_map<std::string_view, std::size_t> at;
  entries.reserve(map->size());
  for (const auto& [name, v] : *map) {
    Entry e{name, {}, {}};
    if (v.as_map()) {
      auto checked = check(parameter_schema(), *v.as_map());
      if (!checked.ok()) return std::move(checked).error().in(join(std::string(where), name));
      e.given = std::move(*checked);
    } else {
      e.given.set("value", v);
    }
    entries.push_back(std::move(e));
    at.emplace(entries.back().name, entries.size() - 1);
  }
  const auto text_given = [](const Entry& e) {
    const Value* text =
        has(e.given, "expression") ? e.given.find("expression") : e.given.find("value");
    return text ? text->as_string() : nullptr;
  };
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const std::string* text = text_given(entries[i]);
    const auto compiled = text ? Expression::compile(*text) : Expression::compile("0");
    if (!compiled.ok()) continue;  // told when it is set
    for (const Expression::Name& n : compiled->names()) {
      if (!n.scope.empty() && n.scope != own_world) continue;
      const auto of = at.find(n.name);
      if (of == at.end()) continue;
      entries[of->second].followers.push_back(i);
      ++entries[i].waits_for;
    }
  }
  // In rounds through the table: what uses only known parameters gets its value and with it its
  // unit.
  using Turn = std::pair<std::size_t, std::size_t>;  // round, entry
  std::priority_queue<Turn, std::vector<Turn>, std::greater<>> ready;
  for (std::size_t i = 0; i < entries.size(); ++i)
    if (entries[i].waits_for == 0) ready.emplace(0, i);
  std::unordered_map<std::string_view, Quantity> known;
  const model::WorldParameters worlds = snapshot.world_parameters();
  const Expression::Lookup others = model::lookup(p, own_world, worlds);
  const Expression::Lookup all = [&](const Expression::Name& n) -> Result<Quantity> {
    if (n.scope.empty() || n.scope == own_world)
      if (const auto of = known.find(n.name); of != known.end()) return of->second;
    return others(n);
  };
  while (!ready.empty()) {
    const auto [round, i] = ready.top();
    ready.pop();
    Entry& e = entries[i];
    auto set = given_parameter(nullptr, e.name, e.given, all);
    if (!set.ok()) return std::move(set).error().in(join(std::string(where), e.name));
    known.emplace(e.name, model::quantity_of(*set));
    p.parameters.push_back(std::move(*set));
    e.is_set = true;
    for (const std::size_t f : e.followers) {
      Entry& follower = entries[f];
      follower.round = std::max(follower.round, f > i ? round : round + 1);
      if (--follower.waits_for == 0) ready.emplace(follower.round, f);
    }
  }
  if (p.parameters.size() == entries.size()) return p;
  // A circle: resolve() names it.
  model::Solid s;
  for (const Entry& e : entries)
    if (!e.is_set) s.parametric.parameters.push_back({e.name, *text_given(e), "", 0, ""});
  for (const auto& set : p.parameters) s.parametric.parameters.push_back(set);
  model::Body body = std::move(s);
  auto resolved = model::resolve(body, {}, worlds);
  if (!resolved.ok()) return std::move(resolved).error().in(where);
  return error(ErrorCode::conflict, "parameters depend on each other in a cycle", {},
               std::string(where));
}

Value parameters_value(const model::Parametric& p) {
  Map out;
  for (const model::Parameter& v : p.parameters) {
    Map row{
        {"value", v.value}, {"unit", v.unit}, {"text", units::print_with_unit(v.value, v.unit)}};
    if (!v.expression.empty()) row.set("expression", v.expression);
    if (!v.description.empty()) row.set("description", v.description);
    out.set(v.name, std::move(row));
  }
  return out;
}

Map expressions_map(const model::Parametric& p, std::string_view prefix) {
  Map out;
  const std::string front = prefix.empty() ? std::string() : std::string(prefix) + ".";
  for (const auto& [path, text] : p.expressions)
    if (path.starts_with(front)) out.set(path.substr(front.size()), text);
  return out;
}

}  // namespace robomosp::ioci
