// SPDX-License-Identifier: Apache-2.0
#include "kernel/value.h"

#include <algorithm>

#include "kernel/text.h"
#include "kernel/value_text.h"

namespace robomosp {
namespace {

/// A number that reads back to the same one, as people write it: 100000, not 1e+05.
std::string plain_number(double v) { return text::print_rounded(v, 17); }

// Each of these may end once it has more than `most` bytes.

std::string numbers(const double* v, std::size_t count, std::size_t most) {
  std::string out = "{";
  for (std::size_t i = 0; i < count && out.size() <= most; ++i) {
    if (i) out += ", ";
    out += plain_number(v[i]);
  }
  return out + "}";
}

std::string array_text(const NumericArray& a, std::size_t most) {
  std::string out;
  if (a.is_matrix()) {
    out = "{";
    for (std::size_t r = 0; r < a.rows() && out.size() <= most; ++r) {
      if (r) out += ", ";
      out += numbers(a.data().data() + r * a.cols(), a.cols(), most);
    }
    out += "}";
  } else {
    out = numbers(a.data().data(), a.size(), most);
  }
  if (!a.unit().empty()) out += " " + a.unit();
  return out;
}

/// Text of anything but lists and maps.
std::string leaf_text(const Value& v, bool inside, std::size_t most) {
  switch (v.type()) {
    case Value::Type::boolean: return *v.as_bool() ? "true" : "false";
    case Value::Type::integer: return std::to_string(*v.as_int());
    case Value::Type::real: return plain_number(*v.as_real());
    case Value::Type::string: {
      const std::string_view all = *v.as_string();
      const std::string_view shown = all.substr(0, most < all.size() ? most + 1 : all.size());
      return inside ? text::quote(shown) : std::string(shown);
    }
    case Value::Type::array: return array_text(*v.as_array(), most);
    case Value::Type::handle:
      return v.as_handle()->kind + "#" + std::to_string(v.as_handle()->number);
    default: return "nil";
  }
}

}  // namespace

Map::Map(std::initializer_list<Entry> entries) {
  entries_.reserve(entries.size());
  for (const Entry& e : entries) set(e.first, e.second);
}

const Value* Map::find(std::string_view key) const {
  // Most keys differ in length or in their first character: few are compared whole.
  const auto it = std::find_if(entries_.begin(), entries_.end(), [key](const Entry& e) {
    return e.first.size() == key.size() && (key.empty() || e.first.front() == key.front()) &&
           e.first == key;
  });
  return it == entries_.end() ? nullptr : &it->second;
}

Value* Map::find(std::string_view key) {
  return const_cast<Value*>(std::as_const(*this).find(key));
}

namespace {

/// Makes space for one more. Most tables are of a few entries, and most others of a dozen.
template <class Entries>
void grow(Entries& entries) {
  constexpr std::size_t kFew = 4, kDozen = 12;
  if (entries.capacity() == 0) entries.reserve(kFew);
  else if (entries.size() == kFew && entries.capacity() == kFew) entries.reserve(kDozen);
}

}  // namespace

void Map::set(std::string key, Value value) {
  if (Value* old = find(key)) {
    *old = std::move(value);
    return;
  }
  grow(entries_);
  entries_.emplace_back(std::move(key), std::move(value));
}

void Map::append(std::string key, Value value) {
  grow(entries_);
  entries_.emplace_back(std::move(key), std::move(value));
}

bool Map::erase(std::string_view key) {
  return std::erase_if(entries_, [&](const Entry& e) { return e.first == key; }) != 0;
}

bool Map::operator==(const Map& o) const {
  if (size() != o.size()) return false;
  return std::all_of(begin(), end(), [&](const Entry& e) {
    const Value* other = o.find(e.first);
    return other && *other == e.second;
  });
}

std::string_view Value::type_name() const {
  constexpr std::string_view kNames[] = {"nil",   "bool", "int", "real",  "string",
                                         "array", "list", "map", "handle"};
  return kNames[static_cast<std::size_t>(type())];
}

bool Value::operator==(const Value& o) const {
  if (v_.index() != kShared && o.v_.index() != kShared) return v_ == o.v_;
  const Map *a = as_map(), *b = o.as_map();
  return a == b || (a && b && *a == *b);
}

void Value::unshare() {
  const std::shared_ptr<const Map> shared = std::get<kShared>(v_);
  v_ = Map(*shared);
}

double Value::number() const {
  if (const auto* i = as_int()) return static_cast<double>(*i);
  if (const auto* r = as_real()) return *r;
  return 0;
}

std::string Value::text() const { return beginning_of(*this, static_cast<std::size_t>(-1)); }

std::string beginning_of(const Value& value, std::size_t most) {
  return table_text(
      value, most, [most](const Value& v, bool is_inside) { return leaf_text(v, is_inside, most); },
      [](const std::string& name) {
        return (is_plain_name(name) ? name : "[" + text::quote(name) + "]") + " = ";
      });
}

bool is_plain_name(std::string_view s) {
  const auto letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  return !s.empty() && letter(s[0]) && std::all_of(s.begin(), s.end(), [&](char c) {
    return letter(c) || (c >= '0' && c <= '9');
  });
}

}  // namespace robomosp
