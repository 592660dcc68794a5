// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/lua_line.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "ioci/core/application.h"
#include "ioci/core/handle_text.h"
#include "ioci/core/secrets.h"
#include "kernel/text.h"
#include "kernel/utf8.h"
#include "kernel/value_text.h"

namespace robomosp::ioci {
namespace {

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

/// `app` may be null: then records have no names.
std::string leaf(const Application* app, const Value& v, std::size_t most) {
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
      const auto name = app ? reference_text(*app->document.now(), h) : std::nullopt;
      return lua_string(name.value_or(h.kind + "#" + std::to_string(h.number)), most);
    }
    case Value::Type::list:
    case Value::Type::map: break;
  }
  return "nil";
}

std::string key_text(const std::string& key, std::size_t most) {
  return (is_lua_key(key) ? key : "[" + lua_string(key, most) + "]") + " = ";
}

}  // namespace

bool is_lua_key(std::string_view s) {
  return is_plain_name(s) &&
         std::find(kLuaKeywords.begin(), kLuaKeywords.end(), s) == kLuaKeywords.end();
}

namespace {

std::string text_of_value(const Application* app, const Value& value, std::size_t most) {
  return table_text(
      value, most, [&](const Value& v, bool) { return leaf(app, v, most); },
      [most](const std::string& name) { return key_text(name, most); });
}

}  // namespace

std::string lua_text(const Application& app, const Value& value, std::size_t most) {
  return text_of_value(&app, value, most);
}
std::string lua_text(const Value& value, std::size_t most) {
  return text_of_value(nullptr, value, most);
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
