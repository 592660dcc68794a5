// SPDX-License-Identifier: Apache-2.0
// Values as people read them in a console: aligned matrices, units, tables of records
// (layer: application, lua). For reading back, use Value::text or JSON.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "ioci/core/command.h"
#include "kernel/value.h"

namespace robomosp::lua {

struct PrettyStyle {
  int digits = 6;                ///< significant digits
  std::size_t width = 100;       ///< columns before a list is broken into lines
  bool fits = false;             ///< tables, matrices and vectors keep to `width` too
  std::size_t most_rows = 60;    ///< longer matrices are shortened in the middle
  std::size_t most_items = 100;  ///< longer lists end in "... 4900 more"
};

/// `robot:pa10#17` of a handle.
using DescribeHandle = std::function<std::string(const Handle&)>;

/// Text of a value, without a trailing newline; `returns` (may be null) gives units and the order
/// of fields. [any thread] if `describe` is.
[[nodiscard]] std::string pretty(const Value& value, const ioci::ReturnSpec* returns,
                                 const DescribeHandle& describe, const PrettyStyle& style = {});

/// `{0.557, 0, 0.374} m`, or the aligned rows of a matrix with the unit behind the last one.
[[nodiscard]] std::string pretty_array(const NumericArray& array, std::string_view unit,
                                       const PrettyStyle& style = {});

}  // namespace robomosp::lua
