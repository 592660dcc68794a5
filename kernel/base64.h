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

/// Number of bytes encoded by a text, from its length and padding; empty if no text has that
/// length.
[[nodiscard]] std::optional<std::size_t> decoded_size(std::string_view text);

/// Writes decoded_size(text) bytes to `out`; false if the text is not Base64: other characters,
/// padding in the middle, or nonzero bits after the last byte.
[[nodiscard]] bool decode(std::string_view text, char* out);

}  // namespace robomosp::base64
