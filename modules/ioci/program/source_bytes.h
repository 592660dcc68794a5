// SPDX-License-Identifier: Apache-2.0
// Bytes of a file of source as text (layer: application).
#pragma once

#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

namespace robomosp::ioci {

/// Source in UTF-8, and a sentence where it was in something else.
struct SourceBytes {
  std::string text;
  std::string note;  ///< without the file's name; "" = it was in UTF-8
};
/// Text of a file of source. A byte order mark tells UTF-8 or UTF-16 and is taken off; other bytes
/// that are no UTF-8 are of the time before, a byte a letter (ISO 8859-1). What has zero bytes is
/// no text, and an error with the line. [any thread]
[[nodiscard]] Result<SourceBytes> source_of_bytes(std::string_view bytes);
/// The same without a word, for files that are only looked at; zero bytes are left out.
[[nodiscard]] std::string as_utf8(std::string_view bytes);

}  // namespace robomosp::ioci
