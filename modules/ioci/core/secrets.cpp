// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/secrets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "ioci/core/application.h"
#include "kernel/text.h"
#include "kernel/utf8.h"

namespace robomosp::ioci {
namespace {

constexpr std::array<std::string_view, 5> kSecretWords{"token", "password", "passphrase", "secret",
                                                       "credential"};

/// The reserved words of Lua 5.4.
constexpr std::array<std::string_view, 22> kReserved{
    "and",      "break",  "do",   "else", "elseif", "end",  "false", "for",
    "function", "goto",   "if",   "in",   "local",  "nil",  "not",   "or",
    "repeat",   "return", "then", "true", "until",  "while"};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }

/// Whether it can stand for a key without brackets.
bool is_lua_name(std::string_view s) {
  return !s.empty() && is_letter(s.front()) && std::all_of(s.begin(), s.end(), [](char c) {
    return is_letter(c) || (c >= '0' && c <= '9');
  }) && std::find(kReserved.begin(), kReserved.end(), s) == kReserved.end();
}

std::string lua_string(std::string_view s, std::size_t most) {
  std::string out = "\"";
  std::size_t good = text::first_bad_byte(s);  // what is no text stays the bytes that it is
  for (std::size_t i = 0; i < s.size() && out.size() <= most; ++i) {
    const auto byte = static_cast<unsigned char>(s[i]);
    const bool is_bad = i == good;
    if (is_bad) {
      const std::size_t next = text::first_bad_byte(s.substr(i + 1));
      good = next == std::string_view::npos ? next : i + 1 + next;
    }
    if (s[i] == '"' || s[i] == '\\') {
      out += '\\';
      out += s[i];
    } else if (s[i] == '\n') {
      out += "\\n";
    } else if (byte < 0x20 || byte == 0x7f || is_bad) {
      const std::string digits = std::to_string(byte);
      out += "\\" + std::string(3 - digits.size(), '0') + digits;
    } else {
      out += s[i];
    }
  }
  return out + "\"";
}

std::string lua_number(double v) {
  if (std::isnan(v)) return "0/0";
  if (std::isinf(v)) return v > 0 ? "1/0" : "-1/0";
  return text::print(v);
}

std::string lua_array(const NumericArray& a, std::size_t most) {
  std::string out = "{";
  const std::size_t rows = a.rows(), cols = a.is_matrix() ? a.cols() : 1;
  for (std::size_t r = 0; r < rows && out.size() <= most; ++r) {
    if (r > 0) out += ", ";
    if (a.is_matrix()) out += "{";
    for (std::size_t c = 0; c < cols && out.size() <= most; ++c) {
      if (c > 0) out += ", ";
      out += lua_number(a[r * cols + c]);
    }
    if (a.is_matrix()) out += "}";
  }
  return out + "}";
}

std::string leaf(const Application& app, const Value& v, std::size_t most) {
  switch (v.type()) {
    case Value::Type::nil: return "nil";
    case Value::Type::boolean: return *v.as_bool() ? "true" : "false";
    case Value::Type::integer:
      return *v.as_int() == std::numeric_limits<std::int64_t>::min() ? "math.mininteger"
                                                                     : std::to_string(*v.as_int());
    case Value::Type::real: return lua_number(*v.as_real());
    case Value::Type::string: return lua_string(*v.as_string(), most);
    case Value::Type::array: return lua_array(*v.as_array(), most);
    case Value::Type::handle: {
      const Handle& h = *v.as_handle();
      const auto name = kind_from(h.kind) ? app.name_of(h) : std::nullopt;
      return lua_string(name.value_or(h.kind + "#" + std::to_string(h.number)), most);
    }
    case Value::Type::list:
    case Value::Type::map: break;
  }
  return "nil";
}

std::string key_text(const std::string& key, std::size_t most) {
  return (is_lua_name(key) ? key : "[" + lua_string(key, most) + "]") + " = ";
}

/// Calls `visit(name, value)` for all entries of maps among arguments, at any depth, until it
/// returns true; whether it did.
template <class Visit>
bool any_entry(const Map& args, const Visit& visit) {
  std::vector<const Value*> open;
  const auto look = [&](const Map& map) {
    return std::any_of(map.begin(), map.end(), [&](const Map::Entry& e) {
      if (visit(e.first, e.second)) return true;
      if (e.second.as_map() || e.second.as_list()) open.push_back(&e.second);
      return false;
    });
  };
  if (look(args)) return true;
  while (!open.empty()) {
    const Value* at = open.back();
    open.pop_back();
    if (const Map* map = at->as_map()) {
      if (look(*map)) return true;
    } else {
      for (const Value& each : *at->as_list())
        if (each.as_map() || each.as_list()) open.push_back(&each);
    }
  }
  return false;
}

// NOLINTBEGIN(misc-no-recursion): values are as deep as what made them
Map redacted(const Map& args);
Value redacted(const Value& v) {
  if (const Map* map = v.as_map()) return redacted(*map);
  const List* list = v.as_list();
  if (!list) return v;
  List out;
  for (const Value& each : *list) out.push_back(redacted(each));
  return out;
}
Map redacted(const Map& args) {
  Map out;
  for (const auto& [name, value] : args)
    out.append(name, is_secret(name) && !value.is_nil() ? Value(kRedacted) : redacted(value));
  return out;
}
// NOLINTEND(misc-no-recursion)

}  // namespace

bool is_secret(std::string_view argument) {
  std::string word;
  bool is_found = false;
  const auto take = [&] {
    // token and tokens, but not tokenizer.
    const std::string_view one = word.size() > 1 && word.back() == 's'
                                     ? std::string_view(word).substr(0, word.size() - 1)
                                     : std::string_view(word);
    for (const std::string_view secret : kSecretWords)
      is_found = is_found || secret == word || secret == one;
  };
  for (const char c : argument) {
    if (c != '_' && c != '-' && c != '.') {
      word += static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
      continue;
    }
    take();
    word.clear();
  }
  take();
  return is_found && word != "file";
}

bool has_secrets(const Map& args) {
  return any_entry(args, [](const std::string& name, const Value& value) {
    const std::string* text = value.as_string();
    return is_secret(name) && !value.is_nil() && !(text && *text == kRedacted);
  });
}

Map without_secrets(const Map& args) { return has_secrets(args) ? redacted(args) : args; }

std::string lua_text(const Application& app, const Value& value, std::size_t most) {
  // An explicit stack: depth is the user's, not ours.
  struct Level {
    const Value* container;
    std::size_t next = 0;
  };
  if (!value.as_list() && !value.as_map()) return leaf(app, value, most);
  std::string out = "{";
  std::vector<Level> stack{{&value}};
  while (!stack.empty() && out.size() <= most) {
    Level& level = stack.back();
    const List* list = level.container->as_list();
    const Map* map = level.container->as_map();
    if (level.next == (list ? list->size() : map->size())) {
      out += "}";
      stack.pop_back();
      continue;
    }
    if (level.next > 0) out += ", ";
    const Value* item = nullptr;
    if (list) {
      item = &(*list)[level.next];
    } else {
      const Map::Entry& entry = *(map->begin() + static_cast<std::ptrdiff_t>(level.next));
      out += key_text(entry.first, most);
      item = &entry.second;
    }
    ++level.next;
    if (item->as_list() || item->as_map()) {
      out += "{";
      stack.push_back({item});
    } else {
      out += leaf(app, *item, most);
    }
  }
  return out;
}

LuaLine lua_line(const Application& app, const CommandSpec& spec, const Map& args,
                 std::size_t most) {
  LuaLine out{spec.name, !has_secrets(args)};
  if (args.empty()) return {out.text + "()", true};
  out.text += "{";
  std::optional<Map> shown;
  if (!out.is_whole) shown = without_secrets(args);
  bool is_first = true;
  for (const auto& [name, value] : shown ? *shown : args) {
    if (out.text.size() > most) break;
    if (!std::exchange(is_first, false)) out.text += ", ";
    out.text += key_text(name, most) + lua_text(app, value, most);
  }
  if (out.text.size() <= most) {
    out.text += "}";
    return out;
  }
  out.text.resize(most);
  while (!out.text.empty() && (static_cast<unsigned char>(out.text.back()) & 0xC0U) == 0x80U)
    out.text.pop_back();
  if (!out.text.empty() && (static_cast<unsigned char>(out.text.back()) & 0x80U) != 0)
    out.text.pop_back();
  out.text += " ...";
  out.is_whole = false;
  return out;
}

}  // namespace robomosp::ioci
