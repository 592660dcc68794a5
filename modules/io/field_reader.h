// SPDX-License-Identifier: Apache-2.0
// Reads fields of a native file by rules: the fields that a block may have, and their values
// (layer: application). Internal to modules/io.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "document/validate.h"
#include "io/bind.h"
#include "io/expressions.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "model/marked_numbers.h"
#include "model/parametric.h"
#include "model/placement.h"

namespace robomosp::io {

inline constexpr std::uint32_t kFile =
    std::numeric_limits<std::uint32_t>::max();  ///< the outermost "block"

/// One field that a block may have.
struct Rule {
  std::string_view name;
  std::function<Result<void>(std::uint32_t)> read;  ///< gets the field's index
  bool is_repeated = false;
  bool is_required = false;
};

/// The common base of readers by rules.
class FieldReader {
 public:
  explicit FieldReader(const Syntax& s) : s_(s) {}

 protected:
  using Index = std::uint32_t;
  using Skip = std::function<bool(Index)>;
  using Body = model::Body;
  using Parametric = model::Parametric;
  using Parameter = model::Parameter;
  using Placement = model::Placement;
  using BodyPart = model::BodyPart;
  using CollisionPairRule = model::CollisionPairRule;
  using KeptSolver = model::KeptSolver;
  using MeasuredMass = model::MeasuredMass;
  using ProviderChoice = model::ProviderChoice;
  using PositionRepresentation = model::PositionRepresentation;
  using AngleRepresentation = model::AngleRepresentation;
  static std::string quote(std::string_view v) { return text::quote(v); }

  // ---- blocks ----

  [[nodiscard]] const Field& at(Index i) const { return s_.fields[i]; }
  [[nodiscard]] static std::string article(std::string_view noun) {
    return document::with_article(noun);
  }
  [[nodiscard]] Error fail(Index i, std::string message, std::string hint = {}) const {
    return s_.at(at(i).offset, ErrorCode::syntax, std::move(message), std::move(hint));
  }
  [[nodiscard]] Error twice(std::string_view what, const std::string& name, Index i,
                            Index first) const {
    return s_.at(at(i).argument_offset, ErrorCode::conflict,
                 "there is already " + article(what) + " named " + quote(name),
                 "The first one is at " + s_.place(at(first).offset) + ".");
  }

  /// Reads the fields of a block (kFile: of the file) by its rules; `what` as in "a DH row".
  Result<void> block(Index owner, const std::string& what, const std::vector<Rule>& rules,
                     const Skip& skip = {}) {
    const Index first = owner == kFile ? 0 : owner + 1;
    const Index end = owner == kFile ? static_cast<Index>(s_.fields.size()) : at(owner).end;
    std::vector<std::optional<Index>> seen(rules.size());
    for (Index i = first; i < end; i = at(i).end) {
      if (skip && skip(i)) continue;
      if (owner == kFile && at(i).name == "solver") {
        RMP_TRY(solver(i));
        continue;
      }
      const auto rule = std::find_if(rules.begin(), rules.end(),
                                     [&](const Rule& r) { return r.name == at(i).name; });
      if (rule == rules.end()) return unknown(i, what, rules);
      auto& before = seen[static_cast<std::size_t>(rule - rules.begin())];
      if (before && !rule->is_repeated)
        return fail(i, quote(rule->name) + " is given twice in " + what,
                    "The first one is at " + s_.place(at(*before).offset) + ".");
      before = i;
      RMP_TRY(rule->read(i));
    }
    for (std::size_t k = 0; k < rules.size(); ++k) {
      if (!rules[k].is_required || seen[k]) continue;
      const std::uint32_t offset = owner == kFile ? s_.kind_offset : at(owner).offset;
      return s_.at(offset, ErrorCode::syntax, quote(rules[k].name) + " is missing in " + what);
    }
    return {};
  }

  /// `solver scara { interface "robomosp.ik/1"  line "return function(model, target)" ... }`, which
  /// any record may keep.
  Result<void> solver(Index i) {
    KeptSolver s;
    RMP_TRY(need_argument(i));
    RMP_TRY(read_name(i, s.name, "solver"));
    RMP_TRY(need_block(i));
    bool has_lines = false;
    Rule interface = string("interface", s.interface);
    interface.is_required = true;
    RMP_TRY(block(i, "a solver",
                  {std::move(interface), string("provides", s.provides),
                   repeated("line", [&](Index k) -> Result<void> {
                     std::string one;
                     RMP_TRY(string("line", one).read(k));
                     if (std::exchange(has_lines, true)) s.text += '\n';
                     s.text += one;
                     return {};
                   })}));
    if (!has_lines)
      return fail(i, "\"line\" is missing in a solver", "Give its Lua text, one line each.");
    out_.record.solvers.push_back(std::move(s));
    return {};
  }

  [[nodiscard]] Error unknown(Index i, const std::string& what,
                              const std::vector<Rule>& rules) const {
    std::vector<std::string> names;
    for (const Rule& r : rules) names.emplace_back(r.name);
    const std::string word(at(i).name);
    std::string hint = text::did_you_mean(word, names);
    if (hint.empty()) hint = "Fields are " + text::enumerate(names) + ".";
    return s_.at(at(i).offset, ErrorCode::unknown_name, quote(word) + " is not a field of " + what,
                 hint);
  }

  Result<void> need_argument(Index i) {
    if (at(i).argument != Argument::none) return {};
    return fail(i, article(at(i).name) + " needs a name",
                "Such as: " + std::string(at(i).name) + " first { ... }");
  }
  Result<void> need_block(Index i, bool without_name = false) {
    if (!at(i).has_block || at(i).has_values)
      return fail(i, quote(at(i).name) + " needs a block in braces");
    if (without_name && at(i).argument != Argument::none)
      return s_.at(at(i).argument_offset, ErrorCode::syntax,
                   quote(at(i).name) + " has a block but no name or value before it");
    return {};
  }
  Result<void> no_block(Index i, bool several_tuples = false) {
    if (at(i).has_block) return fail(i, quote(at(i).name) + " has a value but no block");
    if (at(i).tuples > 1 && !several_tuples)
      return s_.at(at(i).argument_offset, ErrorCode::syntax,
                   quote(at(i).name) + " needs its numbers in a single pair of parentheses");
    if (at(i).has_values)
      return s_.at(at(i).argument_offset, ErrorCode::syntax,
                   quote(at(i).name) + " needs a single value");
    return {};
  }

  /// A named member of a list: `link elbow { ... }`.
  Result<void> element(Index i, std::string_view list, std::size_t index, std::string& name,
                       std::unordered_map<std::string, Index>& named, bool has_block = true) {
    out_.places[{list, index}] = at(i).offset;
    RMP_TRY(need_argument(i));
    RMP_TRY(read_name(i, name, list));
    if (has_block) RMP_TRY(need_block(i));
    if (const auto [it, is_new] = named.emplace(name, i); !is_new)
      return twice(list, name, i, it->second);
    return {};
  }

  // ---- rules ----

  Rule name_rule() {
    return {"name",
            [this](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              return read_name(i, out_.record.name, s_.kind);
            },
            false, true};
  }
  /// `parameter wall 7 mm = "bore/4 + 2 mm" "description"`
  Rule parameter_rule(Parametric& out) {
    return repeated("parameter",
                    [this, &out, known = std::set<std::string>()](Index i) mutable -> Result<void> {
                      RMP_TRY_ASSIGN(Parameter p, read_parameter(s_, i));
                      if (!known.insert(p.name).second)
                        return s_.at(at(i).argument_offset, ErrorCode::conflict,
                                     "there is already a parameter named " + quote(p.name));
                      out.parameters.push_back(std::move(p));
                      return {};
                    });
  }
  Rule string(std::string_view name, std::string& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              if (at(i).argument != Argument::string)
                return s_.at(at(i).argument_offset, ErrorCode::syntax,
                             quote(at(i).name) + " needs a text in double quotes");
              out = unescape(at(i).text);
              return {};
            }};
  }
  Rule number(std::string_view name, std::string_view unit, double& out, bool is_required = false) {
    return {name,
            [this, unit, &out](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              RMP_TRY_ASSIGN(const Number n, single_number(i));
              RMP_TRY_ASSIGN(out, quantity(n, unit));
              return {};
            },
            false, is_required};
  }
  Rule tuple(std::string_view name, std::string_view unit, Vec3& out) {
    return {name, [this, unit, &out](Index i) { return read_tuple(i, unit, out); }};
  }
  Rule measured(std::optional<MeasuredMass>& out) {
    return {"measured", [this, &out](Index i) -> Result<void> {
              RMP_TRY(need_block(i, true));
              MeasuredMass& m = out.emplace();
              return block(i, "a measured mass",
                           {number("mass", "kg", m.mass.mass, true), tuple("com", "m", m.mass.com),
                            Rule{"inertia",
                                 [&](Index k) -> Result<void> {
                                   std::array<double, 6> v{};
                                   RMP_TRY(read_tuple(k, "kg m^2", v));
                                   m.mass.inertia = {v[0], v[1], v[2], v[3], v[4], v[5]};
                                   return {};
                                 }},
                            string("source", m.source)});
            }};
  }

  Rule colour(std::string_view name, Colour& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              const Field& f = at(i);
              if (f.argument != Argument::tuple || (f.numbers != 3 && f.numbers != 4))
                return fail(i, quote(f.name) + " needs three or four numbers in parentheses",
                            "Give red, green and blue from 0 to 1, then the opacity.");
              std::array<double, 4> v{0, 0, 0, 1};
              for (std::uint32_t k = 0; k < f.numbers; ++k) {
                RMP_TRY_ASSIGN(v[k], quantity(s_.numbers[f.first_number + k], ""));
              }
              out = {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]),
                     static_cast<float>(v[3])};
              return {};
            }};
  }
  Rule words(std::string_view name, std::vector<std::string> choices,
             std::function<void(std::size_t)> set) {
    return {
        name, [this, choices = std::move(choices), set = std::move(set)](Index i) -> Result<void> {
          RMP_TRY(no_block(i));
          const Field& f = at(i);
          const auto it = f.argument == Argument::word
                              ? std::find(choices.begin(), choices.end(), f.text)
                              : choices.end();
          if (it == choices.end()) {
            std::string hint =
                f.argument == Argument::word ? text::did_you_mean(f.text, choices) : std::string();
            return s_.at(f.argument_offset, ErrorCode::syntax,
                         quote(f.name) + " must be " + or_list(choices), std::move(hint));
          }
          set(static_cast<std::size_t>(it - choices.begin()));
          return {};
        }};
  }
  static std::string or_list(const std::vector<std::string>& words) {
    std::string s;
    for (std::size_t i = 0; i < words.size(); ++i)
      s += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
    return s;
  }
  static Rule repeated(std::string_view name, std::function<Result<void>(Index)> read) {
    return {name, std::move(read), true, false};
  }
  Rule placement_block(std::string_view name, std::optional<Placement>& out) {
    return {name,
            [this, name, &out](Index i) { return placement_block(name, out.emplace()).read(i); }};
  }
  Rule placement_block(std::string_view name, Placement& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              RMP_TRY(need_block(i, true));
              std::vector<Rule> rules;
              placement(rules, out);
              return block(i, article(at(i).name) + " placement", rules);
            }};
  }
  /// One of at, cylindrical, spherical, and one of rpy, xyz, zyz.
  void placement(std::vector<Rule>& rules, Placement& out) {
    const auto has_position = std::make_shared<std::optional<Index>>();
    for (const auto coordinates :
         {PositionRepresentation::cartesian, PositionRepresentation::cylindrical,
          PositionRepresentation::spherical})
      rules.push_back({model::word_of(coordinates),
                       [this, &out, has_position, coordinates](Index i) -> Result<void> {
                         if (*has_position)
                           return fail(i,
                                       quote(at(i).name) + " cannot be combined with " +
                                           quote(at(**has_position).name),
                                       "A placement can have only one position.");
                         *has_position = i;
                         out.coordinates = coordinates;
                         return read_tuple(i, model::position_units(coordinates), out.position);
                       }});
    const auto has_angles = std::make_shared<std::optional<Index>>();
    for (const auto notation :
         {AngleRepresentation::rpy, AngleRepresentation::xyz, AngleRepresentation::zyz})
      rules.push_back(
          {model::word_of(notation), [this, &out, has_angles, notation](Index i) -> Result<void> {
             if (*has_angles)
               return fail(
                   i,
                   quote(at(i).name) + " cannot be combined with " + quote(at(**has_angles).name),
                   "A placement can have only one set of angles.");
             *has_angles = i;
             out.notation = notation;
             return read_tuple(i, "rad", out.angles);
           }});
  }
  Rule reference(std::string_view name, std::vector<Kind> kinds, std::string owner,
                 std::function<void(Body&, AnyId)> set) {
    return {
        name,
        [this, kinds = std::move(kinds), owner = std::move(owner),
         set = std::move(set)](Index i) -> Result<void> {
          RMP_TRY_ASSIGN(std::string file, path(i));
          out_.references.push_back({std::move(file), at(i).argument_offset, kinds, owner, set});
          return {};
        }};
  }
  Result<std::string> path(Index i) {
    RMP_TRY(no_block(i));
    const Field& f = at(i);
    if (f.argument != Argument::string)
      return s_.at(f.argument_offset, ErrorCode::syntax,
                   quote(f.name) + " needs a file's path in double quotes");
    std::string path = unescape(f.text);
    if (path.empty())
      return s_.at(f.argument_offset, ErrorCode::syntax,
                   "the path of " + quote(f.name) + " is empty");
    return path;
  }
  /// solid or object, exactly one of them (need_body).
  std::vector<Rule> body(const std::string& what, const std::function<void(Body&, AnyId)>& set) {
    std::vector<Rule> rules;
    rules.push_back(reference("solid", {Kind::solid}, what, set));
    rules.push_back(reference("object", {Kind::object}, what, set));
    return rules;
  }
  Result<void> need_body(Index owner) {
    std::optional<Index> found;
    for (Index i = owner + 1; i < at(owner).end; i = at(i).end) {
      if (at(i).name != "solid" && at(i).name != "object") continue;
      if (found)
        return fail(i, "a part cannot be both a solid and an object", "Split them into two parts.");
      found = i;
    }
    if (found) return {};
    return fail(owner, quote(at(owner).name) + " names neither a solid nor an object",
                "Such as: solid \"plate.csg\"");
  }
  Result<void> body_part(Index i, const std::string& what, std::vector<BodyPart>& parts,
                         const std::function<void(Body&, AnyId)>& set) {
    BodyPart p;
    RMP_TRY(need_block(i, true));
    auto rules = body(what, set);
    placement(rules, p.placement);
    RMP_TRY(block(i, what, rules));
    RMP_TRY(need_body(i));
    parts.push_back(p);
    return {};
  }
  /// `allowed_pair { a "base"  b "forearm"  reason "they never meet" }`
  Rule pair_rule(std::string_view name, bool is_allowed, std::vector<CollisionPairRule>& out) {
    return repeated(name, [this, is_allowed, &out](Index i) -> Result<void> {
      CollisionPairRule p;
      p.is_allowed = is_allowed;
      RMP_TRY(need_block(i, true));
      std::vector<Rule> rules{string("a", p.a), string("b", p.b), string("reason", p.reason)};
      rules[0].is_required = rules[1].is_required = true;
      RMP_TRY(block(i, "a pair of bodies", rules));
      out.push_back(std::move(p));
      return {};
    });
  }
  Rule provider(std::string_view name, ProviderChoice& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              if (at(i).has_values) return no_block(i);
              if (at(i).argument != Argument::none) RMP_TRY(read_name(i, out.name, "provider"));
              return parameters(i, out);
            }};
  }
  /// Every field of the block, or those that `is_parameter`, are parameters of the provider.
  Result<void> parameters(Index owner, ProviderChoice& out, const Skip& is_parameter = {}) {
    for (Index i = owner + 1; i < at(owner).end; i = at(i).end) {
      if (is_parameter && !is_parameter(i)) continue;
      RMP_TRY(no_block(i));
      RMP_TRY_ASSIGN(auto value, parameter(i));
      if (!out.params.emplace(std::string(at(i).name), std::move(value)).second)
        return fail(i, "parameter " + quote(at(i).name) + " is given twice");
    }
    return {};
  }
  Result<ProviderChoice::Param> parameter(Index i) {
    const Field& f = at(i);
    using Param = ProviderChoice::Param;
    switch (f.argument) {
      case Argument::string: return Param(unescape(f.text));
      case Argument::word:
        if (f.text == "true" || f.text == "false") return Param(f.text == "true");
        if (f.text == "inf") return Param(std::numeric_limits<double>::infinity());
        return Param(std::string(f.text));
      case Argument::number: {
        const Number& n = s_.numbers[f.first_number];
        if (n.unit.empty() && n.expression.empty())  // those are reals
          if (const auto whole = text::read_int(n.text)) return Param(*whole);
        RMP_TRY_ASSIGN(const double v, any_quantity(n));
        return Param(v);
      }
      case Argument::tuple: {
        std::vector<double> v;
        for (std::uint32_t k = 0; k < f.numbers; ++k) {
          RMP_TRY_ASSIGN(const double x, any_quantity(s_.numbers[f.first_number + k]));
          v.push_back(x);
        }
        return Param(std::move(v));
      }
      case Argument::none: break;
    }
    return fail(i, quote(f.name) + " has no value");
  }

  // ---- values ----

  Result<Number> single_number(Index i) {
    const Field& f = at(i);
    if (f.argument == Argument::number) return s_.numbers[f.first_number];
    if (f.argument == Argument::word && f.text == "inf")
      return Number{f.text, {}, f.argument_offset};
    return s_.at(f.argument_offset, ErrorCode::syntax, quote(f.name) + " needs a number");
  }
  Result<double> quantity(const Number& n, std::string_view unit) {
    if (n.text.empty()) return noted(n, 0);  // bind_expressions() computes it
    std::string s(n.text);
    if (!n.unit.empty()) s += " " + std::string(n.unit);
    auto v = units::read_quantity(s, unit);
    if (!v.ok()) return s_.at(n.offset, v.error().code, v.error().message, v.error().hint);
    return noted(n, *v);
  }
  /// A number in whatever unit it has, in SI.
  Result<double> any_quantity(const Number& n) {
    RMP_TRY_ASSIGN(const double v, quantity({n.text, {}, n.offset}, ""));
    if (n.unit.empty()) return noted(n, v);
    auto unit = units::parse(n.unit);
    if (!unit.ok())
      return s_.at(n.offset, unit.error().code, unit.error().message, unit.error().hint);
    return noted(n, units::to_si(v, *unit));
  }
  /// The number that the record gets until its expressions are bound.
  double noted(const Number& n, double v) {
    if (n.expression.empty()) return v;
    out_.last_values[n.expression_offset] = v;
    return model::marked_nan(n.expression_offset);
  }
  /// Joint values of a robot that is defined in another file: each an angle or a length.
  Result<void> joint_values(Index i, std::vector<double>& out) {
    RMP_TRY(no_block(i));
    const Field& f = at(i);
    if (f.argument != Argument::tuple)
      return fail(i, quote(f.name) + " needs numbers in parentheses");
    for (std::uint32_t k = 0; k < f.numbers; ++k) {
      const Number& n = s_.numbers[f.first_number + k];
      const auto unit = units::parse(n.unit);
      const bool is_length = unit.ok() && unit->dimension == units::Dimension{1, 0, 0, 0};
      RMP_TRY_ASSIGN(const double v, quantity(n, is_length ? "m" : "rad"));
      out.push_back(v);
    }
    return {};
  }
  template <std::size_t N>
  Result<void> read_tuple(Index i, std::string_view unit, std::array<double, N>& out) {
    std::array<std::string_view, N> same;
    same.fill(unit);
    return read_tuple(i, same, out);
  }
  template <std::size_t N>
  Result<void> read_tuple(Index i, const std::array<std::string_view, N>& unit,
                          std::array<double, N>& out) {
    RMP_TRY(no_block(i));
    const Field& f = at(i);
    if (f.argument != Argument::tuple || f.numbers != N)
      return s_.at(f.argument_offset, ErrorCode::syntax,
                   quote(f.name) + " needs " + std::to_string(N) + " numbers in parentheses" +
                       (f.argument == Argument::tuple ? "; it has " + std::to_string(f.numbers)
                                                      : std::string()));
    for (std::uint32_t k = 0; k < N; ++k) {
      RMP_TRY_ASSIGN(out[k], quantity(s_.numbers[f.first_number + k], unit[k]));
    }
    return {};
  }
  /// A word, or any text in quotes.
  Result<void> read_word(Index i, std::string& out) {
    const Field& f = at(i);
    if (f.argument != Argument::word && f.argument != Argument::string)
      return s_.at(f.argument_offset, ErrorCode::syntax, quote(f.name) + " needs a name");
    out = f.argument == Argument::word ? std::string(f.text) : unescape(f.text);
    return {};
  }
  /// The same of what names a member or record.
  Result<void> read_name(Index i, std::string& out, std::string_view what) {
    RMP_TRY(read_word(i, out));
    if (document::is_name(out)) return {};
    Error e = document::bad_name(out, what);
    return s_.at(at(i).argument_offset, e.code, e.message, e.hint);
  }

  Rule count(std::string_view name, std::int64_t& out) {
    return {name, [this, &out](Index i) -> Result<void> {
              RMP_TRY(no_block(i));
              RMP_TRY_ASSIGN(const Number n, single_number(i));
              const auto whole = n.unit.empty() ? text::read_int(n.text) : std::nullopt;
              if (!whole) return fail(i, quote(at(i).name) + " needs a whole number");
              out = *whole;
              return {};
            }};
  }

  /// `mass 2  com (0, 0, 0.1)  inertia (...)`
  Rule mass_block(std::string_view name, std::string what, std::optional<MassProperties>& out) {
    return {name, [this, what = std::move(what), &out](Index i) -> Result<void> {
              RMP_TRY(need_block(i, true));
              MassProperties& m = out.emplace();
              return block(i, what,
                           {number("mass", "kg", m.mass, true), tuple("com", "m", m.com),
                            Rule{"inertia", [&](Index c) -> Result<void> {
                                   std::array<double, 6> v{};
                                   RMP_TRY(read_tuple(c, "kg m^2", v));
                                   m.inertia = {v[0], v[1], v[2], v[3], v[4], v[5]};
                                   return {};
                                 }}});
            }};
  }

  const Syntax& s_;
  Bound out_;
};

}  // namespace robomosp::io
