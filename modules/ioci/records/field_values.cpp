// SPDX-License-Identifier: Apache-2.0
#include "ioci/records/field_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <variant>

#include "ioci/core/commands.h"
#include "ioci/core/expressions.h"
#include "ioci/core/record_params.h"
#include "ioci/records/solid_nodes.h"
#include "kernel/units.h"
#include "model/parametric.h"

namespace robomosp::ioci {

namespace {

using model::Content;
using model::Field;
using model::Shape;
using model::Type;
using model::type_of;

template <class T>
const T& as(const void* p) {
  return *static_cast<const T*>(p);
}

std::string kinds_text(std::span<const Kind> kinds) {
  std::string out;
  for (const Kind k : kinds) out += (out.empty() ? "" : "|") + std::string(to_string(k));
  return out.empty() ? "any" : out;
}

std::vector<OwnForm>& own_forms() {
  static std::vector<OwnForm> all;
  return all;
}

// ---- from a record to values ----

class Writer {
 public:
  Writer(const document::Snapshot& snapshot, const Content& record, std::string name)
      : snapshot_(snapshot), record_(record), name_(std::move(name)) {}

  void fields(Map& out, const Type& t, const void* p, std::size_t alternative) const {
    if (t.alternative) alternative = t.alternative(p);
    for (const Field& f : t.fields) {
      if (f.counts && !f.counts(p)) continue;
      const void* v = f.in(p);
      if (f.type == &type_of<model::Parametric>()) {
        const auto& own = as<model::Parametric>(v);
        if (!own.parameters.empty()) out.set("parameters", parameters_value(own));
        if (!own.expressions.empty()) out.set("expressions", expressions_map(own));
      } else if (f.is_value_flat) {
        fields(out, *f.type, v, alternative);
      } else if (Value value = this->value(*f.type, v, f, p, alternative); !value.is_nil()) {
        out.set(std::string(f.name), std::move(value));
        const std::vector<Kind>& kinds = f.kinds;
        if (f.type->shape == Shape::reference && kinds.size() > 1)
          out.set("kind", to_string(f.type->id(v).kind));
      }
    }
  }

 private:
  [[nodiscard]] Value value(const Type& t, const void* p, const Field& f, const void* owner,
                            std::size_t alternative) const {
    if (auto own = own_form(t, p)) return std::move(*own);
    const std::string_view unit =
        t.shape == Shape::numbers ? f.unit_of(owner, 0, alternative) : std::string_view();
    if (auto plain = plain_value(&snapshot_, t, f, p, unit)) return std::move(*plain);
    switch (t.shape) {
      case Shape::integer: return element(f, t.whole(p));
      case Shape::digest: {
        const auto& d = as<std::array<std::uint64_t, 2>>(p);
        return Fingerprint{d[0], d[1]}.hex();
      }
      case Shape::setting: return setting_value(as<model::ProviderChoice::Param>(p));
      case Shape::structure: {
        Map m;
        fields(m, t, p, alternative);
        return m;
      }
      case Shape::list: {
        List out;
        for (std::size_t i = 0; i < t.length(p); ++i)
          out.push_back(value(*t.element, t.at(p, i), f, owner, alternative));
        return out;
      }
      case Shape::optional:
      case Shape::shared: {
        const void* inner = t.held(p);
        return inner ? value(*t.element, inner, f, owner, alternative) : Value();
      }
      case Shape::table: {
        Map m;
        t.each(p, [&](const std::string& key, const void* v) {
          m.set(key, value(*t.element, v, f, owner, alternative));
        });
        return m;
      }
      default: break;
    }
    return {};
  }

  /// What the commands that make records take in a form of its own comes out in the same.
  [[nodiscard]] std::optional<Value> own_form(const Type& t, const void* p) const {
    if (t.shape != Shape::structure && t.shape != Shape::list) return std::nullopt;
    if (&t == &type_of<MassProperties>()) return mass_value(as<MassProperties>(p));
    if (&t == &type_of<model::MeasuredMass>()) {
      const auto& measured = as<model::MeasuredMass>(p);
      Map m = *mass_value(measured.mass).as_map();
      m.set("source", measured.source);
      return Value(std::move(m));
    }
    const model::Type* const element = t.shape == Shape::list ? t.element : nullptr;
    for (const OwnForm& form : OwnFormFile::all())
      if ((form.is_list ? element : &t) == &form.type())
        if (auto made = form.of(snapshot_, record_, p)) return made;
    if (!element) return std::nullopt;
    if (t.element == &type_of<model::NamedPose>()) {
      Map poses;
      for (const auto& pose : as<std::vector<model::NamedPose>>(p))
        poses.set(pose.name, NumericArray(pose.q));
      return Value(std::move(poses));
    }
    if (t.element == &type_of<model::SolidNode>() && record_.type == model::info(Kind::solid).type)
      return nodes(as<model::Solid>(record_.data));
    return std::nullopt;
  }
  [[nodiscard]] Value nodes(const model::Solid& s) const {
    List out;
    for (std::size_t i = 0; i < s.nodes.size(); ++i) {
      Map node = node_map(s, i, name_);
      node.erase("expressions");  // they are given for the solid
      if (s.nodes[i].parent >= 0)
        node.set("parent", s.nodes[static_cast<std::size_t>(s.nodes[i].parent)].name);
      out.emplace_back(std::move(node));
    }
    return out;
  }

  /// The name of the element of another list that an integer means.
  [[nodiscard]] Value element(const Field& f, std::int64_t i) const {
    const Field* list = record_.type->field(f.index_in);
    if (!list || i < 0) return f.index_in == "links" ? Value("base") : Value();
    const void* elements = list->in(record_.data);
    if (i >= static_cast<std::int64_t>(list->type->length(elements))) return i + 1;
    const std::string* name =
        model::name_of(*list->type->element, list->type->at(elements, static_cast<std::size_t>(i)));
    return name ? Value(*name) : Value(i + 1);
  }

  static Value setting_value(const model::ProviderChoice::Param& p) {
    return std::visit(
        [](const auto& x) -> Value {
          if constexpr (std::is_same_v<std::decay_t<decltype(x)>, std::vector<double>>)
            return NumericArray(x);
          else return x;
        },
        p);
  }

  const document::Snapshot& snapshot_;
  Content record_;
  std::string name_;  ///< of the record
};

// ---- schema ----

std::string_view type_word(const Type& t) {
  switch (t.shape) {
    case Shape::boolean: return "bool";
    case Shape::integer: return "int";
    case Shape::real: return "real";
    case Shape::text:
    case Shape::digest: return "string";
    case Shape::word: return "enum";
    case Shape::numbers: return t.count == 3 ? "vec3" : "real[]";
    case Shape::reals: return "real[]";
    case Shape::colour: return "colour";
    case Shape::reference: return "ref";
    case Shape::setting: return "any";
    case Shape::structure:
    case Shape::table: return "map";
    case Shape::list: return "list";
    case Shape::optional:
    case Shape::shared: return type_word(*t.element);
  }
  return "any";
}

/// Whether a field is made of numbers that can be expressions.
bool holds_reals(const Type& t) {
  const bool is_list = t.shape == Shape::list || t.shape == Shape::table;
  return t.shape == Shape::real || t.shape == Shape::numbers || t.shape == Shape::reals ||
         t.shape == Shape::setting || (is_list && holds_reals(*t.element));
}

Map field_map(const document::Snapshot& s, const Field& f, const void* standard) {
  const Type* inner = f.type;
  const bool is_optional = inner->shape == Shape::optional || inner->shape == Shape::shared;
  if (is_optional) inner = inner->element;
  Map m{{"name", f.name}, {"label", f.shown_name()}, {"doc", f.sentence}};
  if (inner->shape == Shape::reference) m.set("type", "ref:" + kinds_text(kinds_of(f, *inner)));
  else if (!f.index_in.empty()) m.set("type", "string");
  else m.set("type", type_word(*inner));
  if (!f.index_in.empty()) m.set("names", f.index_in);  // of an element of this list
  if (f.unit_at) m.set("unit", "by the others");
  else if (!f.si_unit.empty()) m.set("unit", f.si_unit);
  if (std::isfinite(f.min)) m.set(f.is_above_min ? "above" : "min", f.min);
  if (std::isfinite(f.max)) m.set("max", f.max);
  if (f.may_be_infinite) m.set("infinite", true);
  if (inner->shape == Shape::numbers) m.set("count", inner->count);
  if (!inner->words.empty()) {
    List words;
    for (const Type::Word& w : inner->words) words.emplace_back(w.word);
    m.set("choices", std::move(words));
  }
  if (is_optional) m.set("optional", true);
  if (f.is_needed) m.set("needed", true);
  if (f.is_read_only) m.set("read_only", true);
  if (!f.is_read_only && holds_reals(*inner)) m.set("expression", true);
  m.set("since", f.since_version);
  const bool is_plain = inner->shape != Shape::structure && inner->shape != Shape::list &&
                        inner->shape != Shape::table && inner->shape != Shape::reference;
  if (is_plain && !is_optional && f.index_in.empty()) {
    Map all;
    Type holder;  // of this field alone, so that its value has the form that describe gives
    holder.fields = {f};
    holder.fields[0].counts = nullptr;
    Writer(s, {&holder, standard}, {}).fields(all, holder, standard, 0);
    if (const Value* value = all.find(f.name)) m.set("default", *value);
  }
  const Type* held = inner;
  while (held->element) held = held->element;
  if (held->shape == Shape::structure) m.set("fields", schema_fields(s, *held));
  else if (held != inner) m.set("of", type_word(*held));
  return m;
}

// ---- from values to a record ----

/// Row and column of each number of a Sym3.
constexpr std::pair<std::size_t, std::size_t> kSym3Places[] = {{0, 0}, {1, 1}, {2, 2},
                                                               {0, 1}, {1, 2}, {0, 2}};

class Reader {
 public:
  Reader(CommandContext& ctx, const model::Body& body) : ctx_(ctx), body_(body) {}

  /// Expressions that were given for numbers, by path.
  std::map<std::string, std::string> expressions;

  /// `field` and `owner`: what the value is a part of.
  Result<void> read(const Type& t, void* p, const Field& f, const void* owner,
                    std::size_t component, std::size_t alternative, const Value& v,
                    const std::string& path) {
    if (f.is_read_only)
      return error(ErrorCode::unsupported, text::quote(path) + " cannot be set",
                   "It is computed from the content.");
    if (component != model::kNoComponent) {
      RMP_TRY_ASSIGN(const Value x,
                     checked("real", f.unit_of(owner, component, alternative), f, v, path));
      if (t.shape == Shape::numbers) static_cast<double*>(p)[component] = x.number();
      else if (t.shape == Shape::setting)
        std::get<std::vector<double>>(*static_cast<model::ProviderChoice::Param*>(p))[component] =
            x.number();
      else (*static_cast<std::vector<double>*>(p))[component] = x.number();
      return {};
    }
    if (&t == &type_of<model::Placement>()) {
      RMP_TRY_ASSIGN(*static_cast<model::Placement*>(p), read_placement(&v, path));
      return {};
    }
    if (&t == &type_of<model::ProviderChoice>()) {
      RMP_TRY_ASSIGN(*static_cast<model::ProviderChoice*>(p), read_provider(v, path));
      return {};
    }
    RMP_TRY_ASSIGN(const bool is_read, read_own(t, p, alternative, v, path));
    if (is_read) return {};
    const auto store = [&](const Value& checked) -> Result<void> {
      RMP_TRY(set_checked_value(t, f, p, checked));
      return {};
    };
    switch (t.shape) {
      case Shape::boolean: {
        RMP_TRY_ASSIGN(const Value x, checked("bool", "", f, v, path));
        return store(x);
      }
      case Shape::integer: return integer(t, p, f, v, path);
      case Shape::real: {
        RMP_TRY_ASSIGN(const Value x,
                       checked("real", f.unit_of(owner, 0, alternative), f, v, path));
        return store(x);
      }
      case Shape::text: {
        RMP_TRY_ASSIGN(const Value x, checked("string", "", f, v, path));
        return store(x);
      }
      case Shape::word: {
        ParamSpec spec = spec_of("enum", "", f);
        for (const Type::Word& w : t.words) spec.choices.emplace_back(w.word);
        RMP_TRY_ASSIGN(const Value x, check_value(spec, v, path));
        return store(x);
      }
      case Shape::numbers:
      case Shape::reals: return numbers(t, p, f, owner, alternative, v, path);
      case Shape::colour: {
        RMP_TRY_ASSIGN(*static_cast<Colour*>(p), read_colour(v, path));
        return {};
      }
      case Shape::reference: {
        if (v.is_nil()) {
          t.set_id(p, {});
          return {};
        }
        return reference(t, p, kinds_text(kinds_of(f, t)), v, path);
      }
      case Shape::setting: {
        RMP_TRY_ASSIGN(auto one, read_provider(Map{{"params", Map{{"value", v}}}}, path));
        *static_cast<model::ProviderChoice::Param*>(p) = std::move(one.params["value"]);
        return {};
      }
      case Shape::structure: return structure(t, p, alternative, v, path);
      case Shape::list: return list(t, p, f, owner, alternative, v, path);
      case Shape::optional:
      case Shape::shared:
        if (v.is_nil()) {
          t.drop(p);
          return {};
        }
        return read(*t.element, t.hold(p), f, owner, component, alternative, v, path);
      case Shape::table: {
        const Map* m = v.as_map();
        if (!m) return fault(v, "a table of names and values", path);
        std::vector<std::string> old;
        t.each(p, [&old](const std::string& key, const void*) { old.push_back(key); });
        for (const std::string& key : old) t.erase(p, key);
        for (const auto& [key, each] : *m)
          RMP_TRY(read(*t.element, t.entry(p, key), f, owner, component, alternative, each,
                       path + "." + key));
        return {};
      }
      case Shape::digest: break;
    }
    return error(ErrorCode::unsupported, text::quote(path) + " cannot be set");
  }

 private:
  Result<void> reference(const Type& t, void* p, const std::string& kinds, const Value& v,
                         const std::string& path) {
    RMP_TRY_ASSIGN(const AnyId id, read_ref(ctx_, kinds, v, path));
    t.set_id(p, id);
    return {};
  }

  /// Forms of record.describe that differ from the fields.
  Result<bool> read_own(const Type& t, void* p, std::size_t alternative, const Value& v,
                        const std::string& path) {
    const Type* const element = t.shape == Shape::list ? t.element : nullptr;
    for (const OwnForm& form : OwnFormFile::all()) {
      if ((form.is_list ? element : &t) != &form.type()) continue;
      RMP_TRY_ASSIGN(const bool is_own, form.read(ctx_, p, v, path));
      if (is_own) return true;
    }
    if (element == &type_of<model::NamedPose>() && v.as_map()) {
      auto& poses = *static_cast<std::vector<model::NamedPose>*>(p);
      const Field& q = *element->field("q");
      poses.clear();
      for (const auto& [name, values] : *v.as_map()) {
        poses.push_back({name, {}});
        RMP_TRY(read(*q.type, &poses.back().q, q, &poses.back(), model::kNoComponent, alternative,
                     values, path + "." + name));
      }
      return true;
    }
    if (element == &type_of<model::SolidNode>() && v.as_list()) {
      const bool is_flat =
          std::none_of(v.as_list()->begin(), v.as_list()->end(), [](const Value& n) {
            const Map* m = n.as_map();
            return !m || m->find("sizes") || m->find("is_global") || m->find("is_centred");
          });
      if (!is_flat) return false;
      RMP_TRY_ASSIGN(model::Branch made, read_flat_nodes(ctx_, *v.as_list(), path));
      *static_cast<std::vector<model::SolidNode>*>(p) = std::move(made.nodes);
      for (auto& [at, text] : made.expressions) expressions.insert_or_assign(at, text);
      return true;
    }
    // Its mass properties are among its fields there.
    const Map* m = v.as_map();
    const Value* mass = m ? m->find("mass") : nullptr;
    if (&t == &type_of<model::MeasuredMass>() && mass && !mass->as_map()) {
      Map inner = *m;
      if (const Value* source = m->find("source")) {
        const Field& of = *t.field("source");
        RMP_TRY(read(*of.type, of.in(p), of, p, model::kNoComponent, alternative, *source,
                     path + ".source"));
        inner.erase("source");
      }
      const Field& of = *t.field("mass");
      RMP_TRY(
          read(*of.type, of.in(p), of, p, model::kNoComponent, alternative, Value(inner), path));
      return true;
    }
    return false;
  }

  static Error fault(const Value& v, const char* wanted, const std::string& path) {
    return error(ErrorCode::invalid_argument, v.text() + " is not " + wanted, {}, path);
  }
  static ParamSpec spec_of(const char* type, std::string_view unit, const Field& f) {
    ParamSpec spec = needed(std::string(f.name), type, std::string(unit), std::string(f.sentence));
    spec.min = f.is_above_min && f.min == 0 ? kPositive : f.min;
    spec.max = f.max;
    spec.infinite = f.may_be_infinite;
    return spec;
  }
  static Result<Value> checked(const char* type, std::string_view unit, const Field& f,
                               const Value& v, const std::string& path) {
    return check_value(spec_of(type, unit, f), v, path);
  }

  /// A whole number, or the name of an element of another list; "base" and nil are none.
  Result<void> integer(const Type& t, void* p, const Field& f, const Value& v,
                       const std::string& path) const {
    const std::string* name = v.as_string();
    if (f.index_in.empty() || (!name && !v.is_nil())) {
      RMP_TRY_ASSIGN(const Value x, checked("int", "", f, v, path));
      const std::int64_t given = *x.as_int();
      t.set_whole(p, f.index_in.empty() ? given : given - 1);  // elements are counted from 1
      return {};
    }
    t.set_whole(p, -1);
    if (!name || name->empty() || *name == "base") return {};
    const Content record = model::content(body_);
    const Field* list = record.type->field(f.index_in);
    std::vector<std::string> known;
    for (std::size_t i = 0; list && i < list->type->length(list->in(record.data)); ++i) {
      const std::string* each =
          model::name_of(*list->type->element, list->type->at(list->in(record.data), i));
      if (!each) continue;
      if (*each == *name) {
        t.set_whole(p, static_cast<std::int64_t>(i));
        return {};
      }
      known.push_back(*each);
    }
    return unknown_name("element of " + std::string(f.index_in), *name, known).in(path);
  }

  /// The unit of number `i` of joint values at `path`: the record may know the joint.
  [[nodiscard]] std::string unit_of_joint(const std::string& path, std::size_t i,
                                          const Value& v) const {
    const auto known = model::number_at(body_, path + "[" + std::to_string(i + 1) + "]");
    if (known && known->unit != model::kByJoint) return std::string(known->unit);
    const std::string* s = v.as_string();
    for (const char* unit : {"rad", "m"})
      if (!s || units::read_quantity(*s, unit).ok()) return unit;
    return std::string(model::kByJoint);
  }

  Result<void> numbers(const Type& t, void* p, const Field& f, const void* owner,
                       std::size_t alternative, const Value& v, const std::string& path) const {
    std::vector<double> out;
    const bool is_by_joint = t.shape == Shape::reals && f.si_unit == model::kByJoint;
    const auto take = [&](const Value& each) -> Result<void> {
      const std::string unit = is_by_joint ? unit_of_joint(path, out.size(), each)
                                           : std::string(f.unit_of(owner, out.size(), alternative));
      RMP_TRY_ASSIGN(const Value x, checked("real", unit, f, each, path));
      out.push_back(x.number());
      return {};
    };
    const NumericArray* array = v.as_array();
    if (array && array->is_matrix() && &t == &type_of<Sym3>() && array->rows() == 3 &&
        array->cols() == 3) {
      for (const auto& [row, col] : kSym3Places) {
        if (array->at(row, col) != array->at(col, row)) return fault(v, "a symmetric matrix", path);
        RMP_TRY(take(array->at(row, col)));
      }
    } else if (array) {
      for (const double x : array->data()) RMP_TRY(take(x));
    } else if (const List* list = v.as_list()) {
      for (const Value& each : *list) RMP_TRY(take(each));
    } else {
      return fault(v, "a list of numbers", path);
    }
    if (t.shape == Shape::reals) {
      *static_cast<std::vector<double>*>(p) = std::move(out);
      return {};
    }
    if (out.size() != t.count)
      return error(
          ErrorCode::invalid_argument,
          count_given(out.size(), "number") + "; " + std::to_string(t.count) + " are needed", {},
          path);
    std::copy(out.begin(), out.end(), static_cast<double*>(p));
    return {};
  }

  Result<void> structure(const Type& t, void* p, std::size_t alternative, const Value& v,
                         const std::string& path) {
    static const Map kNone;
    const Map* m = v.as_list() && v.as_list()->empty() ? &kNone : v.as_map();  // {} of Lua
    if (!m) return fault(v, "a table of fields", path);
    // Which of several kinds a reference is of, beside its name.
    const Value* kind = t.field("kind") ? nullptr : m->find("kind");
    for (const auto& [key, each] : *m) {
      Member at = member(t, p, key);
      if (!at.field) {
        if (&each == kind && has_kinds(t)) continue;
        std::vector<std::string> known;
        for (const Field& field : t.fields) known.emplace_back(field.name);
        return unknown_name("field", key, known).in(path);
      }
      if (t.alternative) alternative = t.alternative(p);
      const Field& f = *at.field;
      if (kind && kind->as_string() && f.kinds.size() > 1 && each.as_string() &&
          kind_from(*kind->as_string())) {
        RMP_TRY(reference(*f.type, f.in(at.owner), *kind->as_string(), each, path + "." + key));
        continue;
      }
      RMP_TRY(read(*f.type, f.in(at.owner), f, at.owner, model::kNoComponent, alternative, each,
                   path + "." + key));
    }
    return {};
  }

  /// A field by name, of the struct or of one whose fields are among its own; null = none.
  struct Member {
    const Field* field = nullptr;
    void* owner = nullptr;
  };
  static Member member(const Type& t, void* p, std::string_view name) {
    if (const Field* f = t.field(name)) return {f, p};
    for (const Field& f : t.fields)
      if (f.is_value_flat && f.type->shape == Shape::structure)
        if (const Member inner = member(*f.type, f.in(p), name); inner.field) return inner;
    return {};
  }
  static bool has_kinds(const Type& t) {
    return std::any_of(t.fields.begin(), t.fields.end(),
                       [](const Field& f) { return f.kinds.size() > 1; });
  }

  Result<void> list(const Type& t, void* p, const Field& f, const void* owner,
                    std::size_t alternative, const Value& v, const std::string& path) {
    const List* given = v.as_list();
    if (!given && !(v.as_map() && v.as_map()->empty())) return fault(v, "a list", path);
    t.resize(p, 0);
    for (std::size_t i = 0; given && i < given->size(); ++i) {
      t.resize(p, i + 1);
      RMP_TRY(read(*t.element, t.at(p, i), f, owner, model::kNoComponent, alternative, (*given)[i],
                   path + "[" + std::to_string(i + 1) + "]"));
    }
    return {};
  }

  CommandContext& ctx_;
  const model::Body& body_;
};

}  // namespace

OwnFormFile::OwnFormFile(OwnForm form) { own_forms().push_back(form); }

const std::vector<OwnForm>& OwnFormFile::all() { return own_forms(); }

void add_fields(Map& out, const document::Snapshot& snapshot, const model::Record& r) {
  const Content record = model::content(r.body);
  Writer(snapshot, record, r.name).fields(out, *record.type, record.data, 0);
}

List schema_fields(const document::Snapshot& s, const Type& t) {
  List out;
  for (const Field& f : t.fields) out.emplace_back(field_map(s, f, t.standard.get()));
  return out;
}

Result<void> read_field(CommandContext& ctx, model::Body& body, const model::Place& at,
                        const Value& value, const std::string& path) {
  Reader reader(ctx, body);
  RMP_TRY(reader.read(*at.type, at.data, *at.field, at.owner, at.component, at.alternative, value,
                      path));
  if (model::Parametric* parametric = model::parametric_of(body))
    for (auto& [number, text] : reader.expressions)
      parametric->expressions.insert_or_assign(number, text);
  return {};
}

Result<void> set_path(CommandContext& ctx, AnyId id, const std::string& path, const Value& given) {
  const model::Body& before = ctx.snapshot().find(id)->body;
  const Content content = model::content(before);
  Value value = given;
  const std::string known = model::known_path(content, path);
  if (!model::find(content, path)) {
    // Points of profiles are numbers with paths of their own.
    const auto number = model::number_at(before, path);
    if (!number) return unknown_path(before, path).in(name_in(ctx, id));
    RMP_TRY_ASSIGN(value, ctx.expressions.read_at(before, path, value));
    RMP_TRY_ASSIGN(value,
                   check_value(field("", "real", std::string(number->unit), ""), value, path));
    auto done = ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
      model::set_number(r.body, path, value.number());
      ctx.expressions.keep(*model::parametric_of(r.body));
      return {};
    });
    return std::move(done).in(name_in(ctx, id));
  }
  if (const auto number = model::number_at(before, known)) {
    auto read = ctx.expressions.read_at(before, known, value);
    if (!read.ok()) return std::move(read).error().in(name_in(ctx, id));
    value = std::move(*read);
    // Of joints and their like only the record as a whole tells the unit.
    const auto place = model::find(content, path);
    const std::string* text = value.as_string();
    if (text && place->unit() != number->unit)
      if (const auto quantity = units::read_quantity(*text, number->unit); quantity.ok())
        value = Value(*quantity);
  }
  bool applies = true;
  auto done = ctx.edit().edit(id, [&](model::Record& r) -> Result<void> {
    const auto at = model::find_for_change(model::content(r.body), path);
    RMP_TRY(read_field(ctx, r.body, *at, value, path));
    if (auto* parametric = model::parametric_of(r.body)) ctx.expressions.keep(*parametric);
    // A step with a value that its kind does not have is refused as a whole.
    const bool is_checked =
        at->field && model::type_of<model::TaskStep>().field(at->field->name) == at->field;
    applies = is_checked || !at->field || !at->field->counts || !at->owner ||
              at->field->counts(at->owner);
    return {};
  });
  if (!done.ok()) return std::move(done).error().in(name_in(ctx, id));
  if (!applies)
    ctx.app.messages.post(Severity::warning, "record",
                          name_in(ctx, id) + ": " + text::quote(path) +
                              " does not apply to the record as it is now: the value has no "
                              "effect, and files leave it out");
  return {};
}

Error unknown_path(const model::Body& body, std::string_view path) {
  constexpr std::size_t kMost = 5000;  // enough to find a near one
  std::vector<std::string> known;
  model::for_each_path(model::content(body), [&known](const std::string& each, const auto&) {
    if (known.size() < kMost) known.push_back(each);
  });
  std::string hint = text::did_you_mean(path, known);
  const std::string kind(to_string(model::kind_of_body(body)));
  if (hint.empty()) hint = "record.schema(\"" + kind + "\") lists its fields.";
  return error(ErrorCode::unknown_name, text::quote(path) + " is not in this " + kind,
               std::move(hint));
}

}  // namespace robomosp::ioci
