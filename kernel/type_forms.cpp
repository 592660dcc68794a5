// SPDX-License-Identifier: Apache-2.0
#include "kernel/type_forms.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "kernel/literal.h"
#include "kernel/part_faults.h"
#include "kernel/text.h"
#include "kernel/units.h"

namespace robomosp {
namespace {

/// In order of TypeKind.
constexpr std::array<std::string_view, 25> kKindWords{
    "any",    "nil",   "bool",   "int",      "real",   "string",     "enum",    "path",   "colour",
    "vector", "pose",  "matrix", "list",     "map",    "table",      "variant", "one_of", "ref",
    "handle", "array", "member", "provider", "joints", "expression", "script"};
static_assert(kKindWords.size() == static_cast<std::size_t>(TypeKind::named));
std::string_view kind_word(TypeKind k) {
  return k == TypeKind::named ? "named" : kKindWords[static_cast<std::size_t>(k)];
}

constexpr std::string_view kPoseFields[] = {"position", "cylindrical", "spherical",  "rpy",   "xyz",
                                            "zyz",      "quaternion",  "axis_angle", "matrix"};

// ---- misfit ----

std::string shown_value(const Value& v) {
  constexpr std::size_t kLongest = 60;
  std::string s = beginning_of_literal(v, kLongest);
  if (s.size() > kLongest) s = text::shortened(s, kLongest);
  return s;
}

std::string place_and_message(const Fault& f) {
  return (f.where.empty() ? std::string() : f.where + ": ") + f.message;
}

}  // namespace

std::string misfit(const TypeTree& t, const Value& v, std::string_view path) {
  const std::vector<Fault> faults = part_faults(t, v, path, 1);
  return faults.empty() ? std::string() : place_and_message(faults.front());
}

std::string misfit(const Schema& schema, const Map& given) {
  const std::vector<Fault> faults = part_faults(schema, given, 1);
  return faults.empty() ? std::string() : place_and_message(faults.front());
}

// ---- data ----

namespace {

List strings(const std::vector<std::string>& words) {
  List out;
  for (const std::string& w : words) out.emplace_back(w);
  return out;
}

List choice_values(const std::vector<WordInfo>& words) {
  List out;
  for (const WordInfo& w : words) {
    Map one{{"word", w.word}, {"label", word_label(w)}};
    if (!w.doc.empty()) one.set("doc", w.doc);
    out.emplace_back(std::move(one));
  }
  return out;
}

List param_values(const Schema& fields) {
  List out;
  for (const ParamSpec& p : fields) out.emplace_back(param_value(p));
  return out;
}

/// Kinds whose word says everything.
bool is_simple(const TypeTree& t) {
  return t.words.empty() && t.choices.empty() && t.fields.empty() && t.cases.empty() &&
         t.options.empty() && !t.element && t.of.empty() && t.word.empty() && t.rows == 0 &&
         t.cols == 0;
}

}  // namespace

Value type_value(const TypeTree& t) {
  Map m{{"kind", kind_word(t.kind)}};
  if (!t.unit.empty()) m.set("unit", t.unit);
  if (t.count) m.set("count", t.count);
  switch (t.kind) {
    case TypeKind::word:
      if (!t.choices.empty()) m.set("choices", choice_values(t.choices));
      break;
    case TypeKind::path:
      if (!t.word.empty()) m.set("for", t.word);
      if (!t.words.empty()) m.set("patterns", strings(t.words));
      break;
    case TypeKind::vector:
      if (!t.words.empty()) m.set("components", strings(t.words));
      break;
    case TypeKind::matrix:
      if (t.rows) m.set("rows", t.rows);
      if (t.cols) m.set("cols", t.cols);
      break;
    case TypeKind::pose: {
      List names;
      for (const std::string_view name : kPoseFields) names.emplace_back(name);
      m.set("representations", std::move(names));
      break;
    }
    case TypeKind::reference: m.set("kinds", strings(t.words)); break;
    case TypeKind::provider:
      m.set("interfaces", strings(t.words));
      m.set("takes_params", !t.is_name_only);
      break;
    case TypeKind::member: m.set("member", t.word); break;
    case TypeKind::joints: m.set("quantity", t.word.empty() ? "position" : t.word); break;
    case TypeKind::script: m.set("language", t.word); break;
    case TypeKind::named: m.set("name", t.word); break;
    case TypeKind::table: m.set("columns", param_values(t.fields)); break;
    case TypeKind::map:
      if (!t.fields.empty()) m.set("fields", param_values(t.fields));
      break;
    case TypeKind::variant: {
      m.set("decided_by", t.decided_by);
      List cases;
      for (const auto& [word, fields] : t.cases)
        cases.emplace_back(
            Map{{"word", word}, {"label", word_label({word})}, {"fields", param_values(fields)}});
      m.set("cases", std::move(cases));
      break;
    }
    case TypeKind::one_of: {
      List options;
      for (const auto& option : t.options) options.push_back(type_value(*option));
      m.set("options", std::move(options));
      break;
    }
    default: break;
  }
  if (!t.of.empty()) m.set("of", t.of);
  if (t.element) m.set("element", type_value(*t.element));
  if (t.is_unchecked) m.set("read_by", "command");
  return m;
}

Map param_value(const ParamSpec& p, bool is_input) {
  const TypeTree& t = type_tree(p.type);
  const std::string unit = unit_of(p);
  const std::string_view plain = plain_type(p.type);
  Map m{{"name", p.name}, {"type", plain}, {"unit", unit}, {"doc", p.doc}};
  if (plain != p.type) m.set("declared", p.type);
  if (!is_simple(t)) m.set("form", type_value(t));
  if (is_input) {
    m.set("required", p.required);
    if (p.default_value) m.set("default", *p.default_value);
    if (p.min == kPositive) m.set("above", 0.0);
    else if (std::isfinite(p.min)) m.set("min", p.min);
    if (std::isfinite(p.max)) m.set("max", p.max);
    if (p.infinite) m.set("infinite", true);
  }
  const std::vector<WordInfo> words = words_of(p);
  if (!words.empty()) {
    List choices;
    for (const WordInfo& w : words) choices.emplace_back(w.word);
    m.set("choices", std::move(choices));
    m.set("words", choice_values(words));
  }
  const TypeNotes& n = t.notes;
  const auto set = [&m](const char* name, const std::string& text) {
    if (!text.empty()) m.set(name, text);
  };
  set("label", n.label.empty() ? p.label : n.label);
  set("group", n.group.empty() ? p.group : n.group);
  if (n.order != 0) m.set("order", n.order);
  if (n.is_advanced) m.set("advanced", true);
  set("when", n.when.text());
  if (n.step > 0) m.set("step", n.step);
  if (n.is_logarithmic) m.set("logarithmic", true);
  if (!unit.empty())
    set("shown_unit", n.shown_unit.empty() ? std::string(shown_unit_of(unit)) : n.shown_unit);
  if (n.example) m.set("example", *n.example);
  set("since", n.since);
  set("deprecated", n.deprecated);
  set("effect", n.effect);
  return m;
}

// ---- JSON Schema ----

namespace {

class JsonSchema {
 public:
  Map of(const TypeTree& t) {
    switch (t.kind) {
      case TypeKind::any: return {};
      case TypeKind::nothing: return Map{{"type", "null"}};
      case TypeKind::boolean: return Map{{"type", "boolean"}};
      case TypeKind::integer: return Map{{"type", "integer"}};
      case TypeKind::real: return with_unit(t, Map{{"type", List{"number", "string"}}});
      case TypeKind::expression: return with_unit(t, Map{{"type", List{"number", "string"}}});
      case TypeKind::text: return Map{{"type", "string"}};
      case TypeKind::script: return Map{{"type", "string"}, {"x-language", t.word}};
      case TypeKind::word: {
        if (t.choices.empty()) return Map{{"type", "string"}};
        return annotated(t.choices);
      }
      case TypeKind::path: {
        Map m{{"type", "string"}, {"minLength", 1}};
        if (!t.word.empty()) m.set("x-path", t.word);
        return m;
      }
      case TypeKind::colour:
        return Map{{"anyOf",
                    List{Map{{"type", "string"}, {"pattern", "^#[0-9a-fA-F]{6}([0-9a-fA-F]{2})?$"}},
                         Map{{"type", "array"},
                             {"items", Map{{"type", "number"}}},
                             {"minItems", 3},
                             {"maxItems", 4}}}}};
      case TypeKind::vector: return with_unit(t, numbers(t.count));
      case TypeKind::joints: {
        Map m{{"anyOf", List{numbers(0), Map{{"type", "array"}, {"items", numbers(0)}}}}};
        if (!t.of.empty()) m.set("x-joints-of", t.of);
        return m;
      }
      case TypeKind::pose:
        return Map{{"anyOf", List{numbers(6), matrix(4, 4), Map{{"type", "object"}},
                                  Map{{"type", "string"}}}}};
      case TypeKind::matrix: return with_unit(t, matrix(t.rows, t.cols));
      case TypeKind::list: {
        Map m{{"type", "array"}};
        if (t.element) m.set("items", of(*t.element));
        return m;
      }
      case TypeKind::map: {
        Map m = t.fields.empty() ? Map{{"type", "object"}} : object(t.fields);
        if (t.element) m.set("additionalProperties", of(*t.element));
        return m;
      }
      case TypeKind::table: return Map{{"type", "array"}, {"items", object(t.fields)}};
      case TypeKind::variant: {
        List cases;
        for (const auto& [word, fields] : t.cases) {
          ParamSpec decides;
          decides.name = t.decided_by;
          decides.type = "enum";
          decides.choices = {word};
          decides.required = true;
          Schema all{std::move(decides)};
          all.insert(all.end(), fields.begin(), fields.end());
          cases.emplace_back(object(all));
        }
        return Map{{"oneOf", std::move(cases)}};
      }
      case TypeKind::one_of: {
        List options;
        for (const auto& option : t.options) options.emplace_back(of(*option));
        return Map{{"anyOf", std::move(options)}};
      }
      case TypeKind::reference:
        return Map{{"type", "string"}, {"x-record", text::join(t.words, "|")}};
      case TypeKind::handle: return Map{{"type", "string"}};
      case TypeKind::array: return Map{{"type", "array"}};
      case TypeKind::member: {
        Map m{{"type", "string"}, {"x-member", t.word}};
        if (!t.of.empty()) m.set("x-of", t.of);
        return m;
      }
      case TypeKind::provider: {
        const std::string interfaces = text::join(t.words, "|");
        if (t.is_name_only) return Map{{"type", "string"}, {"x-provider", interfaces}};
        return Map{{"anyOf", List{Map{{"type", "string"}},
                                  Map{{"type", "object"},
                                      {"properties", Map{{"name", Map{{"type", "string"}}},
                                                         {"params", Map{{"type", "object"}}}}},
                                      {"additionalProperties", false}}}},
                   {"x-provider", interfaces}};
      }
      case TypeKind::named:
        if (!definitions_.contains(t.word)) {
          definitions_[t.word] = Map();  // it may contain itself
          if (const TypeTree* named = named_type(t.word)) definitions_[t.word] = of(*named);
        }
        return Map{{"$ref", "#/$defs/" + t.word}};
    }
    return {};
  }

  Map object(const Schema& fields) {
    Map properties;
    List required;
    for (const ParamSpec& p : fields) {
      const TypeTree& t = type_tree(p.type);
      Map one = of(t);
      if (t.kind == TypeKind::word && t.choices.empty() && !p.choices.empty())
        one = annotated(words_of(p));
      if (!p.doc.empty()) one.set("description", p.doc);
      const TypeNotes notes = notes_of(p);
      if (!notes.label.empty()) one.set("title", notes.label);
      if (p.default_value && !p.default_value->as_handle()) one.set("default", *p.default_value);
      if (notes.example) one.set("examples", List{*notes.example});
      if (!notes.deprecated.empty()) one.set("deprecated", true);
      if (p.min == kPositive) one.set("exclusiveMinimum", 0.0);
      else if (std::isfinite(p.min)) one.set("minimum", p.min);
      if (std::isfinite(p.max)) one.set("maximum", p.max);
      if (const std::string unit = unit_of(p); !unit.empty()) one.set("x-unit", unit);
      if (!notes.when.is_always()) one.set("x-when", notes.when.text());
      properties.set(p.name, std::move(one));
      if (p.required) required.emplace_back(p.name);
    }
    Map m{{"type", "object"}, {"properties", std::move(properties)}};
    if (!required.empty()) m.set("required", std::move(required));
    m.set("additionalProperties", false);
    return m;
  }

  Map definitions() {
    Map out;
    for (auto& [name, one] : definitions_) out.set(name, one);
    return out;
  }

 private:
  /// One of several words; for forms each with its label and description.
  static Map annotated(const std::vector<WordInfo>& infos) {
    List words, described;
    for (const WordInfo& w : infos) {
      words.emplace_back(w.word);
      Map one{{"const", w.word}, {"title", word_label(w)}};
      if (!w.doc.empty()) one.set("description", w.doc);
      described.emplace_back(std::move(one));
    }
    return Map{{"enum", std::move(words)}, {"oneOf", std::move(described)}};
  }
  static Map numbers(std::size_t count) {
    Map m{{"type", "array"}, {"items", Map{{"type", List{"number", "string"}}}}};
    if (count) {
      m.set("minItems", count);
      m.set("maxItems", count);
    }
    return m;
  }
  static Map matrix(std::size_t rows, std::size_t cols) {
    Map m{{"type", "array"}, {"items", numbers(cols)}};
    if (rows) {
      m.set("minItems", rows);
      m.set("maxItems", rows);
    }
    return m;
  }
  static Map with_unit(const TypeTree& t, Map m) {
    if (!t.unit.empty()) m.set("x-unit", t.unit);
    return m;
  }
  std::map<std::string, Map> definitions_;
};

}  // namespace

Map json_schema(const Schema& schema, std::string_view title, std::string_view doc) {
  JsonSchema maker;
  Map m{{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", title}};
  if (!doc.empty()) m.set("description", doc);
  for (auto& [name, value] : maker.object(schema)) m.set(name, value);
  if (Map defs = maker.definitions(); !defs.empty()) m.set("$defs", std::move(defs));
  return m;
}

// ---- rows of forms ----

const Value* form_value(const Schema& schema, const Map& filled, std::string_view name) {
  const std::string_view first = name.substr(0, name.find('.'));
  const Value* v = filled.find(first);
  if (!v)
    if (const ParamSpec* p = find_param(schema, first); p && p->default_value)
      v = &*p->default_value;
  while (v && name.find('.') != std::string_view::npos) {
    name.remove_prefix(name.find('.') + 1);
    v = v->as_map() ? v->as_map()->find(name.substr(0, name.find('.'))) : nullptr;
  }
  return v;
}

std::string form_label(const ParamSpec& p) {
  const TypeNotes& notes = type_tree(p.type).notes;
  if (!notes.label.empty()) return notes.label;
  return p.label.empty() ? p.name : p.label;
}

std::vector<FormRow> form_rows(const Schema& schema, const Map& filled) {
  const auto value_of = [&](std::string_view name) { return form_value(schema, filled, name); };
  std::vector<FormRow> rows;
  for (const ParamSpec& p : schema) {
    TypeNotes notes = notes_of(p);
    if (!notes.when.holds(value_of) && !filled.find(p.name)) continue;
    rows.push_back({&p, std::move(notes)});
  }
  std::vector<std::string> groups;
  for (const FormRow& row : rows)
    if (std::find(groups.begin(), groups.end(), row.notes.group) == groups.end())
      groups.push_back(row.notes.group);
  std::stable_sort(rows.begin(), rows.end(), [&groups](const FormRow& a, const FormRow& b) {
    const auto at = [&groups](const FormRow& row) {
      return std::find(groups.begin(), groups.end(), row.notes.group);
    };
    return at(a) != at(b) ? at(a) < at(b) : a.notes.order < b.notes.order;
  });
  return rows;
}

// ---- parameters from their descriptions ----

Result<ParamSpec> param_from(const Value& described) {
  const Map* m = described.as_map();
  const auto text = [m](const char* name) {
    const Value* v = m ? m->find(name) : nullptr;
    return v && v->as_string() ? *v->as_string() : std::string();
  };
  ParamSpec p;
  p.name = text("name");
  p.type = text("declared").empty() ? text("type") : text("declared");
  if (p.name.empty() || p.type.empty())
    return error(ErrorCode::invalid_argument, "a description of a parameter has no name or no type",
                 "Use the result of ioci.describe, record.schema or provider.params.");
  RMP_TRY_ASSIGN(const auto tree, parse_type(p.type));
  // A unit in the text of the type is not repeated.
  if (tree->unit.empty()) p.unit = text("unit");
  p.doc = text("doc");
  p.label = tree->notes.label.empty() ? text("label") : std::string();
  p.group = tree->notes.group.empty() ? text("group") : std::string();
  if (const Value* v = m->find("required")) p.required = v->as_bool() && *v->as_bool();
  if (const Value* v = m->find("default")) p.default_value = *v;
  if (m->find("above")) p.min = kPositive;
  if (const Value* v = m->find("min"); v && v->is_number()) p.min = v->number();
  if (const Value* v = m->find("max"); v && v->is_number()) p.max = v->number();
  if (const Value* v = m->find("infinite")) p.infinite = v->as_bool() && *v->as_bool();
  if (const Value* v = m->find("choices"); v && v->as_list() && tree->choices.empty())
    for (const Value& word : *v->as_list())
      if (word.as_string()) p.choices.push_back(*word.as_string());
  return p;
}

Result<Schema> schema_from_values(const Value& described) {
  Schema out;
  const List* list = described.as_list();
  if (!list)
    return error(ErrorCode::invalid_argument, "descriptions of parameters are not a list",
                 "Use `params` of ioci.describe, or `form` of record.schema.");
  for (const Value& each : *list) {
    RMP_TRY_ASSIGN(ParamSpec p, param_from(each));
    out.push_back(std::move(p));
  }
  return out;
}

// ---- plain text ----

namespace {

void form_lines(std::string& out, const Schema& schema, const Map& filled, std::size_t indent,
                std::size_t depth) {
  constexpr std::size_t kDeepest = 8;  // a type may contain itself
  const std::string margin(indent, ' ');
  std::string group;
  for (const FormRow& l : form_rows(schema, filled)) {
    const ParamSpec& p = *l.param;
    if (l.notes.group != group) {
      group = l.notes.group;
      if (!group.empty()) out += margin + group + "\n";
    }
    const TypeTree* t = &type_tree(p.type);
    out += margin + (p.required ? "* " : "  ") + form_label(p) + ": " + type_words(*t);
    if (const std::string unit = unit_of(p); !unit.empty() && t->unit.empty()) {
      const std::string shown =
          l.notes.shown_unit.empty() ? std::string(shown_unit_of(unit)) : l.notes.shown_unit;
      out += " [" + shown + "]";
    }
    if (t->choices.empty() && !p.choices.empty()) out += " " + text::join(p.choices, "|");
    if (const Value* v = form_value(schema, filled, p.name)) out += " = " + shown_value(*v);
    if (!p.doc.empty()) out += "  " + p.doc;
    out += "\n";
    if (depth >= kDeepest) continue;
    while (t->kind == TypeKind::list && t->element) t = t->element.get();
    if (t->kind == TypeKind::named)
      if (const TypeTree* named = named_type(t->word)) t = named;
    const Value* given = filled.find(p.name);
    const Map* part = given ? given->as_map() : nullptr;
    if (given && given->as_list() && !given->as_list()->empty())
      part = given->as_list()->front().as_map();
    if (!t->fields.empty()) form_lines(out, t->fields, part ? *part : Map(), indent + 4, depth + 1);
    if (t->kind == TypeKind::variant && part)
      if (const Value* word = part->find(t->decided_by); word && word->as_string())
        for (const auto& [name, fields] : t->cases)
          if (name == *word->as_string()) form_lines(out, fields, *part, indent + 4, depth + 1);
  }
}

}  // namespace

std::string form_text(const Schema& schema, const Map& filled) {
  std::string out;
  form_lines(out, schema, filled, 0, 0);
  return out;
}

}  // namespace robomosp
