// SPDX-License-Identifier: Apache-2.0
// Determines the form of an STL file, text or binary, for all readers (layer: mathematics, std
// only).
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>

namespace robomosp::spatial {

/// Bytes before the first triangle of a binary file: a text of 80, and the number of triangles.
inline constexpr std::size_t kStlHead = 84;
/// Bytes of a triangle of a binary file: normal, corners, and two attribute bytes.
inline constexpr std::size_t kStlTriangle = 50;

/// True if STL is text: it begins with "solid", as headers of binary files may, too, and has no
/// zero byte where binary files have one: the last byte of the number of triangles is zero up to 16
/// million.
[[nodiscard]] inline bool is_text_stl(std::string_view bytes) {
  constexpr std::string_view kWord = "solid";
  const auto start = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  const std::string_view word = bytes.substr(start, kWord.size());
  return word.size() == kWord.size() &&
         std::equal(word.begin(), word.end(), kWord.begin(),
                    [](char a, char b) { return (a | 0x20) == b; }) &&
         bytes.substr(0, kStlHead).find('\0') == std::string_view::npos;
}

}  // namespace robomosp::spatial
