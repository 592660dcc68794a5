// SPDX-License-Identifier: Apache-2.0
// Small JSON texts, safe inside an HTML script element (layer: application, scene). Internal to
// modules/scene.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kernel/text.h"

namespace robomosp::scene::json {

/// A name and a text that is JSON already.
struct Field {
  std::string_view name;
  std::string value;
};

/// Quoted; control characters and `<`, which could end the element, are escaped.
[[nodiscard]] inline std::string text(std::string_view s) {
  std::string out = "\"";
  for (const char c : s) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (code < 0x20 || c == '<') {
      constexpr std::string_view kDigits = "0123456789abcdef";
      out += "\\u00";
      out += kDigits[code >> 4U];
      out += kDigits[code & 15U];
    } else {
      out += c;
    }
  }
  return out + "\"";
}
[[nodiscard]] inline std::string whole(std::size_t n) { return std::to_string(n); }
/// Finite numbers; `digits` significant ones, or all that matter.
[[nodiscard]] inline std::string number(double x, int digits = 0) {
  return digits > 0 ? robomosp::text::print_rounded(x, digits) : robomosp::text::print(x);
}
[[nodiscard]] inline std::string list(std::span<const std::string> values) {
  return "[" + robomosp::text::join(values, ",") + "]";
}
[[nodiscard]] inline std::string numbers(std::span<const double> values, int digits = 0) {
  std::vector<std::string> out;
  for (const double x : values) out.push_back(number(x, digits));
  return list(out);
}
[[nodiscard]] inline std::string object(std::span<const Field> fields) {
  std::vector<std::string> out;
  for (const Field& f : fields) out.push_back(text(f.name) + ":" + f.value);
  return "{" + robomosp::text::join(out, ",") + "}";
}
[[nodiscard]] inline std::string object(std::initializer_list<Field> fields) {
  return object(std::span(fields.begin(), fields.size()));
}

}  // namespace robomosp::scene::json
