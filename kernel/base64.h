// SPDX-License-Identifier: Apache-2.0
// Base64, the standard alphabet with padding (RFC 4648, section 4) (layer: core). [any thread]
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace robomosp::base64 {

/// Appends the text of some bytes.
void append(std::string& out, std::string_view bytes);

/// Bytes that a text stands for, by its length and padding; nothing when no text has that length.
[[nodiscard]] std::optional<std::size_t> decoded_size(std::string_view text);

/// Writes decoded_size(text) bytes to `out`; false when the text is not base64: other characters,
/// padding within it, or bits behind the last byte that are not 0.
[[nodiscard]] bool decode(std::string_view text, char* out);

}  // namespace robomosp::base64
