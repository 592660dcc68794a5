// SPDX-License-Identifier: Apache-2.0
#include "model/data.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <span>

namespace robomosp::model {

namespace {

template <class T>
const T& as(const void* p) {
  return *static_cast<const T*>(p);
}

using Param = ProviderChoice::Param;

// ---- fingerprint ----

struct Feeder {
  Fingerprinter& fp;
  const FeedReference& reference;

  void setting(const Param& value) {
    fp.add(static_cast<std::int64_t>(value.index()));
    std::visit(
        [this](const auto& v) {
          using V = std::decay_t<decltype(v)>;
          if constexpr (std::is_same_v<V, std::vector<double>>) fp.add(std::span<const double>(v));
          else if constexpr (std::is_same_v<V, std::string>) fp.add(std::string_view(v));
          else fp.add(v);
        },
        value);
  }

  void operator()(const Type& t, const void* p) {
    switch (t.shape) {
      case Shape::boolean: fp.add(as<bool>(p)); return;
      case Shape::integer:
      case Shape::word: fp.add(t.whole(p)); return;
      case Shape::real: fp.add(as<double>(p)); return;
      case Shape::text: fp.add(std::string_view(as<std::string>(p))); return;
      case Shape::numbers:
        fp.add(std::span<const double>(static_cast<const double*>(p), t.count));
        return;
      case Shape::reals: fp.add(std::span<const double>(as<std::vector<double>>(p))); return;
      case Shape::colour: {
        const auto& c = as<Colour>(p);
        for (const float v : {c.r, c.g, c.b, c.a}) fp.add(static_cast<double>(v));
        return;
      }
      case Shape::digest:
        for (const std::uint64_t v : as<std::array<std::uint64_t, 2>>(p))
          fp.add(static_cast<std::int64_t>(v));
        return;
      case Shape::reference: {
        const AnyId id = t.id(p);
        fp.add(static_cast<bool>(id));
        if (id) reference(fp, id);
        return;
      }
      case Shape::setting: setting(as<Param>(p)); return;
      case Shape::structure:
        for (const Field& f : t.fields) (*this)(*f.type, f.in(p));
        return;
      case Shape::list: {
        const std::size_t n = t.length(p);
        fp.add(n);
        for (std::size_t i = 0; i < n; ++i) (*this)(*t.element, t.at(p, i));
        return;
      }
      case Shape::optional:
      case Shape::shared: {
        const void* inner = t.held(p);
        fp.add(inner != nullptr);
        if (inner) (*this)(*t.element, inner);
        return;
      }
      case Shape::table: {
        std::size_t n = 0;
        t.each(p, [&n](const std::string&, const void*) { ++n; });
        fp.add(n);
        t.each(p, [&](const std::string& key, const void* v) {
          fp.add(std::string_view(key));
          (*this)(*t.element, v);
        });
        return;
      }
    }
  }
};

// ---- memory ----

/// Of a node of a map or set, with its links, besides what it holds.
constexpr std::size_t kNodeBytes = 64;
/// Of a list of blocks: what it keeps for each of its own.
constexpr std::size_t kBlockBytes = sizeof(std::shared_ptr<void>);

/// Short texts stand in the string itself.
std::size_t text_bytes(const std::string& s) {
  return s.capacity() > std::string().capacity() ? s.capacity() + 1 : 0;
}

/// `other`: another version of it; null = none.
std::size_t heap(const Type& t, const void* p, const void* other = nullptr) {
  if (!t.has_heap) return 0;
  switch (t.shape) {
    case Shape::text: return text_bytes(as<std::string>(p));
    case Shape::reals: return as<std::vector<double>>(p).capacity() * sizeof(double);
    case Shape::setting: {
      const auto& value = as<Param>(p);
      if (const auto* s = std::get_if<std::string>(&value)) return text_bytes(*s);
      if (const auto* v = std::get_if<std::vector<double>>(&value))
        return v->capacity() * sizeof(double);
      return 0;
    }
    case Shape::structure: {
      std::size_t n = 0;
      for (const Field& f : t.fields) n += heap(*f.type, f.in(p), other ? f.in(other) : nullptr);
      return n;
    }
    case Shape::list: {
      const std::size_t count = t.length(p);
      if (!t.block && !t.element->has_heap) return count * t.element->size;
      std::size_t n = t.block ? count / t.block * kBlockBytes : 0;
      for (std::size_t i = 0; i < count;) {
        if (const std::size_t shared = t.shared_from(p, other, i)) {
          i += shared;
          continue;
        }
        n += t.element->size + heap(*t.element, t.at(p, i++));
      }
      return n;
    }
    case Shape::optional: {
      const void* inner = t.held(p);
      return inner ? heap(*t.element, inner) : 0;
    }
    case Shape::table: {
      std::size_t n = 0;
      t.each(p, [&](const std::string& key, const void* v) {
        n += kNodeBytes + text_bytes(key) + t.element->size + heap(*t.element, v);
      });
      return n;
    }
    default: return 0;  // shared: an edit copies none of it
  }
}

// ---- equality ----

bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) || a == b ||
         (std::isnan(a) && std::isnan(b));
}
bool same(std::span<const double> a, std::span<const double> b) {
  if (a.size() != b.size()) return false;
  if (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0) return true;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!same(a[i], b[i])) return false;
  return true;
}
bool same(const Param& a, const Param& b) {
  if (a.index() != b.index()) return false;
  if (const auto* v = std::get_if<double>(&a)) return same(*v, std::get<double>(b));
  if (const auto* v = std::get_if<std::vector<double>>(&a))
    return same(std::span<const double>(*v), std::get<std::vector<double>>(b));
  return a == b;
}

bool same(const Type& t, const void* a, const void* b);

bool same_tables(const Type& t, const void* a, const void* b) {
  std::vector<std::pair<const std::string*, const void*>> left;
  t.each(a, [&](const std::string& key, const void* v) { left.emplace_back(&key, v); });
  std::size_t i = 0;
  bool is_same = true;
  t.each(b, [&](const std::string& key, const void* v) {
    is_same =
        is_same && i < left.size() && *left[i].first == key && same(*t.element, left[i].second, v);
    ++i;
  });
  return is_same && i == left.size();
}

/// Two lists of blocks, as long as each other.
bool same_blocks(const Type& t, const void* a, const void* b) {
  const std::size_t n = t.length(a);
  for (std::size_t i = 0; i < n;) {
    if (const std::size_t shared = t.shared_from(a, b, i)) {
      i += shared;
    } else {
      if (!same(*t.element, t.at(a, i), t.at(b, i))) return false;
      ++i;
    }
  }
  return true;
}

bool same(const Type& t, const void* a, const void* b) {
  switch (t.shape) {
    case Shape::boolean: return as<bool>(a) == as<bool>(b);
    case Shape::integer:
    case Shape::word: return t.whole(a) == t.whole(b);
    case Shape::real: return same(as<double>(a), as<double>(b));
    case Shape::text: return as<std::string>(a) == as<std::string>(b);
    case Shape::numbers:
      return same(std::span(static_cast<const double*>(a), t.count),
                  std::span(static_cast<const double*>(b), t.count));
    case Shape::reals:
      return same(std::span<const double>(as<std::vector<double>>(a)),
                  std::span<const double>(as<std::vector<double>>(b)));
    case Shape::colour: {
      const auto &x = as<Colour>(a), &y = as<Colour>(b);
      return x.r == y.r && x.g == y.g && x.b == y.b && x.a == y.a;
    }
    case Shape::digest: return std::memcmp(a, b, t.size) == 0;
    case Shape::reference: {
      const AnyId x = t.id(a), y = t.id(b);
      return x == y || (!x && !y);
    }
    case Shape::setting: return same(as<Param>(a), as<Param>(b));
    case Shape::structure:
      for (const Field& f : t.fields)
        if (!same(*f.type, f.in(a), f.in(b))) return false;
      return true;
    case Shape::list: {
      const std::size_t n = t.length(a);
      if (n != t.length(b)) return false;
      if (t.block) return same_blocks(t, a, b);
      if (t.data(a) == t.data(b)) return true;
      for (std::size_t i = n; i-- > 0;)  // edits are more often at the end
        if (!same(*t.element, t.at(a, i), t.at(b, i))) return false;
      return true;
    }
    case Shape::optional:
    case Shape::shared: {
      const void *x = t.held(a), *y = t.held(b);
      if (x == y) return true;
      return x && y && same(*t.element, x, y);
    }
    case Shape::table: return same_tables(t, a, b);
  }
  return false;
}

void differ(const Type& t, const void* a, const void* b, const std::string& path,
            std::vector<std::string>& out) {
  if (same(t, a, b)) return;
  if (t.shape == Shape::structure) {
    for (const Field& f : t.fields)
      differ(*f.type, f.in(a), f.in(b),
             path.empty() ? std::string(f.name) : path + "." + std::string(f.name), out);
    return;
  }
  if (t.shape == Shape::list && t.length(a) == t.length(b)) {
    for (std::size_t i = 0; i < t.length(a);) {
      if (const std::size_t shared = t.shared_from(a, b, i)) {
        i += shared;
        continue;
      }
      differ(*t.element, t.at(a, i), t.at(b, i), path + "[" + std::to_string(i + 1) + "]", out);
      ++i;
    }
    return;
  }
  if (t.shape == Shape::optional || t.shape == Shape::shared) {
    const void *x = t.held(a), *y = t.held(b);
    if (x && y) return differ(*t.element, x, y, path, out);
  }
  out.push_back(path);
}

// ---- references ----

}  // namespace

std::span<const Kind> kinds_of(const Field& f, const Type& reference) {
  if (!f.kinds.empty()) return f.kinds;
  if (!reference.kinds.empty()) return reference.kinds;
  const auto named = kind_from(f.name);
  return named ? all_kinds().subspan(static_cast<std::size_t>(*named), 1) : std::span<const Kind>();
}

namespace {

struct References {
  const std::function<void(const HeldReference&)>& see;

  /// `before`: an earlier version of it, whose blocks are passed over; null = none.
  void operator()(const Type& t, const void* p, std::string_view element, const Field* field,
                  const void* before = nullptr) {
    if (!t.has_references) return;
    switch (t.shape) {
      case Shape::reference:
        if (const AnyId id = t.id(p))
          see({id, element.empty() ? field->name : element, kinds_of(*field, t)});
        return;
      case Shape::structure:
        if (const std::string* name = field ? name_of(t, p) : nullptr) element = *name;
        for (const Field& f : t.fields)
          (*this)(*f.type, f.in(p), element, &f, before ? f.in(before) : nullptr);
        return;
      case Shape::list:
        for (std::size_t i = 0; i < t.length(p);) {
          if (const std::size_t shared = t.shared_from(p, before, i)) i += shared;
          else (*this)(*t.element, t.at(p, i++), element, field);
        }
        return;
      case Shape::optional:
        if (const void* inner = t.held(p)) (*this)(*t.element, inner, element, field);
        return;
      case Shape::table:
        t.each(p,
               [&](const std::string&, const void* v) { (*this)(*t.element, v, element, field); });
        return;
      default: return;
    }
  }
};

}  // namespace

std::string Field::shown_name() const {
  if (!title.empty()) return std::string(title);
  std::string s(name);
  for (char& c : s)
    if (c == '_') c = ' ';
  return s;
}

std::string_view Field::word_in_files() const {
  if (!file_word.empty()) return file_word;
  const bool is_list = type->shape == Shape::list && type->element->shape == Shape::structure;
  return is_list && name.ends_with('s') ? name.substr(0, name.size() - 1) : name;
}

std::string_view Field::unit_of(const void* owner, std::size_t i, std::size_t alternative) const {
  if (unit_at) return unit_at(owner, i);
  std::string_view unit = si_unit;
  for (; alternative > 0; --alternative) {
    const auto bar = unit.find('|');
    if (bar != std::string_view::npos) unit.remove_prefix(bar + 1);
  }
  return unit.substr(0, unit.find('|'));
}

const Field* Type::field(std::string_view name) const {
  for (const Field& f : fields)
    if (f.name == name) return &f;
  return nullptr;
}

std::string_view Type::word_of(const void* p) const {
  const std::int64_t value = whole(p);
  for (const Word& w : words)
    if (w.value == value) return w.word;
  return {};
}

const std::string* name_of(const Type& t, const void* p) {
  if (t.shape != Shape::structure) return nullptr;
  const Field* f = t.field("name");
  return f && f->type->shape == Shape::text ? &as<std::string>(f->in(p)) : nullptr;
}

OtherContent::OtherContent(Kind kind)
    : kind_(kind), value_(info(kind).type->clone(info(kind).type->standard.get())) {}
OtherContent::OtherContent(const OtherContent& o)
    : kind_(o.kind_), value_(info(o.kind_).type->clone(o.value_.get())) {}
OtherContent& OtherContent::operator=(const OtherContent& o) {
  if (this != &o) *this = OtherContent(o);
  return *this;
}

Content content(const Body& body) {
  return content(const_cast<Body&>(body));  // only its address is taken
}
MutableContent content(Body& body) {
  return {info(kind_of_body(body)).type,
          std::visit(
              [](auto& b) -> void* {
                if constexpr (std::is_same_v<std::decay_t<decltype(b)>, OtherContent>)
                  return b.data();
                else return &b;
              },
              body)};
}

namespace {
template <std::size_t I = 0>
Body make_body(std::size_t index) {
  if constexpr (I + 1 < std::variant_size_v<Body>) {
    if (index == I) return Body(std::in_place_index<I>);
    return make_body<I + 1>(index);
  } else {
    return OtherContent(static_cast<Kind>(index));
  }
}
}  // namespace
Body empty_body(Kind kind) { return make_body(static_cast<std::size_t>(kind)); }

void feed(Fingerprinter& fp, const Content& c, const FeedReference& reference) {
  Feeder{fp, reference}(*c.type, c.data);
}

std::size_t heap_bytes(const Content& c, const Content& other) {
  return heap(*c.type, c.data, other.type == c.type ? other.data : nullptr);
}

bool equal(const Content& a, const Content& b) {
  return a.type == b.type && same(*a.type, a.data, b.data);
}
bool equal(const Body& a, const Body& b) { return equal(content(a), content(b)); }

std::vector<std::string> differences(const Body& before, const Body& after) {
  const Content a = content(before), b = content(after);
  std::vector<std::string> out;
  if (a.type != b.type) out.emplace_back();
  else differ(*a.type, a.data, b.data, {}, out);
  return out;
}

void for_each_held_reference(const Content& c, const std::function<void(const HeldReference&)>& fn,
                             const Content& before) {
  References{fn}(*c.type, c.data, {}, nullptr, before.type == c.type ? before.data : nullptr);
}
void for_each_reference(const Body& body, const std::function<void(AnyId, std::string_view)>& fn) {
  for_each_held_reference(content(body), [&fn](const HeldReference& r) { fn(r.id, r.where); });
}

}  // namespace robomosp::model
