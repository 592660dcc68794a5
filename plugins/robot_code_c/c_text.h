// SPDX-License-Identifier: Apache-2.0
// Pieces of C text (layer: plugin).
#pragma once

#include <charconv>
#include <cstdint>
#include <string>
#include <vector>

namespace robomosp::robot_code {

/// The shortest literal of a double that reads back as the same.
[[nodiscard]] inline std::string c_literal(double v) {
  char buffer[40];
  std::string s(buffer, std::to_chars(buffer, buffer + sizeof buffer, v).ptr);
  return s.find_first_of(".en") == std::string::npos ? s + ".0" : s;
}
[[nodiscard]] inline std::string c_literal(std::size_t v) { return std::to_string(v); }
[[nodiscard]] inline std::string c_literal(std::int32_t v) { return std::to_string(v); }

/// A constant array, which has at least one value.
template <class T>
[[nodiscard]] std::string c_table(const std::string& type, const std::string& name,
                                  const std::vector<T>& values) {
  constexpr std::size_t kWidth = 96;
  std::string s = "static const " + type + " " + name + "[" + std::to_string(values.size()) +
                  "] = {",
              line;
  for (const T& v : values) {
    const std::string word = c_literal(v) + ",";
    if (line.size() + word.size() + 3 > kWidth) s += "\n  " + line, line.clear();
    line += (line.empty() ? "" : " ") + word;
  }
  line.pop_back();
  return s + "\n  " + line + "};\n";
}

[[nodiscard]] inline std::string replaced(std::string s, const std::string& key,
                                          const std::string& by) {
  for (std::size_t at = 0; (at = s.find(key, at)) != std::string::npos; at += by.size())
    s.replace(at, key.size(), by);
  return s;
}

}  // namespace robomosp::robot_code
