// SPDX-License-Identifier: Apache-2.0
#include "model/field_path.h"

#include "kernel/text.h"
#include "model/parametric.h"

namespace robomosp::model {

namespace {

/// Takes `word` off the front when the path ends or goes on with . or [ behind it.
bool take(std::string_view& path, std::string_view word) {
  if (word.empty() || !path.starts_with(word)) return false;
  if (path.size() > word.size() && path[word.size()] != '.' && path[word.size()] != '[')
    return false;
  path.remove_prefix(word.size());
  if (path.starts_with('.')) path.remove_prefix(1);
  return true;
}

/// The next step `[step]` or `step.`; the rest stays in `path`.
std::string_view next_step(std::string_view& path) {
  std::string_view step;
  if (path.starts_with('[')) {
    const auto end = path.find(']');
    if (end == std::string_view::npos) return {};
    step = path.substr(1, end - 1);
    path.remove_prefix(end + 1);
  } else {
    step = path.substr(0, path.find_first_of(".["));
    path.remove_prefix(step.size());
  }
  if (path.starts_with('.')) path.remove_prefix(1);
  return step;
}

Place member(const Place& at, const Field& f) {
  Place place = at;
  place.type = f.type;
  place.data = f.in(at.data);
  place.field = &f;
  place.owner = at.data;
  place.may_be_expression =
      at.may_be_expression && (f.may_be_expression || f.type->shape == Shape::list);
  if (at.type->alternative) place.alternative = at.type->alternative(at.data);
  return place;
}

/// With `for_change` other versions of the record are left as they are.
Place element(const Place& list, std::size_t i, bool for_change = false) {
  Place place = list;
  place.type = list.type->element;
  const void* held = list.data;
  place.data = for_change ? list.type->at(list.data, i)
                          : const_cast<void*>(list.type->at(held, i));  // nothing is written
  return place;
}

/// Walks all places of a record.
struct Walker {
  const std::function<void(const std::string&, const Place&)>& see;

  static std::string below(const std::string& path, std::string_view name) {
    return path.empty() ? std::string(name) : path + "." + std::string(name);
  }

  void operator()(const Place& at, const std::string& path) const {
    switch (at.type->shape) {
      case Shape::structure:
        for (const Field& f : at.type->fields) {
          if (f.counts && !f.counts(at.data)) continue;
          const bool is_hidden = f.is_path_flat || f.is_addressed_by_names;
          const std::string_view word = f.path_word ? f.path_word(at.data) : f.name;
          (*this)(member(at, f), is_hidden ? path : below(path, word));
        }
        return;
      case Shape::list:
        if (!at.field->is_addressed_by_names) see(path, at);
        for (std::size_t i = 0; i < at.type->length(at.data); ++i) {
          const Place item = element(at, i);
          const std::string* name = name_of(*item.type, item.data);
          (*this)(item, below(path, name ? *name : std::to_string(i + 1)));
        }
        return;
      case Shape::optional:
      case Shape::shared:
        if (!at.field->is_path_flat) see(path, at);
        if (const void* held = at.type->held(at.data)) {
          Place inner = at;
          inner.type = at.type->element;
          inner.data = const_cast<void*>(held);  // nothing is written
          (*this)(inner, path);
        }
        return;
      case Shape::table:
        at.type->each(at.data, [&](const std::string& key, const void* v) {
          Place inner = at;
          inner.type = at.type->element;
          inner.data = const_cast<void*>(v);  // nothing is written
          see(below(path, key), inner);
        });
        return;
      case Shape::numbers:
        if (!at.field->is_path_flat) see(path, at);
        for (std::size_t i = 0; i < at.type->count; ++i) {
          const std::string_view name = component_name(*at.field, at.owner, i);
          if (name.empty()) return;
          Place number = at;
          number.component = i;
          see(below(path, name), number);
        }
        return;
      default: see(path, at); return;
    }
  }
};

struct Finder {
  bool for_change;

  std::optional<Place> find(const Place& at, std::string_view path) const {
    if (path.empty()) return at;
    switch (at.type->shape) {
      case Shape::structure: return in_structure(at, path);
      case Shape::list: return in_list(at, path);
      case Shape::optional:
        if (!at.type->held(at.data)) return std::nullopt;
        return inner(at, const_cast<void*>(at.type->held(at.data)), path);  // `at` may be changed
      case Shape::shared: {
        if (!at.type->held(at.data)) return std::nullopt;
        Place shared = at;
        shared.is_shared = true;
        return inner(
            shared, for_change ? at.type->hold(at.data) : const_cast<void*>(at.type->held(at.data)),
            path);
      }
      case Shape::table: return in_table(at, path);
      case Shape::numbers: return component(at, path, at.type->count);
      case Shape::reals: {
        const auto n = static_cast<const std::vector<double>*>(at.data)->size();
        const auto i = text::read_int(next_step(path));
        if (!i || !path.empty() || *i < 1 || *i > static_cast<std::int64_t>(n)) return std::nullopt;
        Place place = at;
        place.component = static_cast<std::size_t>(*i - 1);
        return place;
      }
      default: return std::nullopt;
    }
  }

  std::optional<Place> inner(Place at, void* data, std::string_view path) const {
    at.type = at.type->element;
    at.data = data;
    return find(at, path);
  }

  std::optional<Place> in_structure(const Place& at, std::string_view path) const {
    for (const Field& f : at.type->fields)
      if (f.is_addressed_by_names)
        if (auto found = by_name(member(at, f), path)) return found;
    for (const Field& f : at.type->fields) {
      std::string_view rest = path;
      if (take(rest, f.path_word ? f.path_word(at.data) : f.name))
        if (auto found = find(member(at, f), rest)) return found;
    }
    for (const Field& f : at.type->fields)
      if (f.is_path_flat)
        if (auto found = find(member(at, f), path)) return found;
    return std::nullopt;
  }

  /// Names may hold dots, so each is tried.
  std::optional<Place> by_name(const Place& list, std::string_view path) const {
    for (std::size_t i = 0; i < list.type->length(list.data); ++i) {
      const Place item = element(list, i);
      const std::string* name = name_of(*item.type, item.data);
      std::string_view rest = path;
      if (name && take(rest, *name))
        if (auto found = find(for_change ? element(list, i, true) : item, rest)) return found;
    }
    return std::nullopt;
  }
  std::optional<Place> in_list(const Place& at, std::string_view path) const {
    std::string_view rest = path;
    const auto i = text::read_int(next_step(rest));
    if (i && *i >= 1 && *i <= static_cast<std::int64_t>(at.type->length(at.data)))
      return find(element(at, static_cast<std::size_t>(*i - 1), for_change), rest);
    return by_name(at, path);
  }
  std::optional<Place> in_table(const Place& at, std::string_view path) const {
    std::optional<Place> found;
    at.type->each(at.data, [&](const std::string& key, const void* v) {
      if (key != path) return;
      found = at;
      found->type = at.type->element;
      found->data = const_cast<void*>(v);  // the table is not const where it may be written
    });
    return found;
  }
  static std::optional<Place> component(const Place& at, std::string_view path, std::size_t count) {
    const std::string_view step = next_step(path);
    if (!path.empty()) return std::nullopt;
    for (std::size_t i = 0; i < count; ++i)
      if (!step.empty() && component_name(*at.field, at.owner, i) == step) {
        Place place = at;
        place.component = i;
        return place;
      }
    return std::nullopt;
  }
};

}  // namespace

double* Place::number() const {
  if (type->shape == Shape::real) return static_cast<double*>(data);
  if (type->shape == Shape::numbers && component != kNoComponent)
    return static_cast<double*>(data) + component;
  if (type->shape == Shape::reals && component != kNoComponent)
    return static_cast<std::vector<double>*>(data)->data() + component;
  // Whole numbers, texts and lists among the settings are none.
  if (type->shape == Shape::setting)
    return std::get_if<double>(static_cast<ProviderChoice::Param*>(data));
  return nullptr;
}

std::string_view Place::unit() const {
  if (type->shape == Shape::setting) return kAnyUnit;
  return field->unit_of(owner, component == kNoComponent ? 0 : component, alternative);
}

std::optional<Place> find(const Content& c, std::string_view path) {
  if (path.empty()) return std::nullopt;
  Place root;
  root.type = c.type;
  root.data = const_cast<void*>(c.data);  // nothing is written
  return Finder{false}.find(root, path);
}

std::optional<Place> find_for_change(const MutableContent& c, std::string_view path) {
  if (path.empty()) return std::nullopt;
  Place root;
  root.type = c.type;
  root.data = c.data;
  return Finder{true}.find(root, path);
}

MutableContent follow_for_change(MutableContent at, std::span<const WayStep> way) {
  const auto enter = [&at] {
    while (at.type->shape == Shape::optional || at.type->shape == Shape::shared)
      at = {at.type->element, at.type->hold(at.data)};
  };
  for (const WayStep& step : way) {
    enter();
    if (step.member) {
      at = {step.member->type, step.member->in(at.data)};
    } else {
      if (step.element >= at.type->length(at.data)) return {};
      at = {at.type->element, at.type->at(at.data, step.element)};
    }
  }
  enter();
  return at;
}

void for_each_path(const Content& c,
                   const std::function<void(const std::string&, const Place&)>& see) {
  Place root;
  root.type = c.type;
  root.data = const_cast<void*>(c.data);  // nothing is written
  Walker{see}(root, {});
}

std::string known_path(const Content& c, std::string_view path) {
  const auto at = find(c, path);
  const double* wanted = at ? at->number() : nullptr;
  std::string out(path);
  if (wanted)
    for_each_path(c, [&](const std::string& known, const Place& place) {
      if (place.number() == wanted) out = known;
    });
  return out;
}

std::string_view component_name(const Field& f, const void* owner, std::size_t i) {
  if (f.component_at) return f.component_at(owner, i);
  const Type* numbers = f.type;
  while (numbers->element) numbers = numbers->element;
  constexpr std::string_view kAxes[] = {"x", "y", "z"};
  constexpr std::string_view kElements[] = {"xx", "yy", "zz", "xy", "yz", "xz"};
  if (numbers->count <= std::size(kAxes)) return kAxes[i];
  return numbers->count == std::size(kElements) ? kElements[i] : std::string_view();
}

std::string element_prefix(const Field& list) {
  return list.is_addressed_by_names ? std::string() : std::string(list.name) + ".";
}

}  // namespace robomosp::model
