// SPDX-License-Identifier: Apache-2.0
// Names of records, links and other members, in any language, for importers and for the program.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace robomosp {
namespace name_rules {

/// The code point that begins at `at` and its bytes; {0, 0} where that is not UTF-8 (RFC 3629).
[[nodiscard]] constexpr std::pair<std::uint32_t, std::size_t> code_point(std::string_view s,
                                                                         std::size_t at) {
  const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<std::uint8_t>(s[i])}; };
  const std::uint32_t first = byte(at);
  if (first < 0x80) return {first, 1};
  const std::size_t bytes = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4 || s.size() - at < bytes) return {0, 0};
  std::uint32_t point = first & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(at + i) & 0xC0) != 0x80) return {0, 0};
    point = (point << 6) | (byte(at + i) & 0x3F);
  }
  const bool is_too_long = (bytes == 3 && point < 0x800) || (bytes == 4 && point < 0x10000);
  if (is_too_long || point > 0x10FFFF || (point >= 0xD800 && point <= 0xDFFF)) return {0, 0};
  return {point, bytes};
}

/// Letters, digits and marks beyond ASCII: ranges of C11, annex D.1, without what is invisible or
/// turns the direction of text (soft hyphen, spaces of no width but the joiners of Persian and
/// Indic scripts, U+202A to U+202E, U+2060 to U+206F).
[[nodiscard]] constexpr bool is_letter_beyond_ascii(std::uint32_t c) {
  constexpr std::array<std::pair<std::uint32_t, std::uint32_t>, 35> kRanges{
      {{0xA8, 0xA8},       {0xAA, 0xAA},       {0xAF, 0xAF},       {0xB2, 0xB5},
       {0xB7, 0xBA},       {0xBC, 0xBE},       {0xC0, 0xD6},       {0xD8, 0xF6},
       {0xF8, 0x167F},     {0x1681, 0x180D},   {0x180F, 0x1FFF},   {0x200C, 0x200D},
       {0x203F, 0x2040},   {0x2054, 0x2054},   {0x2070, 0x218F},   {0x2460, 0x24FF},
       {0x2776, 0x2793},   {0x2C00, 0x2DFF},   {0x2E80, 0x2FFF},   {0x3004, 0x3007},
       {0x3021, 0x302F},   {0x3031, 0xD7FF},   {0xF900, 0xFD3D},   {0xFD40, 0xFDCF},
       {0xFDF0, 0xFE44},   {0xFE47, 0xFEFE},   {0xFF00, 0xFFEF},   {0x10000, 0x1FFFD},
       {0x20000, 0x2FFFD}, {0x30000, 0x3FFFD}, {0x40000, 0x4FFFD}, {0x50000, 0x5FFFD},
       {0x60000, 0x6FFFD}, {0x70000, 0x7FFFD}, {0x80000, 0x8FFFD}}};
  for (const auto& [first, last] : kRanges)
    if (c >= first && c <= last) return true;
  return false;
}

[[nodiscard]] constexpr bool is_ascii_letter(std::uint32_t c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

/// Marks that combine with the letter before them do not begin a name (C11, annex D.2).
[[nodiscard]] constexpr bool is_mark(std::uint32_t c) {
  return (c >= 0x300 && c <= 0x36F) || (c >= 0x1DC0 && c <= 0x1DFF) ||
         (c >= 0x20D0 && c <= 0x20FF) || (c >= 0xFE20 && c <= 0xFE2F) || c == 0x200C || c == 0x200D;
}

[[nodiscard]] constexpr bool begins(std::uint32_t c) {
  return is_ascii_letter(c) || (is_letter_beyond_ascii(c) && !is_mark(c));
}

}  // namespace name_rules

/// Whether a record, link or other member may have this name: UTF-8 that begins with a letter of
/// any script, has letters and digits of any script, _ - . and spaces, and ends in no space. Names
/// are equal when their bytes are: no normal form of Unicode is made.
[[nodiscard]] constexpr bool is_name(std::string_view name) {
  if (name.empty() || name.back() == ' ') return false;
  for (std::size_t i = 0; i < name.size();) {
    const auto [c, bytes] = name_rules::code_point(name, i);
    if (bytes == 0) return false;
    const bool is_letter = name_rules::is_ascii_letter(c) || name_rules::is_letter_beyond_ascii(c);
    if (i == 0
            ? !name_rules::begins(c)
            : !is_letter && !(c >= '0' && c <= '9') && c != '_' && c != '-' && c != '.' && c != ' ')
      return false;
    i += bytes;
  }
  return true;
}

/// The text with "_" for every character that cannot be in a name, and for every byte that is no
/// UTF-8.
[[nodiscard]] inline std::string with_name_characters(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t bytes = std::max<std::size_t>(name_rules::code_point(text, i).second, 1);
    const std::string_view one = text.substr(i, bytes);
    out += is_name("a" + std::string(one) + "a") ? one : "_";
    i += bytes;
  }
  return out;
}

/// A name near to what a file says, of at most 80 bytes, without spaces and dots: other characters
/// become one "_" for each run of them, none at the ends; "n" before a digit. Where nothing is
/// left, the same of `otherwise`, or "part".
[[nodiscard]] inline std::string valid_name(std::string_view wanted, std::string_view otherwise) {
  constexpr std::size_t kLongest = 80;
  std::string out;
  bool is_gap = false;
  for (std::size_t i = 0; i < wanted.size();) {
    auto [c, bytes] = name_rules::code_point(wanted, i);
    const bool is_letter =
        bytes > 0 && (name_rules::is_ascii_letter(c) || name_rules::is_letter_beyond_ascii(c));
    const bool is_fine = is_letter || (c >= '0' && c <= '9') || c == '-' || c == '_';
    bytes = std::max<std::size_t>(bytes, 1);
    if (!is_fine || (out.empty() && (c == '-' || c == '_'))) {
      is_gap = !out.empty();
    } else {
      if (out.empty() && !name_rules::begins(c)) out = "n";
      if (out.size() + (is_gap ? 1 : 0) + bytes > kLongest) break;
      if (is_gap) out += '_';
      out += wanted.substr(i, bytes);
      is_gap = false;
    }
    i += bytes;
  }
  while (!out.empty() && out.back() == '_') out.pop_back();
  if (!out.empty()) return out;
  return otherwise.empty() ? "part" : valid_name(otherwise, {});
}

}  // namespace robomosp
