// SPDX-License-Identifier: Apache-2.0
// Bytes of a file of source as text (layer: data processing, program).
#pragma once

#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp::program {

/// Source in UTF-8, with a note if it was encoded differently.
struct SourceBytes {
  std::string text;
  std::string note;  ///< without the file's name; "" = it was in UTF-8
};
/// Text of a source file. A byte order mark identifies UTF-8 or UTF-16 and is removed; other bytes
/// that are not UTF-8 are read as ISO 8859-1, one letter per byte. Bytes with zeros are not text,
/// which is an error with the line. [any thread]
[[nodiscard]] Result<SourceBytes> source_of_bytes(std::string_view bytes);
/// The same silently, for files that are only inspected; zero bytes are left out.
[[nodiscard]] std::string as_utf8(std::string_view bytes);

}  // namespace robomosp::program
