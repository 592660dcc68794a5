// SPDX-License-Identifier: Apache-2.0
// Checks for UTF-8 text (layer: core). [any thread]
#pragma once

#include <cstddef>
#include <string_view>

namespace robomosp::text {

/// Offset of the first byte that is not UTF-8 text (RFC 3629; NUL counts as binary), or npos.
[[nodiscard]] std::size_t first_bad_byte(std::string_view s);

}  // namespace robomosp::text
