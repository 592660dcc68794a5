// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/record_params.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "ioci/core/commands.h"
#include "kernel/check.h"
#include "kernel/text.h"
#include "kernel/type.h"
#include "model/data.h"
#include "model/field_types.h"
#include "model/kind.h"
#include "model/records.h"

namespace robomosp::ioci {
namespace {

using model::Field;
using model::Shape;
using model::Type;
using model::type_of;

/// The type without optional, shared and list around it.
const Type* held_type(const Type* t) {
  while (t->element) t = t->element;
  return t;
}

const Type& struct_at(std::string_view kind, std::string_view path) {
  const auto k = kind_from(kind);
  RMP_CHECK(k, std::string(kind).c_str());
  const Type* t = model::info(*k).type;
  for (const std::string_view name : text::split(path, '.')) {
    if (name.empty()) continue;
    const Field* f = t->field(name);
    RMP_CHECK(f, std::string(path).c_str());
    t = held_type(f->type);
  }
  RMP_CHECK(t->shape == Shape::structure, std::string(path).c_str());
  return *t;
}

std::string below_path(std::string_view path, std::string_view name) {
  return path.empty() ? std::string(name) : std::string(path) + "." + std::string(name);
}

bool is_flat(const Field& f) { return f.is_path_flat || f.is_value_flat; }

/// Notes of a field whose fields are among those of its owner.
std::string notes_of_field(std::string_view kind, const std::string& path) {
  for (const model::FieldNote& n : model::field_notes())
    if (n.kind == kind && n.path == path && n.type.starts_with('@')) return std::string(n.type);
  return {};
}

/// "enum(a|b) @when(...)" as an enum with choices, as commands declare it.
void give_choices(ParamSpec& p) {
  const TypeTree& tree = type_tree(p.type);
  if (tree.kind != TypeKind::word || tree.choices.empty()) return;
  const auto is_described = [](const WordInfo& w) { return !w.doc.empty() || !w.label.empty(); };
  if (std::any_of(tree.choices.begin(), tree.choices.end(), is_described)) return;
  for (const WordInfo& w : tree.choices) p.choices.push_back(w.word);
  const std::size_t end = p.type.find(')');
  p.type = "enum" + p.type.substr(end + 1);
}

void add_params(std::string_view kind, const std::string& path, const Type& t,
                const std::string& frame, const std::string& notes, Schema& out) {
  for (const Field& f : t.fields) {
    if (f.is_read_only || f.type == &type_of<model::Parametric>()) continue;
    const std::string at = below_path(path, f.name);
    const Type* held = f.type->shape == Shape::optional ? f.type->element : f.type;
    if (f.type == &type_of<model::Placement>() && is_flat(f)) {
      for (ParamSpec& p : placement_fields(frame)) {
        if (!notes.empty()) p.type += " " + notes;
        out.push_back(std::move(p));
      }
      continue;
    }
    if (held->shape == Shape::structure && is_flat(f)) {
      add_params(kind, at, *held, frame, notes_of_field(kind, at), out);
      continue;
    }
    ParamSpec p = model::field_param(kind, at, f);
    p.required = false;
    if (!notes.empty()) p.type += " " + notes;
    give_choices(p);
    out.push_back(std::move(p));
  }
}

bool is_named(std::initializer_list<std::string_view> names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// "m" of "rad|m" and 1.
std::string_view one_unit(std::string_view unit, std::size_t alternative) {
  const std::vector<std::string_view> units = text::split(unit, '|');
  return units[std::min(alternative, units.size() - 1)];
}

bool is_empty_value(const Value& v) {
  return (v.as_bool() && !*v.as_bool()) || (v.as_string() && v.as_string()->empty());
}

}  // namespace

Schema record_params(std::string_view kind, std::string_view path, const std::string& frame) {
  Schema out;
  add_params(kind, std::string(path), struct_at(kind, path), frame, {}, out);
  return out;
}

ParamSpec& param_named(Schema& schema, std::string_view name) {
  const ParamSpec* p = find_param(schema, name);
  RMP_CHECK(p, std::string(name).c_str());
  return schema[static_cast<std::size_t>(p - schema.data())];
}

Schema without(Schema schema, std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    const ParamSpec& p = param_named(schema, name);
    schema.erase(schema.begin() + (&p - schema.data()));
  }
  return schema;
}

Schema led_by(std::initializer_list<std::string_view> names, Schema schema) {
  Schema out;
  for (const std::string_view name : names) out.push_back(param_named(schema, name));
  for (ParamSpec& p : schema)
    if (!is_named(names, p.name)) out.push_back(std::move(p));
  return out;
}

Schema units_by_joint(Schema schema) {
  constexpr std::string_view kReal = "real";
  for (ParamSpec& p : schema) {
    if (p.unit.find('|') == std::string::npos || !p.type.starts_with(kReal)) continue;
    p.type = "any<real [" + p.unit + "]" + (p.infinite ? " @infinite" : "") + ">" +
             p.type.substr(kReal.size());
  }
  return schema;
}

Schema plain_params(Schema schema, std::size_t alternative) {
  for (ParamSpec& p : schema) {
    const TypeTree& tree = type_tree(p.type);
    if (p.choices.empty())
      for (const WordInfo& w : tree.choices) p.choices.push_back(w.word);
    p.unit = one_unit(unit_of(p), alternative);
    p.type = std::string(plain_type(p.type));
  }
  return schema;
}

Result<void> set_fields(const Type& t, void* to, const Map& checked,
                        std::initializer_list<std::string_view> except) {
  for (const Field& f : t.fields) {
    if (f.is_read_only || is_named(except, f.name)) continue;
    if (f.type == &type_of<model::Placement>() || f.type == &type_of<model::Parametric>()) continue;
    if (f.type->shape == Shape::structure && is_flat(f)) {
      RMP_TRY(set_fields(*f.type, f.in(to), checked, except));
      continue;
    }
    RMP_TRY(set_field(f, to, checked));
  }
  return {};
}

Result<void> set_field(const Field& f, void* owner, const Map& checked) {
  if (!has(checked, f.name)) return {};
  RMP_TRY(set_checked_value(*f.type, f, f.in(owner), *checked.find(f.name)));
  return {};
}

Result<bool> set_checked_value(const Type& t, const Field& f, void* p, const Value& v) {
  if (&t == &type_of<model::ProviderChoice>()) {
    RMP_TRY_ASSIGN(*static_cast<model::ProviderChoice*>(p), read_provider(v, f.name));
    return true;
  }
  switch (t.shape) {
    case Shape::boolean: *static_cast<bool*>(p) = v.as_bool() && *v.as_bool(); return true;
    case Shape::integer:
      if (!f.index_in.empty()) return false;
      t.set_whole(p, v.as_int() ? *v.as_int() : 0);
      return true;
    case Shape::real: *static_cast<double*>(p) = v.number(); return true;
    case Shape::text:
      if (!v.as_string()) return false;
      *static_cast<std::string*>(p) = *v.as_string();
      return true;
    case Shape::word:
      for (const Type::Word& w : t.words)
        if (v.as_string() && *v.as_string() == w.word) t.set_whole(p, w.value);
      return true;
    case Shape::numbers: {
      const std::vector<double> numbers = reals(&v);
      if (numbers.size() != t.count) return false;
      std::copy(numbers.begin(), numbers.end(), static_cast<double*>(p));
      return true;
    }
    case Shape::reals:
      if (f.si_unit == model::kByJoint) return false;
      *static_cast<std::vector<double>*>(p) = reals(&v);
      return true;
    case Shape::colour: {
      RMP_TRY_ASSIGN(*static_cast<Colour*>(p), read_colour(v, f.name));
      return true;
    }
    case Shape::reference: {
      const Handle* h = v.as_handle();
      const auto kind = h ? kind_from(h->kind) : std::nullopt;
      t.set_id(p, kind ? AnyId{*kind, h->number} : AnyId{});
      return true;
    }
    case Shape::optional:
      if (is_empty_value(v)) {
        t.drop(p);
        return true;
      }
      // What is left to the command must not be made here.
      if (t.element->shape == Shape::structure) return false;
      return set_checked_value(*t.element, f, t.hold(p), v);
    default: return false;
  }
}

std::optional<Value> plain_value(const document::Snapshot* snapshot, const Type& t, const Field& f,
                                 const void* p, std::string_view unit) {
  switch (t.shape) {
    case Shape::structure:
      if (&t == &type_of<model::Placement>())
        return placement_value(*static_cast<const model::Placement*>(p));
      if (&t == &type_of<model::ProviderChoice>())
        return provider_value(*static_cast<const model::ProviderChoice*>(p));
      return std::nullopt;
    case Shape::boolean: return *static_cast<const bool*>(p);
    case Shape::integer:
      if (!f.index_in.empty()) return std::nullopt;
      return t.whole(p);
    case Shape::real: {
      const double x = *static_cast<const double*>(p);
      return std::isfinite(x) ? Value(x) : Value();
    }
    case Shape::text: return *static_cast<const std::string*>(p);
    case Shape::word: return std::string(t.word_of(p));
    case Shape::numbers: {
      const auto* first = static_cast<const double*>(p);
      return NumericArray(std::vector<double>(first, first + t.count), std::string(unit));
    }
    case Shape::reals: return NumericArray(*static_cast<const std::vector<double>*>(p));
    case Shape::colour: return colour_value(*static_cast<const Colour*>(p));
    case Shape::reference: return snapshot ? ref_value(*snapshot, t.id(p)) : Value();
    default: return std::nullopt;
  }
}

Value changed_value(const document::Snapshot* snapshot, const Type& owner_type, const Field& f,
                    const void* owner) {
  const Type* t = f.type;
  const void* p = f.in(owner);
  if (model::equal({t, p}, {t, f.in(owner_type.standard.get())})) return {};
  if (t->shape == Shape::optional) {
    p = t->held(p);
    t = t->element;
  }
  return plain_value(snapshot, *t, f, p, f.unit_of(owner)).value_or(Value());
}

}  // namespace robomosp::ioci
