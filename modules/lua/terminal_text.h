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

/// A table whose cells wrap until it is at most `width` characters wide (0 = no limit); where that
/// cannot be, it is cut into several below each other that repeat the first column. `right` says
/// which columns are aligned at their right, such as those of numbers. No trailing newline.
[[nodiscard]] std::string table_text(const std::vector<std::vector<std::string>>& rows,
                                     const std::vector<bool>& right, std::size_t width);

/// Help for a terminal: tables of Markdown in columns, longer lines wrapped below where their last
/// column begins. Blocks of code stay as they are, without their fences.
/// Width 0 = no limit.
[[nodiscard]] std::string fitted(std::string_view text, std::size_t width);

}  // namespace robomosp::lua
