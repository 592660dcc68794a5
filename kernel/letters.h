// SPDX-License-Identifier: Apache-2.0
// ASCII letters and digits, whatever the locale; other bytes (UTF-8) stay as they are.
#pragma once

#include <string>
#include <string_view>

namespace robomosp::text {

inline bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The text with A to Z as a to z.
inline std::string lower(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + ('a' - 'A'));
  return out;
}

/// The text with a to z as A to Z.
inline std::string upper(std::string_view s) {
  std::string out(s);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - ('a' - 'A'));
  return out;
}

}  // namespace robomosp::text
