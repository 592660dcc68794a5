// SPDX-License-Identifier: Apache-2.0
#include "io/expressions.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "kernel/text.h"
#include "kernel/units.h"
#include "model/data.h"
#include "model/field_path.h"
#include "model/parametric.h"

namespace robomosp::io {

namespace {

using namespace model;
using text::quote;

constexpr std::string_view kAxes[] = {"x", "y", "z"};
constexpr std::string_view kParameter = "parameter";

bool is_missing(const Number& n) { return n.text.empty(); }

/// The paths of the numbers of a file's fields.
class Paths {
 public:
  Paths(const Syntax& s, const Bound& bound) : s_(s) {
    for (const auto& [key, offset] : bound.places)
      if (std::string name = element_name(bound.record.body, key.first, key.second); !name.empty())
        elements_.emplace(offset, std::move(name));
  }

  /// Of number `k` of a field; empty when it can be none.
  [[nodiscard]] std::string of(std::uint32_t field, std::uint32_t k) const {
    const Field& f = s_.fields[field];
    const std::string last = number_name(field, k);
    if (last.empty()) return {};
    std::vector<std::string> words{last};
    for (std::int32_t i = f.parent; i >= 0; i = s_.fields[index(i)].parent) {
      const Field& above = s_.fields[index(i)];
      if (const auto it = elements_.find(above.offset); it != elements_.end()) {
        words.push_back(it->second);
        break;  // nodes stand in nodes, and paths begin with the innermost
      }
      if (above.name == "row" || above.name == "drive" || above.name == "given" ||
          above.name == "spring")
        continue;
      if (above.name == "part")
        words.push_back("parts." + std::to_string(place_among(index(i), "part")));
      else if (above.name == "base_part")
        words.push_back("base_parts." + std::to_string(place_among(index(i), "base_part")));
      else if (above.name == "loop") words.push_back(std::to_string(place_among(index(i), "loop")));
      else words.emplace_back(above.name);
    }
    std::string path;
    for (auto it = words.rbegin(); it != words.rend(); ++it)
      path += (path.empty() ? "" : ".") + *it;
    return path;
  }

 private:
  static std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }

  /// As paths name element `i` of the list that files call `word`; empty when it has no name.
  static std::string element_name(const Body& body, std::string_view word, std::size_t i) {
    const Content record = content(body);
    for (const model::Field& list : record.type->fields) {
      const Type& t = *list.type;
      const void* items = list.in(record.data);
      if (t.shape != Shape::list || list.word_in_files() != word || i >= t.length(items)) continue;
      const std::string* name = name_of(*t.element, t.at(items, i));
      return name && !name->empty() ? element_prefix(list) + *name : std::string();
    }
    return {};
  }

  /// Its place among the fields of one name in the same block, from 1.
  [[nodiscard]] std::size_t place_among(std::size_t field, std::string_view name) const {
    std::size_t n = 1;
    for (std::size_t i = 0; i < field; ++i)
      if (s_.fields[i].parent == s_.fields[field].parent && s_.fields[i].name == name) ++n;
    return n;
  }

  [[nodiscard]] std::string number_name(std::uint32_t field, std::uint32_t k) const {
    const Field& f = s_.fields[field];
    const bool is_tuple = f.argument == Argument::tuple;
    if (f.argument == Argument::number) return std::string(f.name);
    if (!is_tuple) return {};
    if (f.parent >= 0 && s_.fields[index(f.parent)].name == "loop") return point_name(field, k);
    const std::string_view axis = kAxes[k % 3];
    const auto on_axis = [&](std::string_view name) {
      return std::string(name) + "." + std::string(axis);
    };
    if (f.name == "at" || f.name == "cylindrical" || f.name == "spherical")
      return on_axis("position");
    if (f.name == "rpy" || f.name == "xyz" || f.name == "zyz") return on_axis(f.name);
    if (f.name == "limits") return k == 0 ? "lower" : "upper";
    if (f.name == "coulomb") return k == 0 ? "coulomb_positive" : "coulomb_negative";
    if (f.numbers <= std::size(kAxes)) return on_axis(f.name);
    return {};
  }

  /// A point of a loop: its start or the centre of a circle is 1, the others follow in order.
  [[nodiscard]] std::string point_name(std::uint32_t field, std::uint32_t k) const {
    const Field& f = s_.fields[field];
    std::size_t point = 1;
    if (f.name == "line" || f.name == "arc" || f.name == "spline") {
      point += 1 + k / 2;
      for (std::size_t i = 0; i < field; ++i) {
        const Field& other = s_.fields[i];
        if (other.parent == f.parent &&
            (other.name == "line" || other.name == "arc" || other.name == "spline"))
          point += other.tuples;
      }
    }
    return std::to_string(point) + "." + std::string(kAxes[k % 2]);
  }

  const Syntax& s_;
  std::map<std::uint32_t, std::string> elements_;  ///< by the offset of their field
};

/// An error of resolve(), whose `where` begins with a path or parameter, at its place in the file.
Error at_place(const Syntax& s, const std::map<std::string, std::uint32_t>& offsets,
               const Error& e) {
  std::uint32_t offset = s.kind_offset;
  std::string rest = e.where;
  for (const auto& [where, at] : offsets) {
    if (e.where.empty() && e.message.starts_with(where + " ")) offset = at;  // a circle
    if (e.where != where && !e.where.starts_with(where + ", ")) continue;
    offset = at;
    rest = e.where.size() > where.size() ? e.where.substr(where.size() + 2) : std::string();
  }
  return s.at(offset, e.code, rest.empty() ? e.message : rest + ": " + e.message, e.hint);
}

/// Parameters without a value in the file: evaluated in rounds, since with the value comes the
/// unit.
void fill_in(Parametric& p, std::vector<std::string> missing, std::string_view own_world) {
  const WorldParameters none = [](const Expression::Name&) { return std::nullopt; };
  for (bool is_new = true; is_new && !missing.empty();) {
    is_new = false;
    for (auto it = missing.begin(); it != missing.end();) {
      const auto at = std::find_if(p.parameters.begin(), p.parameters.end(),
                                   [&](const Parameter& x) { return x.name == *it; });
      const auto e = Expression::compile(at->expression);
      const bool waits =
          !e.ok() || std::any_of(e->names().begin(), e->names().end(), [&](const auto& n) {
            return std::find(missing.begin(), missing.end(), n.name) != missing.end();
          });
      const auto q = waits ? Result<Quantity>(error(ErrorCode::conflict, ""))
                           : e->evaluate(lookup(p, own_world, none));
      if (!q.ok()) {  // resolve() says why
        ++it;
        continue;
      }
      Parameter& v = p.parameters[static_cast<std::size_t>(at - p.parameters.begin())];
      v.unit = units::si_name(q->dimension);
      v.value = q->value;
      it = missing.erase(it);
      is_new = true;
    }
  }
}

}  // namespace

Result<Parameter> read_parameter(const Syntax& s, std::uint32_t field) {
  const Field& f = s.fields[field];
  Parameter p;
  const bool has_name = f.argument == Argument::word || f.argument == Argument::string;
  if (!has_name || f.has_block || f.numbers != 1 || !f.has_values)
    return s.at(f.offset, ErrorCode::syntax, "a parameter needs a name and a value",
                "Such as: parameter bore 20 mm");
  p.name = f.argument == Argument::word ? std::string(f.text) : unescape(f.text);
  const auto named = Expression::check_name(p.name, "parameter");
  if (!named.ok())
    return s.at(f.argument_offset, named.error().code, named.error().message, named.error().hint);
  const Number& n = s.numbers[f.first_number];
  p.expression = unescape(n.expression);
  p.description = unescape(f.remark);
  if (is_missing(n)) return p;
  const auto value = text::read_real(n.text);
  const auto unit = units::parse(n.unit);
  if (!value || !unit.ok())
    return s.at(n.offset, ErrorCode::syntax, quote(n.text) + " is not the value of a parameter");
  p.value = units::to_si(*value, *unit);
  p.unit = units::si_name(unit->dimension);
  if (!std::isfinite(p.value) || !units::parse(p.unit).ok())
    return s.at(n.offset, ErrorCode::syntax,
                quote(std::string(n.text) + " " + std::string(n.unit)) +
                    " is beyond what a parameter can be");
  return p;
}

Result<void> bind_expressions(const Syntax& s, Bound& bound) {
  Body& body = bound.record.body;
  Parametric* p = parametric_of(body);
  const bool is_world = std::holds_alternative<World>(body);
  const std::string own_world = is_world ? bound.record.name : std::string();
  const Paths paths(s, bound);
  std::map<std::string, std::uint32_t> offsets;  // of expressions, by path or parameter
  std::vector<std::string> missing;              // parameters without a value
  for (std::uint32_t i = 0; i < s.fields.size(); ++i) {
    const Field& f = s.fields[i];
    for (std::uint32_t k = 0; k < f.numbers; ++k) {
      const Number& n = s.numbers[f.first_number + k];
      if (n.expression.empty()) continue;
      const std::uint32_t offset = n.expression_offset;
      const auto e = Expression::compile(unescape(n.expression));
      if (!e.ok())
        return s.at(offset, e.error().code, e.error().where + ": " + e.error().message,
                    e.error().hint);
      const bool is_parameter = f.name == kParameter && f.parent < 0 && p;
      const std::string path = is_parameter ? std::string() : paths.of(i, k);
      if (!is_parameter && (!p || path.empty() || !number_at(body, path)))
        return s.at(offset, ErrorCode::syntax,
                    "this number of " + quote(f.name) + " cannot be an expression",
                    "Dimensions and places of solids, objects, robots and worlds can.");
      const bool uses_world =
          std::any_of(e->names().begin(), e->names().end(), [&](const Expression::Name& name) {
            return !name.scope.empty() && name.scope != own_world;
          });
      if (is_missing(n) && uses_world)
        return s.at(offset, ErrorCode::syntax,
                    "the last value is missing in front of this expression, which uses a world",
                    "Such as: radius 10 mm = \"cell.bore/2\".");
      if (is_parameter) {
        const std::string name =
            f.argument == Argument::word ? std::string(f.text) : unescape(f.text);
        offsets["parameter " + quote(name)] = offset;
        if (is_missing(n)) missing.push_back(name);
      } else {
        offsets[path] = offset;
        p->expressions[path] = e->text();
      }
    }
  }
  if (!p) return {};
  fill_in(*p, std::move(missing), own_world);
  const WorldParameters none = [](const Expression::Name&) { return std::nullopt; };
  const auto resolved = resolve(body, own_world, none);
  if (!resolved.ok()) return at_place(s, offsets, resolved.error());
  return {};
}

std::string print_parameter(const Parameter& p) {
  std::string s = "parameter " + p.name + " " + units::print_with_unit(p.value, p.unit);
  if (!p.expression.empty()) s += " = " + quote(p.expression);
  if (!p.description.empty()) s += " " + quote(p.description);
  return s;
}

ExpressionTexts::ExpressionTexts(const Body& body) {
  if (const Parametric* p = parametric_of(body))
    for (const auto& [path, text] : p->expressions)
      if (const double* number = number_in(body, path)) texts_.emplace(number, text);
}

std::string ExpressionTexts::behind(const double& number) const {
  const auto it = texts_.find(&number);
  return it == texts_.end() ? std::string() : " = " + quote(it->second);
}

bool ExpressionTexts::has(const Placement& p) const {
  return std::any_of(p.position.begin(), p.position.end(),
                     [this](const double& v) { return has(v); }) ||
         std::any_of(p.angles.begin(), p.angles.end(), [this](const double& v) { return has(v); });
}

}  // namespace robomosp::io
