// SPDX-License-Identifier: Apache-2.0
#include "ioci/program/source_bytes.h"

#include <algorithm>
#include <cstdint>

#include "kernel/utf8.h"

namespace robomosp::ioci {
namespace {

constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF", kLittleMark = "\xFF\xFE",
                           kBigMark = "\xFE\xFF";

void put(std::string& out, std::uint32_t code) {
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

/// Halves of a pair that stand alone, and half a letter at the end, become U+FFFD.
std::string from_utf16(std::string_view bytes, bool is_big) {
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
    put(out, code);
  }
  if (i < bytes.size()) put(out, kUnknown);
  return out;
}

std::string from_latin1(std::string_view bytes) {
  std::string out;
  for (const char c : bytes)
    if (c != 0) put(out, static_cast<unsigned char>(c));
  return out;
}

std::size_t line_of(std::string_view text, std::size_t at) {
  return 1 + static_cast<std::size_t>(
                 std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

}  // namespace

Result<SourceBytes> source_of_bytes(std::string_view bytes) {
  SourceBytes out;
  const bool is_little = bytes.starts_with(kLittleMark);
  if (is_little || bytes.starts_with(kBigMark)) {
    out.text = from_utf16(bytes.substr(kLittleMark.size()), !is_little);
    out.note = "the file is in UTF-16 and was read so; it is kept in UTF-8";
  } else {
    if (bytes.starts_with(kUtf8Mark)) bytes.remove_prefix(kUtf8Mark.size());
    const std::size_t bad = text::first_bad_byte(bytes);
    if (bad == std::string_view::npos) {
      out.text = bytes;
      return out;
    }
    out.text = bytes.find('\0') == std::string_view::npos ? from_latin1(bytes) : std::string(bytes);
    out.note =
        "line " + std::to_string(line_of(bytes, bad)) +
        " is no UTF-8, so that the file was read as ISO 8859-1 (Latin-1); it is kept in UTF-8";
  }
  if (const std::size_t zero = out.text.find('\0'); zero != std::string::npos)
    return error(
        ErrorCode::invalid_argument,
        "line " + std::to_string(line_of(out.text, zero)) + " has a zero byte, and no text has one",
        "A program is a file of text. If this is one in UTF-16, save it in UTF-8, or with "
        "its byte order mark.");
  return out;
}

std::string as_utf8(std::string_view bytes) {
  auto source = source_of_bytes(bytes);
  return source.ok() ? std::move(source->text) : from_latin1(bytes);
}

}  // namespace robomosp::ioci
