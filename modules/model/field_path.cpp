// SPDX-License-Identifier: Apache-2.0
#include "model/field_path.h"

#include <functional>
#include <variant>

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
  place.may_be_expression = at.may_be_expression && !f.is_read_only &&
                            f.type != &type_of<Parametric>() && (!f.counts || f.counts(at.data));
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

/// Whether an element is known by its name: one that reads as a place in the list is not, nor is
/// one that another element in front of it has.
bool is_known_by_name(const Type& list, const void* items, std::size_t i, const std::string* name,
                      bool is_unique) {
  if (!name || name->empty() || text::read_int(*name)) return is_unique && name && !name->empty();
  if (is_unique) return true;
  for (std::size_t k = 0; k < i; ++k)
    if (const std::string* other = name_of(*list.element, list.at(items, k));
        other && *other == *name)
      return false;
  return true;
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
          const bool by_name =
              is_known_by_name(*at.type, at.data, i, name, at.field->is_addressed_by_names);
          (*this)(item, below(path, by_name ? *name : std::to_string(i + 1)));
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

/// Walks the numbers of a record that can be expressions. Names of the way to a number are only
/// joined when somebody wants it: records have thousands.
struct NumberWalker {
  const std::function<bool(const double&)>& wanted;
  const std::function<void(const std::string& path, const double&)>& see;
  std::vector<std::string> way{};

  void number(const double& v, const std::string& last) {
    if (!wanted(v)) return;
    std::string path;
    for (const std::string& word : way) path += (path.empty() ? "" : ".") + word;
    if (!last.empty()) path += (path.empty() ? "" : ".") + last;
    see(path, v);
  }
  void row(const std::vector<double>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) number(row[i], std::to_string(i + 1));
  }
  template <class Fn>
  void under(std::string word, Fn&& walk) {
    way.push_back(std::move(word));
    walk();
    way.pop_back();
  }

  void operator()(const Place& at) {
    const Type& t = *at.type;
    switch (t.shape) {
      case Shape::real: return number(*static_cast<const double*>(at.data), {});
      case Shape::reals: return row(*static_cast<const std::vector<double>*>(at.data));
      case Shape::numbers:
        for (std::size_t i = 0; i < t.count; ++i) {
          const std::string_view name = component_name(*at.field, at.owner, i);
          if (name.empty()) return;
          number(static_cast<const double*>(at.data)[i], std::string(name));
        }
        return;
      case Shape::setting: {
        const auto& v = *static_cast<const ProviderChoice::Param*>(at.data);
        if (const auto* real = std::get_if<double>(&v)) number(*real, {});
        if (const auto* list = std::get_if<std::vector<double>>(&v)) row(*list);
        return;
      }
      case Shape::structure:
        for (const Field& f : t.fields) {
          const Place inner = member(at, f);
          if (!inner.may_be_expression) continue;
          if (f.is_path_flat || f.is_addressed_by_names) (*this)(inner);
          else
            under(std::string(f.path_word ? f.path_word(at.data) : f.name),
                  [&] { (*this)(inner); });
        }
        return;
      case Shape::list: {
        const bool is_unique = at.field->is_addressed_by_names;
        for (std::size_t i = 0; i < t.length(at.data); ++i) {
          const Place item = element(at, i);
          const std::string* name = name_of(*item.type, item.data);
          const bool by_name = is_known_by_name(t, at.data, i, name, is_unique);
          under(by_name ? *name : std::to_string(i + 1), [&] { (*this)(item); });
        }
        return;
      }
      case Shape::optional:
      case Shape::shared:
        if (const void* held = t.held(at.data)) {
          if (t.element == &type_of<CsgProfile>())
            return profile(*static_cast<const CsgProfile*>(held));
          Place inner = at;
          inner.type = t.element;
          inner.data = const_cast<void*>(held);  // nothing is written
          (*this)(inner);
        }
        return;
      case Shape::table:
        t.each(at.data, [&](const std::string& key, const void* v) {
          Place inner = at;
          inner.type = t.element;
          inner.data = const_cast<void*>(v);  // nothing is written
          under(key, [&] { (*this)(inner); });
        });
        return;
      default: return;
    }
  }

  /// As number_at() names them: point by point, whatever curves join these.
  void profile(const CsgProfile& p) {
    const auto point = [this](const std::array<double, 2>& xy, std::size_t i) {
      number(xy[0], std::to_string(i) + ".x");
      number(xy[1], std::to_string(i) + ".y");
    };
    for (std::size_t k = 0; k < p.loops.size(); ++k)
      under(std::to_string(k + 1), [&] {
        const CsgLoop& l = p.loops[k];
        if (!l.curves.empty() && l.curves[0].kind == CsgCurve::Kind::circle) {
          const auto& points = l.curves[0].points;
          if (!points.empty()) point(points[0], 1);
          if (points.size() == 2) number(points[1][0], "radius");
          return;
        }
        std::size_t n = 1;
        point(l.start, n);
        for (const CsgCurve& c : l.curves)
          for (const auto& xy : c.points) point(xy, ++n);
      });
  }
};

struct Finder {
  bool for_change;
  std::string_view whole = {};             ///< path, of the offsets in `steps`
  std::vector<PathStep>* steps = nullptr;  ///< the way taken so far; null = nobody asks

  [[nodiscard]] std::size_t offset(std::string_view part) const {
    return static_cast<std::size_t>(part.data() - whole.data());
  }
  /// find() below a step; one that leads nowhere is forgotten.
  std::optional<Place> below(const PathStep& step, const Place& at, std::string_view path) const {
    if (!steps) return find(at, path);
    steps->push_back(step);
    auto found = find(at, path);
    if (!found) steps->pop_back();
    return found;
  }

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
      case Shape::reals:
        return element_of_reals(at, path, static_cast<const std::vector<double>*>(at.data)->size());
      case Shape::setting: {
        const auto* v =
            std::get_if<std::vector<double>>(static_cast<const ProviderChoice::Param*>(at.data));
        return v ? element_of_reals(at, path, v->size()) : std::nullopt;
      }
      default: return std::nullopt;
    }
  }

  /// Number `path`, from 1, of so many.
  static std::optional<Place> element_of_reals(const Place& at, std::string_view path,
                                               std::size_t count) {
    const auto i = text::read_int(next_step(path));
    if (!i || !path.empty() || *i < 1 || *i > static_cast<std::int64_t>(count)) return std::nullopt;
    Place place = at;
    place.component = static_cast<std::size_t>(*i - 1);
    return place;
  }

  std::optional<Place> inner(Place at, void* data, std::string_view path) const {
    at.type = at.type->element;
    at.data = data;
    return find(at, path);
  }

  std::optional<Place> in_structure(const Place& at, std::string_view path) const {
    for (const Field& f : at.type->fields)
      if (f.is_addressed_by_names)
        if (auto found = in_member(f, at, path, true)) return found;
    for (const Field& f : at.type->fields) {
      std::string_view rest = path;
      if (!take(rest, f.path_word ? f.path_word(at.data) : f.name)) continue;
      // `measured.mass` is the mass of the mass properties, which have that name as well.
      if (f.is_path_flat && rest.empty())
        if (auto found = in_member(f, at, path)) return found;
      if (auto found = in_member(f, at, rest)) return found;
    }
    for (const Field& f : at.type->fields)
      if (f.is_path_flat)
        if (auto found = in_member(f, at, path)) return found;
    return std::nullopt;
  }
  std::optional<Place> in_member(const Field& f, const Place& at, std::string_view path,
                                 bool is_by_name = false) const {
    if (steps) steps->push_back({&f});
    auto found = is_by_name ? by_name(member(at, f), path) : find(member(at, f), path);
    if (steps && !found) steps->pop_back();
    return found;
  }

  /// Names may hold dots, so each is tried.
  std::optional<Place> by_name(const Place& list, std::string_view path) const {
    for (std::size_t i = 0; i < list.type->length(list.data); ++i) {
      const Place item = element(list, i);
      const std::string* name = name_of(*item.type, item.data);
      std::string_view rest = path;
      if (name && take(rest, *name)) {
        const std::size_t begin = steps ? offset(path) : 0;
        if (auto found = below({nullptr, i, begin, begin + name->size()},
                               for_change ? element(list, i, true) : item, rest))
          return found;
      }
    }
    return std::nullopt;
  }
  std::optional<Place> in_list(const Place& at, std::string_view path) const {
    std::string_view rest = path;
    const std::string_view number = next_step(rest);
    const auto i = text::read_int(number);
    if (i && *i >= 1 && *i <= static_cast<std::int64_t>(at.type->length(at.data))) {
      const auto k = static_cast<std::size_t>(*i - 1);
      const std::size_t begin = steps ? offset(number) : 0;
      return below({nullptr, k, begin, begin + number.size()}, element(at, k, for_change), rest);
    }
    return by_name(at, path);
  }
  std::optional<Place> in_table(const Place& at, std::string_view path) const {
    std::optional<Place> found;  // keys may hold dots: the longest that fits
    std::size_t longest = 0;
    at.type->each(at.data, [&](const std::string& key, const void* v) {
      std::string_view rest = path;
      if ((found && key.size() < longest) || !take(rest, key)) return;
      // The table is not const where it may be written.
      auto in_entry = inner(at, const_cast<void*>(v), rest);
      if (!in_entry) return;
      found = std::move(in_entry);
      longest = key.size();
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
  if (type->shape != Shape::setting) return nullptr;
  // Whole numbers and texts among the settings are none.
  auto* setting = static_cast<ProviderChoice::Param*>(data);
  if (component == kNoComponent) return std::get_if<double>(setting);
  auto* list = std::get_if<std::vector<double>>(setting);
  return list && component < list->size() ? list->data() + component : nullptr;
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

std::vector<PathStep> steps_of(const Content& c, std::string_view path) {
  std::vector<PathStep> steps;
  if (path.empty()) return steps;
  Place root;
  root.type = c.type;
  root.data = const_cast<void*>(c.data);  // nothing is written
  const auto found = Finder{false, path, &steps}.find(root, path);
  if (!found) steps.clear();
  return steps;
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

void for_each_number(const Content& c, const std::function<bool(const double&)>& wanted,
                     const std::function<void(const std::string& path, const double&)>& see) {
  Place root;
  root.type = c.type;
  root.data = const_cast<void*>(c.data);  // nothing is written
  NumberWalker{wanted, see}(root);
}

std::string known_path(const Content& c, std::string_view path) {
  const auto at = find(c, path);
  const double* wanted = at ? at->number() : nullptr;
  std::string out(path);
  if (wanted)
    for_each_number(
        c, [wanted](const double& v) { return &v == wanted; },
        [&out](const std::string& known, const double&) { out = known; });
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
