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
#include "model/marked_numbers.h"
#include "model/parametric.h"

namespace robomosp::io {

namespace {

using namespace model;
using text::quote;

constexpr std::string_view kParameter = "parameter";

bool is_missing(const Number& n) { return n.text.empty(); }

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
                    " is beyond the range of a parameter");
  return p;
}

Result<void> bind_expressions(const Syntax& s, Bound& bound) {
  Body& body = bound.record.body;
  Parametric* p = parametric_of(body);
  const bool is_world = std::holds_alternative<World>(body);
  const std::string own_world = is_world ? bound.record.name : std::string();
  std::map<std::string, std::uint32_t> offsets;  // of expressions, by path or parameter
  std::vector<std::string> missing;              // parameters without a value
  /// Of a number: its field, and its expression.
  struct Found {
    std::string_view field;
    std::string text;
    std::string path{};
  };
  std::map<std::uint32_t, Found> found;  // by the offset of the expression
  for (const Field& f : s.fields) {
    for (std::uint32_t k = 0; k < f.numbers; ++k) {
      const Number& n = s.numbers[f.first_number + k];
      if (n.expression.empty()) continue;
      const std::uint32_t offset = n.expression_offset;
      const auto e = Expression::compile(unescape(n.expression));
      if (!e.ok())
        return s.at(offset, e.error().code, e.error().where + ": " + e.error().message,
                    e.error().hint);
      const bool uses_world =
          std::any_of(e->names().begin(), e->names().end(), [&](const Expression::Name& name) {
            return !name.scope.empty() && name.scope != own_world;
          });
      if (is_missing(n) && uses_world)
        return s.at(offset, ErrorCode::syntax,
                    "the last value is missing in front of this expression, which uses a world",
                    "Such as: radius 10 mm = \"cell.bore/2\".");
      if (f.name == kParameter && f.parent < 0 && p) {
        const std::string name =
            f.argument == Argument::word ? std::string(f.text) : unescape(f.text);
        offsets["parameter " + quote(name)] = offset;
        if (is_missing(n)) missing.push_back(name);
      } else {
        found.emplace(offset, Found{f.name, e->text()});
      }
    }
  }
  if (!found.empty())
    for_each_number(
        content(body), [](const double& v) { return number_of_nan(v).has_value(); },
        [&](const std::string& path, const double& v) {
          const auto at = found.find(*number_of_nan(v));
          if (at != found.end() && number_in(body, path) == &v) at->second.path = path;
        });
  for (const auto& [offset, number] : found) {
    if (!p || number.path.empty())
      return s.at(offset, ErrorCode::syntax,
                  "this number of " + quote(number.field) + " cannot be an expression",
                  p ? "Whole numbers and colours are written as they are."
                    : "Records of this kind have no parameters.");
    set_number(body, number.path, bound.last_values.at(offset));
    offsets[number.path] = offset;
    p->expressions[number.path] = number.text;
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
