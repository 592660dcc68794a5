// SPDX-License-Identifier: Apache-2.0
// Text of files as UTF-8, whichever encoding it is in, for importers and for the program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include <robomosp/sdk/names.h>

namespace robomosp {

/// Adds a code point in UTF-8.
inline void put_utf8(std::string& out, std::uint32_t code) {
  const auto byte = [&](std::uint32_t b) { out += static_cast<char>(b); };
  if (code < 0x80) return byte(code);
  if (code < 0x800) {
    byte(0xC0U | (code >> 6U));
  } else if (code < 0x10000) {
    byte(0xE0U | (code >> 12U));
    byte(0x80U | ((code >> 6U) & 0x3FU));
  } else {
    byte(0xF0U | (code >> 18U));
    byte(0x80U | ((code >> 12U) & 0x3FU));
    byte(0x80U | ((code >> 6U) & 0x3FU));
  }
  byte(0x80U | (code & 0x3FU));
}

/// UTF-16 without its byte order mark. Single halves of a pair, and half a letter at the
/// end, become U+FFFD.
[[nodiscard]] inline std::string utf8_from_utf16(std::string_view bytes, bool is_big) {
  constexpr std::uint32_t kUnknown = 0xFFFD;
  const auto unit = [&](std::size_t i) {
    const auto a = static_cast<unsigned char>(bytes[i]),
               b = static_cast<unsigned char>(bytes[i + 1]);
    return is_big ? (std::uint32_t{a} << 8U) | b : (std::uint32_t{b} << 8U) | a;
  };
  std::string out;
  out.reserve(bytes.size() / 2);
  std::size_t i = 0;
  for (; i + 2 <= bytes.size(); i += 2) {
    std::uint32_t code = unit(i);
    if (code >= 0xD800 && code < 0xE000) {
      const std::uint32_t next = code < 0xDC00 && i + 4 <= bytes.size() ? unit(i + 2) : 0;
      if (next >= 0xDC00 && next < 0xE000) {
        code = 0x10000 + ((code - 0xD800) << 10U) + (next - 0xDC00);
        i += 2;
      } else {
        code = kUnknown;
      }
    }
    put_utf8(out, code);
  }
  if (i < bytes.size()) put_utf8(out, kUnknown);
  return out;
}

/// ISO 8859-1: a byte a letter.
[[nodiscard]] inline std::string utf8_from_latin1(std::string_view bytes) {
  std::string out;
  for (const char c : bytes) put_utf8(out, static_cast<unsigned char>(c));
  return out;
}

/// Whether all bytes are UTF-8 (RFC 3629).
[[nodiscard]] inline bool is_utf8(std::string_view bytes) {
  for (std::size_t i = 0; i < bytes.size();) {
    const std::size_t size = name_rules::code_point(bytes, i).second;
    if (size == 0) return false;
    i += size;
  }
  return true;
}

enum class TextEncoding : std::uint8_t { utf8, utf16, latin1 };
struct Utf8Text {
  std::string text;  ///< without a byte order mark
  TextEncoding was = TextEncoding::utf8;
};
/// A byte order mark identifies UTF-8 or UTF-16 and is taken off; other bytes that are no UTF-8 are
/// taken as ISO 8859-1, which the declarations of older files name.
[[nodiscard]] inline Utf8Text utf8_text(std::string_view bytes) {
  constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF", kLittle = "\xFF\xFE", kBig = "\xFE\xFF";
  if (bytes.starts_with(kLittle) || bytes.starts_with(kBig))
    return {utf8_from_utf16(bytes.substr(2), bytes.starts_with(kBig)), TextEncoding::utf16};
  if (bytes.starts_with(kUtf8Mark)) bytes.remove_prefix(kUtf8Mark.size());
  if (is_utf8(bytes)) return {std::string(bytes), TextEncoding::utf8};
  return {utf8_from_latin1(bytes), TextEncoding::latin1};
}

}  // namespace robomosp
