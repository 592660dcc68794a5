// SPDX-License-Identifier: Apache-2.0
#include "io/declared_reader.h"

namespace robomosp::io {

using Member = model::Field;  // io::Field is one of a file
using model::Shape;
using model::Type;
using model::type_of;

namespace {

/// The sentences say `a base part`.
std::string noun(std::string_view word) {
  std::string s(word);
  std::replace(s.begin(), s.end(), '_', ' ');
  return s;
}

model::Way to_member(model::Way way, const Member& f) {
  way.push_back({&f, 0});
  return way;
}
model::Way to_element(model::Way way, std::size_t i) {
  way.push_back({nullptr, i});
  return way;
}

bool has_name(const Type& element) {
  if (element.shape != Shape::structure) return false;
  const Member* f = element.field("name");
  return f && f->type->shape == Shape::text;
}

/// Puts the id of a loaded record where a way leads.
std::function<void(model::Body&, AnyId)> setter(const model::Way& way) {
  return [way](model::Body& b, AnyId id) {
    const model::MutableContent at = model::follow_for_change(model::content(b), way);
    at.type->set_id(at.data, id);
  };
}

}  // namespace

std::vector<Rule> DeclaredReader::rules_of(const Target& t) {
  std::vector<Rule> rules;
  for (const Member& f : t.type->fields)
    if (f.name != "name" || t.way.empty() || !has_name(*t.type)) add_rules(t, f, rules);
  return rules;
}

void DeclaredReader::add_rules(const Target& t, const Member& f, std::vector<Rule>& out) {
  void* data = f.in(t.data);
  const model::Way way = to_member(t.way, f);
  const std::string owner = t.shown.empty() ? "the " + s_.kind : t.shown;
  if (f.type == &type_of<Parametric>()) {
    out.push_back(parameter_rule(*static_cast<Parametric*>(data)));
    return;
  }
  if (f.type == &type_of<Placement>() && f.is_path_flat) {
    placement(out, *static_cast<Placement*>(data));
    return;
  }
  if (f.type->shape == Shape::list && f.type->element == &type_of<CollisionPairRule>()) {
    auto& rules = *static_cast<std::vector<CollisionPairRule>*>(data);
    out.push_back(pair_rule("allowed_pair", true, rules));
    out.push_back(pair_rule("checked_pair", false, rules));
    return;
  }
  if (f.type->shape == Shape::reference) {
    const auto declared = model::kinds_of(f, *f.type);
    const auto allowed = declared.empty() ? all_kinds() : declared;
    std::vector<Kind> kinds(allowed.begin(), allowed.end());
    if (f.is_written_by_kind) {
      for (const Kind k : kinds) out.push_back(reference(to_string(k), {k}, owner, setter(way)));
      return;
    }
    out.push_back(reference(f.word_in_files(), std::move(kinds), owner, setter(way)));
  } else if (f.type->shape == Shape::list) {
    out.push_back(list_rule(t, f));
  } else if (f.type->shape == Shape::table) {
    out.push_back(table_rule(f, data));
  } else {
    out.push_back({f.word_in_files(), [this, t, &f](Index i) { return read_single(i, t, f); }});
  }
  out.back().is_required = f.is_needed;
}

void DeclaredReader::add_rules(const Target& t, const std::vector<const Member*>& fields,
                               Index owner, std::vector<Rule>& out) {
  const auto is_given = [&](std::string_view word) {
    for (Index k = owner + 1; k < at(owner).end; k = at(k).end)
      if (at(k).name == word) return true;
    return false;
  };
  out.reserve(out.size() + fields.size());
  for (const Member* f : fields) {
    const Shape shape = f->type->shape;
    if (shape == Shape::list || f->is_path_flat || f->is_written_by_kind) {
      add_rules(t, *f, out);
    } else if (!is_given(f->word_in_files())) {
      out.push_back({f->word_in_files(), nullptr, false, f->is_needed});
    } else if (shape == Shape::reference || shape == Shape::table) {
      add_rules(t, *f, out);
    } else {
      const auto read = [this, &t, f](Index i) { return read_single(i, t, *f); };
      out.push_back({f->word_in_files(), read, false, f->is_needed});
    }
  }
}

Result<void> DeclaredReader::read_single(Index i, const Target& t, const Member& f) {
  const Type* type = f.type;
  void* p = f.in(t.data);
  for (; type->shape == Shape::optional || type->shape == Shape::shared; type = type->element)
    p = type->hold(p);
  // Only what is looked up later needs its path.
  const bool has_way = type->shape == Shape::structure || !f.index_in.empty();
  return read_value(i, t, f, *type, p, has_way ? to_member(t.way, f) : model::Way());
}

Result<void> DeclaredReader::need_references(const Target& t, Index block) {
  for (const Member& f : t.type->fields)
    if (f.is_written_by_kind && f.is_needed) return need_body(block);
  return {};
}

Result<void> DeclaredReader::read_value(Index i, const Target& t, const Member& f, const Type& type,
                                        void* p, const model::Way& way) {
  const std::string_view word = at(i).name;
  if (&type == &type_of<Placement>())
    return placement_block(word, *static_cast<Placement*>(p)).read(i);
  if (&type == &type_of<ProviderChoice>())
    return provider(word, *static_cast<ProviderChoice*>(p)).read(i);
  if (&type == &type_of<MeasuredMass>()) {
    std::optional<MeasuredMass> m;
    RMP_TRY(measured(m).read(i));
    *static_cast<MeasuredMass*>(p) = std::move(*m);
    return {};
  }
  switch (type.shape) {
    case Shape::boolean: {
      const auto set = [p](std::size_t k) { *static_cast<bool*>(p) = k == 1; };
      return words(word, {"false", "true"}, set).read(i);
    }
    case Shape::integer: {
      if (!f.index_in.empty()) {
        names_.push_back({i, way, f.index_in});
        return {};
      }
      std::int64_t v = 0;
      RMP_TRY(count(word, v).read(i));
      type.set_whole(p, v);
      return {};
    }
    case Shape::real:
      return number(word, f.unit_of(t.data, 0, t.alternative), *static_cast<double*>(p)).read(i);
    case Shape::text: return string(word, *static_cast<std::string*>(p)).read(i);
    case Shape::word: {
      std::vector<std::string> choices;
      for (const Type::Word& w : type.words) choices.emplace_back(w.word);
      const auto set = [p, &type](std::size_t k) { type.set_whole(p, type.words[k].value); };
      return words(word, std::move(choices), set).read(i);
    }
    case Shape::numbers:
    case Shape::reals: return read_numbers(i, t, f, type, p);
    case Shape::colour: return colour(word, *static_cast<Colour*>(p)).read(i);
    case Shape::structure: {
      RMP_TRY(need_block(i, true));
      Target inner{&type, p, way, t.shown, t.alternative};
      if (type.alternative) inner.alternative = type.alternative(p);
      RMP_TRY(block(i, article(f.shown_name()), rules_of(inner)));
      return need_references(inner, i);
    }
    default: return fail(i, quote(word) + " cannot be written in a file");
  }
}

Result<void> DeclaredReader::read_numbers(Index i, const Target& t, const Member& f,
                                          const Type& type, void* p) {
  if (type.shape == Shape::reals && f.si_unit == model::kByJoint) {
    static_cast<std::vector<double>*>(p)->clear();
    return joint_values(i, *static_cast<std::vector<double>*>(p));
  }
  RMP_TRY(no_block(i));
  const Field& field = at(i);
  const bool is_fixed = type.shape == Shape::numbers;
  if (field.argument != Argument::tuple || (is_fixed && field.numbers != type.count))
    return s_.at(field.argument_offset, ErrorCode::syntax,
                 quote(field.name) + " needs " +
                     (is_fixed ? std::to_string(type.count) + " numbers" : "numbers") +
                     " in parentheses" +
                     (is_fixed && field.argument == Argument::tuple
                          ? "; it has " + std::to_string(field.numbers)
                          : std::string()));
  std::vector<double> v;
  for (std::uint32_t k = 0; k < field.numbers; ++k) {
    RMP_TRY_ASSIGN(const double x, quantity(s_.numbers[field.first_number + k],
                                            f.unit_of(t.data, k, t.alternative)));
    v.push_back(x);
  }
  if (is_fixed) std::copy(v.begin(), v.end(), static_cast<double*>(p));
  else *static_cast<std::vector<double>*>(p) = std::move(v);
  return {};
}

Rule DeclaredReader::list_rule(const Target& t, const Member& f) {
  void* list = f.in(t.data);
  const model::Way way = to_member(t.way, f);
  if (f.type->element->shape != Shape::structure || f.type->element == &type_of<Placement>())
    return repeated(f.word_in_files(), [this, t, &f, list, way](Index i) -> Result<void> {
      const std::size_t n = f.type->length(list);
      f.type->resize(list, n + 1);
      return read_value(i, t, f, *f.type->element, f.type->at(list, n), to_element(way, n));
    });
  const auto named = std::make_shared<std::unordered_map<std::string, Index>>();
  const bool is_named = has_name(*f.type->element);
  return repeated(f.word_in_files(),
                  [this, t, &f, list, way, named, is_named](Index i) -> Result<void> {
                    const Type& type = *f.type->element;
                    const std::string_view word = f.word_in_files();
                    const std::size_t n = f.type->length(list);
                    f.type->resize(list, n + 1);
                    void* p = f.type->at(list, n);
                    Target inner{&type, p, to_element(way, n), article(noun(word)), t.alternative};
                    if (&type == &type_of<model::ProgramBinding>()) {
                      // Its name is one of a program, a number or none, and may come again.
                      auto& of = *static_cast<std::string*>(type.field("name")->in(p));
                      out_.places[{word, n}] = at(i).offset;
                      RMP_TRY(need_argument(i));
                      RMP_TRY(read_word(i, of));
                      RMP_TRY(need_block(i));
                      inner.shown = noun(word) + " " + quote(of);
                    } else if (is_named) {
                      auto& name = *static_cast<std::string*>(type.field("name")->in(p));
                      RMP_TRY(element(i, word, n, name, *named));
                      inner.shown = noun(word) + " " + quote(name);
                    } else {
                      out_.places[{word, n}] = at(i).offset;
                      RMP_TRY(need_block(i, true));
                    }
                    if (type.alternative) inner.alternative = type.alternative(p);
                    RMP_TRY(block(i, article(noun(word)), rules_of(inner)));
                    return need_references(inner, i);
                  });
}

Rule DeclaredReader::table_rule(const Member& f, void* table) {
  return {f.word_in_files(), [this, &f, table](Index i) -> Result<void> {
            RMP_TRY(need_block(i, true));
            for (Index k = i + 1; k < at(i).end; k = at(k).end) {
              void* p = f.type->entry(table, std::string(at(k).name));
              if (f.type->element->shape == Shape::setting) {
                RMP_TRY(no_block(k));
                RMP_TRY_ASSIGN(*static_cast<ProviderChoice::Param*>(p), parameter(k));
              } else {
                RMP_TRY(read_value(k, {}, f, *f.type->element, p, {}));
              }
            }
            return {};
          }};
}

Result<void> DeclaredReader::look_up_names() {
  const model::MutableContent record = model::content(out_.record.body);
  const auto each_name = [&record](std::string_view list, const auto& see) {
    const Member* f = record.type->field(list);
    if (!f) return;
    const void* items = f->in(record.data);
    for (std::size_t k = 0; k < f->type->length(items); ++k)
      if (const std::string* name = model::name_of(*f->type->element, f->type->at(items, k)))
        see(*name, static_cast<std::int64_t>(k));
  };
  using Places = std::unordered_map<std::string_view, std::int64_t>;
  std::unordered_map<std::string_view, Places> lists;  // each is looked through once
  for (const NameToFind& wanted : names_) {
    std::string name;
    RMP_TRY(read_name(wanted.field, name, noun(at(wanted.field).name)));
    const auto [list, is_new] = lists.try_emplace(wanted.list);
    Places& places = list->second;
    if (is_new)
      each_name(wanted.list, [&](const std::string& each, std::int64_t k) { places[each] = k; });
    const auto found = places.find(name);
    if (found == places.end() && name != "base") {
      std::vector<std::string> known;
      each_name(wanted.list, [&](const std::string& each, std::int64_t) { known.push_back(each); });
      std::string hint = text::did_you_mean(name, known);
      if (hint.empty() && !known.empty()) hint = "There are " + text::enumerate(known) + ".";
      return s_.at(at(wanted.field).argument_offset, ErrorCode::unknown_name,
                   quote(name) + " is not one of the " + noun(wanted.list), hint);
    }
    const model::MutableContent place = model::follow_for_change(record, wanted.way);
    place.type->set_whole(place.data, found == places.end() ? -1 : found->second);
  }
  return {};
}

Result<void> DeclaredReader::declared_record(Kind kind) {
  out_.record.body = model::empty_body(kind);
  const model::MutableContent record = model::content(out_.record.body);
  const Target target{record.type, record.data, {}, {}, 0};
  std::vector<Rule> rules = rules_of(target);
  rules.insert(rules.begin(), name_rule());
  RMP_TRY(block(kFile, article(to_string(kind)), rules));
  return look_up_names();
}

}  // namespace robomosp::io
