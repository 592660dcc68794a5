// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/forms/field_factory.h"

#include <cmath>

#include "kernel/text.h"
#include "kernel/type_forms.h"
#include "kernel/units.h"
#include "viewer/forms/composite_fields.h"
#include "viewer/theme/icons.h"
#include "viewer/widgets/choice_field.h"
#include "viewer/widgets/number_fields.h"
#include "viewer/widgets/simple_fields.h"

namespace robomosp::viewer {
namespace {

/// Names of arguments that logs and events do not show.
bool is_secret_name(std::string_view name) {
  for (const std::string_view word : {"token", "password", "passphrase", "secret", "credential"})
    if (name == word || name.ends_with("_" + std::string(word))) return true;
  return false;
}

std::vector<FieldChoice> words_as_choices(const ParamSpec& p) {
  std::vector<FieldChoice> out;
  for (const WordInfo& w : words_of(p))
    out.push_back({Value(w.word), qt(word_label(w)), qt(w.doc), {}});
  return out;
}

int axis_of(const std::vector<std::string>& names, std::size_t i, std::size_t count) {
  if (!names.empty()) return names[i] == "x" ? 0 : names[i] == "y" ? 1 : names[i] == "z" ? 2 : -1;
  return count == 3 ? static_cast<int>(i) : -1;
}

Field* vector_field(const FormContext& c, const TypeTree& t, const ParamSpec& p, QWidget* parent) {
  if (t.count == 0) return new VectorField(number_format(c, p), parent);
  // A unit may be one for each component: "m, rad, m".
  const std::string unit = unit_of(p);
  std::vector<std::string> units;
  for (const std::string_view u : text::split(unit, ',')) units.emplace_back(text::trim(u));
  std::vector<VectorField::Component> parts;
  for (std::size_t i = 0; i < t.count; ++i) {
    const std::string name = i < t.words.size() ? t.words[i]
                             : t.count == 3     ? std::string(1, "xyz"[i])
                                                : "";
    const bool has_own = units.size() == t.count;
    NumberFormat f = number_format(c, p, has_own ? units[i] : std::string());
    if (has_own) f.shown = std::string(shown_unit_of(units[i]));
    parts.push_back({name, f, axis_of(t.words, i, t.count)});
  }
  return new VectorField(std::move(parts), parent);
}

/// Values that are typed or chosen in one line; null for others.
Field* line_field(const FormContextPtr& c, const TypeTree& t, const ParamSpec& p,
                  const std::string& path, QWidget* parent) {
  switch (t.kind) {
    case TypeKind::boolean: {
      auto* f = new BoolField(parent);
      f->set_note(qt(p.doc));
      return f;
    }
    case TypeKind::integer:
    case TypeKind::real:
    case TypeKind::expression: return new NumberField(number_format(*c, p), parent);
    case TypeKind::word: {
      auto* f = new ChoiceField(parent);
      f->set_choices(words_as_choices(p));
      return f;
    }
    case TypeKind::text: {
      auto* f = new TextField(parent);
      f->set_secret(is_secret_name(p.name));
      return f;
    }
    case TypeKind::path:
      return new PathField(t.word == "save"     ? PathField::For::save
                           : t.word == "folder" ? PathField::For::folder
                                                : PathField::For::open,
                           t.words, parent);
    case TypeKind::colour: return new ColourField(parent);
    case TypeKind::script: return new ScriptField(parent);
    case TypeKind::reference:
    case TypeKind::handle:
    case TypeKind::member: {
      auto* f = new ChoiceField(parent);
      f->set_takes_text(true);
      if (t.kind == TypeKind::member) f->set_icon(icon_of_kind(t.word));
      else if (!t.words.empty() && t.words.front() != "any")
        f->set_icon(icon_of_kind(t.words.front()));
      ask_choices(f, c, path);
      if (t.kind == TypeKind::reference && t.words == std::vector<std::string>{"material"})
        ask_material_looks(f, c);
      return f;
    }
    case TypeKind::provider: {
      if (!t.is_name_only) return nullptr;
      auto* f = new ChoiceField(parent);
      f->set_takes_text(true);
      ask_choices(f, c, path);
      return f;
    }
    case TypeKind::vector: return t.count == 0 ? nullptr : vector_field(*c, t, p, parent);
    case TypeKind::any:
    case TypeKind::nothing:
    case TypeKind::array: return new LiteralField(parent);
    case TypeKind::pose:
    case TypeKind::matrix:
    case TypeKind::list:
    case TypeKind::map:
    case TypeKind::table:
    case TypeKind::variant:
    case TypeKind::one_of:
    case TypeKind::joints:
    case TypeKind::named: return nullptr;
  }
  return nullptr;
}

/// Names, limits and units of the joints of the robot that the argument `of` names, once they are
/// known.
void ask_joints(VectorField* field, const FormContextPtr& c, const TypeTree& t) {
  const Map given = c->given ? c->given() : Map();
  // A member of a world names its robot; elsewhere the argument `of` does.
  const Value* id = t.of.empty() ? nullptr : given.find(t.of);
  if (!id && c->of.find("kind")) id = given.find("robot");
  if (!id) id = c->also_given.find("id");
  if (!id || !c->client) return;
  const std::string per = t.word == "velocity" ? "/s" : t.word == "acceleration" ? "/s^2" : "";
  const bool is_force = t.word == "force", is_position = per.empty() && !is_force;
  ask(*c->client, "robot.describe", Map{{"id", *id}}, field,
      [field, per, is_force, is_position](const Result<Value>& r) {
        const Value* links = r.ok() && r->as_map() ? r->as_map()->find("links") : nullptr;
        if (!links || !links->as_list()) return;
        std::vector<VectorField::Component> joints;
        for (const Value& link : *links->as_list()) {
          const Map* m = link.as_map();
          if (!m) return;
          const auto word = [m](const char* name) {
            const Value* v = m->find(name);
            return v && v->as_string() ? *v->as_string() : std::string();
          };
          const std::string joint = word("joint");
          const Value* leads = m->find("mimic");
          if (joint == "fixed" || (leads && !leads->is_nil())) continue;
          const bool is_angle = joint != "prismatic";
          NumberFormat f;
          f.unit = is_force ? (is_angle ? "N m" : "N") : (is_angle ? "rad" : "m") + per;
          f.shown = std::string(shown_unit_of(f.unit));
          const Value *lower = m->find("lower"), *upper = m->find("upper");
          if (is_position && lower && lower->is_number()) f.min = lower->number();
          if (is_position && upper && upper->is_number()) f.max = upper->number();
          joints.push_back({word("name"), f, -1});
        }
        // Other counts are rows of several configurations, or joints that follow.
        const std::size_t now = field->fields().size();
        if (!joints.empty() && (now == 0 || now == joints.size()))
          field->set_components(std::move(joints));
      });
}

/// The record or member of a value that may also be its number; null for other types.
const TypeTree* named_or_numbered(const TypeTree& t) {
  const TypeTree* named = nullptr;
  if (t.kind != TypeKind::one_of) return nullptr;
  for (const auto& option : t.options) {
    if (option->kind == TypeKind::member || option->kind == TypeKind::reference) {
      if (named) return nullptr;
      named = option.get();
    } else if (option->kind != TypeKind::integer) {
      return nullptr;
    }
  }
  return named;
}

ParamSpec element_param(const TypeTree* element, const ParamSpec& outer) {
  ParamSpec p;
  p.type = element ? type_text(*element) : "any";
  p.name = outer.name;
  p.doc = outer.doc;
  if (!element || element->unit.empty()) p.unit = outer.unit;
  p.min = outer.min;
  p.max = outer.max;
  p.infinite = outer.infinite;
  return p;
}

}  // namespace

NumberFormat number_format(const FormContext& context, const ParamSpec& p, std::string_view unit) {
  NumberFormat f;
  const TypeTree& t = type_tree(p.type);
  f.unit = unit.empty() ? unit_of(p) : std::string(unit);
  // Of joints of both kinds the unit follows from another argument.
  if (f.unit.find('|') != std::string::npos || f.unit.find(" or ") != std::string::npos ||
      f.unit.find(',') != std::string::npos)
    f.unit.clear();
  f.shown = t.notes.shown_unit.empty() || !unit.empty() ? std::string(shown_unit_of(f.unit))
                                                        : t.notes.shown_unit;
  f.min = t.notes.min ? *t.notes.min : p.min;
  f.max = t.notes.max ? *t.notes.max : p.max;
  f.step = t.notes.step;
  f.is_logarithmic = t.notes.is_logarithmic;
  f.is_whole = t.kind == TypeKind::integer;
  f.takes_infinity = p.infinite || t.notes.is_infinite;
  f.takes_expressions = context.takes_expressions || t.kind == TypeKind::expression;
  if (f.takes_expressions) f.names = context.parameter_names;
  return f;
}

QString short_type_name(const TypeTree& t) {
  switch (t.kind) {
    case TypeKind::boolean: return "yes or no";
    case TypeKind::integer:
    case TypeKind::real: return "number";
    case TypeKind::expression: return "expression";
    case TypeKind::text: return "text";
    case TypeKind::word: return "word";
    case TypeKind::path: return "file";
    case TypeKind::vector: return "numbers";
    case TypeKind::joints: return "joints";
    case TypeKind::matrix: return "matrix";
    case TypeKind::pose: return "pose";
    case TypeKind::list:
      return t.element ? "list: " + short_type_name(*t.element) : QString("list");
    case TypeKind::table: return "table";
    case TypeKind::map: return "fields";
    case TypeKind::reference: return qt(text::join(t.words, " or "));
    case TypeKind::member: return qt(t.word);
    case TypeKind::provider: return "solver";
    case TypeKind::named: return qt(t.word);
    case TypeKind::colour: return "colour";
    case TypeKind::script: return qt(t.word);
    default: return qt(type_words(t));
  }
}

Field* make_part(const FormContextPtr& c, const TypeTree& t, const ParamSpec& p,
                 const std::string& path, QWidget* parent) {
  switch (t.kind) {
    case TypeKind::pose: {
      auto* f = new PoseField(parent);
      const auto source = [f](const std::function<void(std::function<void(const Value&)>)>& of)
          -> std::function<void()> {
        if (!of) return {};
        return [field = QPointer<PoseField>(f), of] {
          of([field](const Value& v) {
            if (!field) return;
            field->set_value(v);
            field->set_pose(field->pose());
          });
        };
      };
      f->set_sources(source(c->pose_of_selection), source(c->pose_of_view));
      return f;
    }
    case TypeKind::matrix: return new MatrixField(t.rows, t.cols, number_format(*c, p), parent);
    case TypeKind::joints: {
      auto* f = static_cast<VectorField*>(vector_field(*c, t, p, parent));
      ask_joints(f, c, t);
      return f;
    }
    case TypeKind::vector: return vector_field(*c, t, p, parent);
    case TypeKind::list: return new ListField(c, element_param(t.element.get(), p), path, parent);
    case TypeKind::table: {
      ParamSpec row = p;
      row.type = map_type(t.fields);
      return new ListField(c, row, path, parent);
    }
    case TypeKind::map:
      if (t.fields.empty()) return new MapField(c, element_param(t.element.get(), p), path, parent);
      return new FieldsField(c, t, path, parent);
    case TypeKind::variant: return new FieldsField(c, t, path, parent);
    case TypeKind::provider:
      if (!t.is_name_only) return new ProviderField(c, t, path, parent);
      break;
    case TypeKind::named:
      if (const TypeTree* named = named_type(t.word)) {
        ParamSpec inner = p;
        inner.type = type_text(*named);
        if (named->kind == TypeKind::one_of) return new OptionsField(c, inner, path, parent);
        return make_part(c, *named, inner, path, parent);
      }
      break;
    default: break;
  }
  if (Field* f = line_field(c, t, p, path, parent)) return f;
  return new LiteralField(parent);
}

Field* make_field(const FormContextPtr& context, const ParamSpec& p, const std::string& path,
                  QWidget* parent) {
  const TypeTree& t = type_tree(p.type);
  Field* field = line_field(context, t, p, path, parent);
  if (!field && t.kind == TypeKind::provider) field = new ProviderField(context, t, path, parent);
  if (const TypeTree* named = field ? nullptr : named_or_numbered(t)) {
    field = line_field(context, *named, p, path, parent);
    static_cast<ChoiceField*>(field)->set_takes_numbers(true);
  }
  if (!field) field = new OptionsField(context, p, path, parent);
  QString doc = qt(p.doc);
  const TypeNotes notes = notes_of(p);
  if (const std::string unit = unit_of(p); !unit.empty())
    doc += " [" +
           unit_text(notes.shown_unit.empty() ? shown_unit_of(unit)
                                              : std::string_view(notes.shown_unit)) +
           "]";
  if (!notes.effect.empty()) doc += "\n" + qt(notes.effect);
  if (!notes.deprecated.empty()) doc += "\nDeprecated. " + qt(notes.deprecated);
  field->describe(qt(form_label(p)), doc, qt(context->title + "{" + path + " = }"),
                  qt(context->title + "." + path));
  if (p.default_value) field->set_default(p.default_value);
  return field;
}

}  // namespace robomosp::viewer
