// SPDX-License-Identifier: Apache-2.0
#include "program/source_bytes.h"

#include <algorithm>
#include <utility>

#include <robomosp/sdk/utf8_text.h>

#include "kernel/utf8.h"

namespace robomosp::program {
namespace {

std::size_t line_of(std::string_view text, std::size_t at) {
  return 1 + static_cast<std::size_t>(
                 std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

}  // namespace

Result<SourceBytes> source_of_bytes(std::string_view bytes) {
  SourceBytes out;
  const std::size_t bad = text::first_bad_byte(bytes);
  auto [text, was] = utf8_text(bytes);
  out.text = std::move(text);
  if (was == TextEncoding::utf16)
    out.note = "the file is in UTF-16 and was read so; it is kept in UTF-8";
  else if (was == TextEncoding::latin1)
    out.note =
        "line " + std::to_string(line_of(bytes, bad)) +
        " is no UTF-8, so that the file was read as ISO 8859-1 (Latin-1); it is kept in UTF-8";
  if (const std::size_t zero = out.text.find('\0'); zero != std::string::npos)
    return error(ErrorCode::invalid_argument,
                 "line " + std::to_string(line_of(out.text, zero)) +
                     " has a zero byte, which is not allowed in a text",
                 "A program must be a text file. If this one is in UTF-16, save it as UTF-8, or "
                 "with a byte order mark.");
  return out;
}

std::string as_utf8(std::string_view bytes) {
  auto source = source_of_bytes(bytes);
  if (source.ok()) return std::move(source->text);
  std::string text = utf8_from_latin1(bytes);
  std::erase(text, '\0');
  return text;
}

}  // namespace robomosp::program
