// SPDX-License-Identifier: Apache-2.0
// Text laid out for a terminal of a certain width (layer: application, lua). [any thread]
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace robomosp::lua {

/// Width in characters, not bytes.
[[nodiscard]] std::size_t width_of(std::string_view s);

/// Words of a text on lines of at most `width` characters; longer words are broken. Never empty.
[[nodiscard]] std::vector<std::string> wrapped(std::string_view text, std::size_t width);

/// A table with cells that wrap until it is at most `width` characters wide (0 = no limit); if that
/// is impossible, it is split into several tables that repeat the first column. `right` marks
/// right-aligned columns, such as those of numbers. No trailing newline.
[[nodiscard]] std::string table_text(const std::vector<std::vector<std::string>>& rows,
                                     const std::vector<bool>& right, std::size_t width);

/// Help for a terminal: Markdown tables in columns, longer lines wrapped below the start of their
/// last column. Blocks of code are kept, without their fences. Width 0 = no limit.
[[nodiscard]] std::string fitted(std::string_view text, std::size_t width);

}  // namespace robomosp::lua
