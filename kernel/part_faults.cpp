// SPDX-License-Identifier: Apache-2.0
#include "kernel/part_faults.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "kernel/argument_faults.h"
#include "kernel/bare_numbers.h"
#include "kernel/expression.h"
#include "kernel/literal.h"
#include "kernel/number_reader.h"
#include "kernel/plain_check.h"
#include "kernel/text.h"
#include "kernel/units.h"

namespace robomosp {
namespace {

/// Values nested deeper are left to the command, which has its own limits.
constexpr std::size_t kDeepestPart = 100;

/// Takes texts in place of numbers that the command reads: expressions with names, if it allows
/// them, and quantities where the type has no unit, since it may follow from other arguments.
class AnyText final : public NumberReader {
 public:
  explicit AnyText(bool takes_expressions) : takes_expressions_(takes_expressions) {}
  std::optional<Result<double>> read(std::string_view text, std::string_view unit, double min,
                                     double max) override {
    const auto compiled = Expression::compile(text);
    if (!compiled.ok()) return std::nullopt;
    if (compiled->is_literal() ? !unit.empty() : !takes_expressions_) return std::nullopt;
    return Result<double>(std::clamp(0.0, min, max));
  }

 private:
  bool takes_expressions_;
};

std::string path_of_field(std::string_view path, std::string_view name) {
  return path.empty() ? std::string(name) : std::string(path) + "." + std::string(name);
}
std::string path_of_element(std::string_view path, std::size_t i) {
  return std::string(path) + "[" + std::to_string(i + 1) + "]";
}

std::string shown_part(const Value& v) {
  constexpr std::size_t kLongest = 60;
  return text::shortened(beginning_of_literal(v, kLongest), kLongest);
}

bool is_empty_table(const Value& v) {
  return (v.as_list() && v.as_list()->empty()) || (v.as_map() && v.as_map()->empty());
}
bool is_sequence(const Value& v) { return v.as_list() || v.as_array() || is_empty_table(v); }

/// A number, or a text that may be one.
bool is_numeric(const Value& v) {
  return v.is_number() || (v.as_string() && !v.as_string()->empty());
}

bool is_row_of_numbers(const Value& v) {
  if (v.as_array()) return true;
  const List* list = v.as_list();
  return list && std::all_of(list->begin(), list->end(), is_numeric);
}

/// Whether a value has the outer form of a type, so that its parts say what is wrong with it.
bool has_form(const TypeTree& t, const Value& v) {
  const bool is_text = v.as_string() != nullptr;
  switch (t.kind) {
    case TypeKind::any: return true;
    case TypeKind::nothing: return v.is_nil();
    case TypeKind::boolean: return v.as_bool() || is_text;
    case TypeKind::integer:
    case TypeKind::real:
    case TypeKind::expression: return v.is_number() || is_text;
    case TypeKind::text:
    case TypeKind::script:
    case TypeKind::path: return is_text;
    case TypeKind::word: return is_text || v.as_int();
    case TypeKind::colour: return is_text || is_sequence(v);
    case TypeKind::vector:
    case TypeKind::joints: return is_text || v.is_number() || is_sequence(v);
    case TypeKind::pose: return is_text || v.as_map() || is_sequence(v);
    case TypeKind::matrix:
    case TypeKind::list:
    case TypeKind::table: return is_sequence(v);
    case TypeKind::map:
    case TypeKind::variant: return v.as_map() || is_empty_table(v);
    case TypeKind::one_of:
      return std::any_of(t.options.begin(), t.options.end(),
                         [&v](const auto& option) { return has_form(*option, v); });
    case TypeKind::reference:
    case TypeKind::member: return is_text || v.as_handle();
    case TypeKind::handle: return v.as_handle() != nullptr;
    case TypeKind::array: return v.as_array() != nullptr;
    case TypeKind::provider: return is_text || v.is_nil() || v.as_map() || is_empty_table(v);
    case TypeKind::named: {
      const TypeTree* named = named_type(t.word);
      return named && has_form(*named, v);
    }
  }
  return false;
}

/// What a part of that type is checked by. Elements of a list and alternatives have the unit and
/// the range of `outer` where their own type has none.
ParamSpec part_spec(const TypeTree& t, const ParamSpec* outer) {
  ParamSpec p;
  if (outer) {
    p.unit = outer->unit;
    p.min = outer->min;
    p.max = outer->max;
    p.infinite = outer->infinite;
  }
  if (!t.unit.empty()) p.unit = t.unit;
  for (const WordInfo& w : t.choices) p.choices.push_back(w.word);
  if (t.notes.min) p.min = *t.notes.min;
  if (t.notes.max) p.max = *t.notes.max;
  p.infinite = p.infinite || t.notes.is_infinite;
  return p;
}

/// Whether a value fits so plainly that nothing of it needs a second look, as most values of long
/// tables do. False says nothing.
bool fits_plainly(const TypeTree& t, const ParamSpec& spec, const Value& v) {
  const auto is_inside = [&spec](double x) {
    return std::isfinite(x) && x >= spec.min && x <= spec.max;
  };
  switch (t.kind) {
    case TypeKind::any: return true;
    case TypeKind::boolean: return v.as_bool() != nullptr;
    case TypeKind::integer: return v.as_int() && is_inside(v.number());
    case TypeKind::real: return v.is_number() && is_inside(v.number());
    case TypeKind::expression: return v.is_number() && std::isfinite(v.number());
    case TypeKind::text: return v.as_string() != nullptr;
    case TypeKind::reference:
    case TypeKind::member: return v.as_handle() || v.as_string();
    case TypeKind::vector: {
      const List* list = v.as_list();
      return list && list->size() == t.count &&
             std::all_of(list->begin(), list->end(), [&](const Value& each) {
               return each.is_number() && is_inside(each.number());
             });
    }
    case TypeKind::word:
      return v.as_string() && std::find(spec.choices.begin(), spec.choices.end(), *v.as_string()) !=
                                  spec.choices.end();
    case TypeKind::pose: {  // position and angles
      const List* list = v.as_list();
      return list && list->size() == 6 &&
             std::all_of(list->begin(), list->end(), [](const Value& each) {
               return each.is_number() && std::isfinite(each.number());
             });
    }
    case TypeKind::joints: {
      if (v.as_array()) return true;
      const List* list = v.as_list();
      return list && std::all_of(list->begin(), list->end(),
                                 [](const Value& each) { return each.is_number(); });
    }
    case TypeKind::one_of:
      return std::any_of(t.options.begin(), t.options.end(), [&](const auto& option) {
        // Words of an alternative are its own, not those of the parameter.
        return option->kind != TypeKind::word && !option->notes.min && !option->notes.max &&
               fits_plainly(*option, spec, v);
      });
    default: return false;
  }
}

/// A type with its article, as messages have it.
std::string in_words(const TypeTree& t) {
  switch (t.kind) {
    case TypeKind::colour: return "a colour";
    case TypeKind::expression: return "a number or an expression";
    case TypeKind::script: return "a text";
    case TypeKind::member: return "the " + type_words(t);
    case TypeKind::joints: return "a list of " + type_words(t);
    case TypeKind::reference: {
      const std::string kinds = t.words.front() == "any" ? "record" : text::join(t.words, " or ");
      constexpr std::string_view kVowels = "aeio";
      return (kVowels.find(kinds.front()) == std::string_view::npos ? "a " : "an ") + kinds;
    }
    case TypeKind::provider: return "a provider: " + text::join(t.words, " or ");
    case TypeKind::word: {
      std::string out;
      for (const WordInfo& w : t.choices) out += (out.empty() ? "" : ", ") + w.word;
      return out.empty() ? type_words(t) : out;
    }
    case TypeKind::one_of: {
      std::string out;
      for (const auto& option : t.options) out += (out.empty() ? "" : " or ") + in_words(*option);
      return out;
    }
    default: return type_words(t);
  }
}

class PartChecker {
 public:
  explicit PartChecker(std::size_t most) : most_(most) {}

  /// `of` is the variant that the fields are a case of, and `m` decides which.
  void fields(const Schema& schema, const Map& m, const std::string& path, std::string_view also,
              const TypeTree* rest, const TypeTree* of = nullptr) {
    for (const auto& [name, v] : m) {
      if (name == also) continue;
      const ParamSpec* spec = find_param(schema, name);
      if (spec) {
        const TypeTree& t = type_tree(spec->type);
        if (!v.is_nil() && !fits_plainly(t, *spec, v))
          value(t, *spec, v, path_of_field(path, name));
      } else if (rest) {
        if (!v.is_nil()) value(*rest, part_spec(*rest, nullptr), v, path_of_field(path, name));
      } else {
        Fault f = unknown_argument(schema, name, path);
        if (of) name_cases(f, *of, *m.find(of->decided_by)->as_string(), name);
        add(std::move(f));
      }
    }
    for (const ParamSpec& p : schema) {
      const Value* v = m.find(p.name);
      if (!p.required || p.default_value || (v && !v->is_nil())) continue;
      const std::string at = path_of_field(path, p.name);
      add(missing_argument(p, at), at);
    }
  }

  void value(const TypeTree& t, const ParamSpec& spec, const Value& v, const std::string& path) {
    if (depth_ >= kDeepestPart) return;
    ++depth_;
    value_within(t, spec, v, path);
    --depth_;
  }

  std::vector<Fault> take() && {
    if (further_ > 0) {
      Fault f =
          make_fault("argument.malformed", std::to_string(further_) + " further parts do not fit");
      f.subject.argument = faults_.back().subject.argument;
      faults_.push_back(std::move(f));
    }
    return std::move(faults_);
  }

 private:
  void add(Fault f) {
    if (faults_.size() < most_) faults_.push_back(std::move(f));
    else ++further_;
  }
  void add(const Error& e, const std::string& path) { add(argument_fault(e, path)); }
  void add_wrong(const TypeTree& t, const Value& v, const std::string& path,
                 std::string hint = {}) {
    add(argument_error("argument.wrong_type", path, shown_part(v) + " is not " + in_words(t),
                       std::move(hint)),
        path);
  }

  /// Reports a value that check_value() rejects as one of the plain type.
  void plain(const TypeTree& t, const ParamSpec& spec, const char* type, const Value& v,
             const std::string& path) {
    PlainSpec one{type,         spec.unit.empty() ? t.unit : spec.unit,
                  spec.choices, spec.min,
                  spec.max,     spec.infinite};
    std::vector<std::string> words;
    if (one.choices.empty() && !t.choices.empty()) {
      for (const WordInfo& w : t.choices) words.push_back(w.word);
      one.choices = words;
    }
    // Of joints and their like any of several units: "rad|m", "rad or m".
    std::string all(one.unit);
    constexpr std::string_view kOr = " or ";
    for (std::size_t at = 0; (at = all.find(kOr, at)) != std::string::npos;)
      all.replace(at, kOr.size(), "|");
    std::optional<Error> wrong;
    for (const std::string_view unit : text::split(all, '|')) {
      one.unit = unit;
      const Result<Value> checked = check_plain(one, v, path);
      if (checked.ok()) {
        const Result<void> count = check_count(t, *checked, path);
        if (!count.ok()) add(count.error(), path);
        return;
      }
      if (!wrong) wrong = checked.error();
    }
    if (wrong) add(*wrong, path);
  }

  void list(const TypeTree& t, const ParamSpec& spec, const Value& v, const std::string& path) {
    const TypeTree* element = t.element.get();
    const List* items = v.as_list();
    if (!items && !v.as_array()) {
      if (!is_empty_table(v)) plain(t, spec, "list", v, path);
      return;
    }
    if (!element) return;
    const ParamSpec one = part_spec(*element, &spec);
    if (const NumericArray* a = v.as_array()) {
      if (a->is_matrix()) {
        if (!has_form(*element, v)) add_wrong(t, v, path);
        return;
      }
      const bool is_real = element->kind == TypeKind::real;
      for (std::size_t i = 0; i < a->size(); ++i)
        if (const double x = (*a)[i]; !is_real || !std::isfinite(x) || x < one.min || x > one.max)
          value(*element, one, Value(x), path_of_element(path, i));
      return;
    }
    for (std::size_t i = 0; i < items->size(); ++i)
      if (!fits_plainly(*element, one, (*items)[i]))
        value(*element, one, (*items)[i], path_of_element(path, i));
  }

  void map(const TypeTree& t, const ParamSpec& spec, const Value& v, const std::string& path) {
    static const Map kNone;
    const Map* m = is_empty_table(v) ? &kNone : v.as_map();
    if (!m) return plain(t, spec, "map", v, path);
    if (!t.fields.empty()) return fields(t.fields, *m, path, {}, t.element.get());
    if (!t.element) return;
    const ParamSpec one = part_spec(*t.element, &spec);
    for (const auto& [name, each] : *m)
      if (!each.is_nil()) value(*t.element, one, each, path_of_field(path, name));
  }

  void table(const TypeTree& t, const ParamSpec& spec, const Value& v, const std::string& path) {
    if (v.as_array()) {  // rows of numbers in the order of the columns
      if (!v.as_array()->is_matrix()) add_wrong(t, v, path);
      return;
    }
    const List* rows = v.as_list();
    if (!rows) {
      if (!is_empty_table(v)) plain(t, spec, "list", v, path);
      return;
    }
    for (std::size_t i = 0; i < rows->size(); ++i) {
      const Value& row = (*rows)[i];
      const std::string at = path_of_element(path, i);
      if (const Map* m = row.as_map()) fields(t.fields, *m, at, {}, nullptr);
      else if (!is_row_of_numbers(row) && !row.as_list()) add_wrong(t, row, at);
    }
  }

  void variant(const TypeTree& t, const ParamSpec& spec, const Value& v, const std::string& path) {
    static const Map kNone;
    const Map* m = is_empty_table(v) ? &kNone : v.as_map();
    if (!m) return plain(t, spec, "map", v, path);
    const Value* word = m->find(t.decided_by);
    if (const std::string* name = word ? word->as_string() : nullptr)
      for (const auto& [known, schema] : t.cases)
        if (known == *name) return fields(schema, *m, path, t.decided_by, nullptr, &t);
    ParamSpec decides;
    decides.name = t.decided_by;
    decides.type = "enum";
    for (const auto& [name, fields] : t.cases) decides.choices.push_back(name);
    const std::string at = path_of_field(path, t.decided_by);
    if (!word || word->is_nil()) return add(missing_argument(decides, at), at);
    const Result<Value> known = check_value(decides, *word, at);
    if (!known.ok()) return add(known.error(), at);
    for (const auto& [name, schema] : t.cases)
      if (name == known->text()) fields(schema, *m, path, t.decided_by, nullptr);
  }

  /// Reports the parts of the one alternative of the value's form, or the value as a whole.
  void alternatives(const TypeTree& t, const ParamSpec& spec, const Value& v,
                    const std::string& path) {
    std::vector<std::vector<Fault>> tried;
    for (const auto& option : t.options) {
      if (!has_form(*option, v)) continue;
      PartChecker one(most_);
      one.depth_ = depth_;
      one.value(*option, part_spec(*option, &spec), v, path);
      if (one.faults_.empty()) return;
      tried.push_back(std::move(one).take());
    }
    // Of several, those that find the same part wrong.
    if (tried.size() > 1) {
      std::erase_if(tried, [&path](const std::vector<Fault>& faults) {
        return faults.front().subject.argument == path;
      });
      const bool differ = std::any_of(tried.begin(), tried.end(), [&tried](const auto& faults) {
        return faults.front().subject.argument != tried.front().front().subject.argument;
      });
      if (tried.empty() || differ) return add_wrong(t, v, path);
    }
    if (tried.empty()) return add_wrong(t, v, path);
    for (Fault& f : tried.back()) add(std::move(f));
  }

  void colour(const TypeTree& t, const Value& v, const std::string& path) {
    const char* hint = "Give \"#rrggbb\" or {red, green, blue} with numbers from 0 to 1.";
    if (const std::string* s = v.as_string()) {
      if ((s->size() != 7 && s->size() != 9) || s->front() != '#') add_wrong(t, v, path, hint);
      return;
    }
    const std::size_t n = v.as_list()    ? v.as_list()->size()
                          : v.as_array() ? v.as_array()->size()
                                         : 0;
    if (!is_row_of_numbers(v) || (n != 3 && n != 4)) add_wrong(t, v, path, hint);
  }

  void joints(const TypeTree& t, const Value& v, const std::string& path) {
    // Rows of many configurations are given as a matrix; for a robot without joints, a table.
    if (v.as_array() || is_empty_table(v) || is_numeric(v)) return;
    const List* list = v.as_list();
    if (!list) return add_wrong(t, v, path);
    for (std::size_t i = 0; i < list->size(); ++i)
      if (!is_numeric((*list)[i]) && !is_row_of_numbers((*list)[i]))
        add(argument_error("argument.wrong_type", path_of_element(path, i),
                           shown_part((*list)[i]) + " is not a joint value",
                           "Give a number, or a text such as \"90 deg\"."),
            path_of_element(path, i));
  }

  void provider(const TypeTree& t, const Value& v, const std::string& path) {
    if (v.as_string() || v.is_nil()) return;
    if (t.is_name_only) return add_wrong(t, v, path, "Give its name.");
    if (is_empty_table(v)) return;
    const Map* m = v.as_map();
    if (!m) return add_wrong(t, v, path, "Give its name, or {name = ..., params = {...}}.");
    static const Schema kParts = [] {
      ParamSpec name, params;
      name.name = "name";
      name.type = "string";
      params.name = "params";
      params.type = "map";
      return Schema{name, params};
    }();
    fields(kParts, *m, path, {}, nullptr);
  }

  void value_within(const TypeTree& t, const ParamSpec& spec, const Value& v,
                    const std::string& path) {
    switch (t.kind) {
      case TypeKind::any: return;
      case TypeKind::boolean: return plain(t, spec, "bool", v, path);
      case TypeKind::integer: return plain(t, spec, "int", v, path);
      case TypeKind::real: return plain(t, spec, "real", v, path);
      case TypeKind::text: return plain(t, spec, "string", v, path);
      case TypeKind::path: return plain(t, spec, "path", v, path);
      case TypeKind::word:
        if (t.choices.empty() && spec.choices.empty()) {
          if (!has_form(t, v)) add_wrong(t, v, path);
          return;
        }
        return plain(t, spec, "enum", v, path);
      case TypeKind::vector: return plain(t, spec, t.count == 3 ? "vec3" : "real[]", v, path);
      case TypeKind::pose: return plain(t, spec, "pose", v, path);
      case TypeKind::matrix:
        if (is_empty_table(v) && t.rows == 0) return;
        return plain(t, spec, "matrix", v, path);
      case TypeKind::list: return list(t, spec, v, path);
      case TypeKind::map: return map(t, spec, v, path);
      case TypeKind::table: return table(t, spec, v, path);
      case TypeKind::variant: return variant(t, spec, v, path);
      case TypeKind::one_of: return alternatives(t, spec, v, path);
      case TypeKind::colour: return colour(t, v, path);
      case TypeKind::joints: return joints(t, v, path);
      case TypeKind::provider: return provider(t, v, path);
      case TypeKind::named: {
        const TypeTree* named = named_type(t.word);
        if (!named) return;
        ParamSpec one = part_spec(*named, nullptr);
        one.doc = spec.doc;
        return value(*named, one, v, path);
      }
      case TypeKind::expression:
        if (!is_numeric(v))
          add_wrong(t, v, path, "Give a number, or an expression such as \"2*bore + 3 mm\".");
        return;
      case TypeKind::nothing:
      case TypeKind::script:
      case TypeKind::reference:
      case TypeKind::handle:
      case TypeKind::array:
      case TypeKind::member:
        if (!has_form(t, v)) add_wrong(t, v, path);
        return;
    }
  }

  std::size_t most_, further_ = 0, depth_ = 0;
  std::vector<Fault> faults_;
};

}  // namespace

bool has_unchecked_parts(const ParamSpec& spec) {
  return has_unchecked_parts(spec, plain_type(spec.type));
}

bool has_unchecked_parts(const ParamSpec& spec, std::string_view plain) {
  if (plain == spec.type) return false;
  const TypeTree& t = type_tree(spec.type);
  switch (t.kind) {
    case TypeKind::any: return false;
    case TypeKind::boolean:
    case TypeKind::integer:
    case TypeKind::real:
    case TypeKind::text:
    case TypeKind::word:
    case TypeKind::path:
    case TypeKind::vector:
    case TypeKind::pose:
    case TypeKind::matrix:
    case TypeKind::reference: return t.is_unchecked;
    case TypeKind::script:
    case TypeKind::member: return plain == "any";
    default: return true;
  }
}

void name_cases(Fault& f, const TypeTree& variant, std::string_view own, std::string_view name) {
  std::string others;
  for (const auto& [known, schema] : variant.cases)
    if (known != own && find_param(schema, name))
      others += (others.empty() ? "" : " or ") + variant.decided_by + " = " + text::quote(known);
  f.message += " of " + variant.decided_by + " = " + text::quote(own);
  if (!others.empty())
    f.hint =
        text::quote(name) + " is one of " + others + "." + (f.hint.empty() ? "" : " ") + f.hint;
}

std::vector<Fault> part_faults(const ParamSpec& spec, const Value& v, std::string_view path,
                               std::size_t most) {
  const TypeTree& tree = type_tree(spec.type);
  if (fits_plainly(tree, spec, v)) return {};
  const BareNumbers discarded;  // the command reports them when it reads the value
  AnyText any(NumberReader::current() != nullptr);
  const NumberReader::Scope texts(&any);
  PartChecker checker(most);
  checker.value(tree, spec, v, std::string(path));
  return std::move(checker).take();
}

std::vector<Fault> part_faults(const TypeTree& t, const Value& v, std::string_view path,
                               std::size_t most) {
  const BareNumbers discarded;
  AnyText any(true);
  const NumberReader::Scope texts(&any);
  PartChecker checker(most);
  checker.value(t, part_spec(t, nullptr), v, std::string(path));
  return std::move(checker).take();
}

std::vector<Fault> part_faults(const Schema& schema, const Map& given, std::size_t most) {
  const BareNumbers discarded;
  AnyText any(true);
  const NumberReader::Scope texts(&any);
  PartChecker checker(most);
  checker.fields(schema, given, {}, {}, nullptr);
  return std::move(checker).take();
}

}  // namespace robomosp
