// SPDX-License-Identifier: Apache-2.0
// Values written as text, in the form that scripts use: {position = {0.4, 0, "30 mm"}, tip =
// "tool"} (layer: core).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"

namespace robomosp {

/// Reads nil, true, false, a number, a text in double quotes, or a table in braces: of values, of
/// `name = value`, or empty (a list). Tables may be nested 100 deep. The error names the place.
[[nodiscard]] Result<Value> read_literal(std::string_view text);

/// The text from which read_literal() reads the same value, except that reals without a fraction
/// become integers. Handles are written as kind#number, and numeric arrays as tables of numbers.
[[nodiscard]] std::string literal(const Value&);
/// The same for who shows its beginning only: all of it if it has no more than `most` bytes, else a
/// beginning of more than that, which may end anywhere. What is not shown takes no time.
[[nodiscard]] std::string beginning_of_literal(const Value&, std::size_t most);

}  // namespace robomosp
