// SPDX-License-Identifier: Apache-2.0
// Lists of units such as "rad, m, rad": one for each entry of a vector or column of a matrix
// (layer: core).
#pragma once

#include <string_view>
#include <vector>

#include "kernel/text.h"

namespace robomosp::units {

/// True if `name` is a list of units.
[[nodiscard]] inline bool is_list(std::string_view name) {
  return name.find(',') != std::string_view::npos;
}

/// The units of a list; for a single unit, that unit.
[[nodiscard]] inline std::vector<std::string_view> entries(std::string_view name) {
  std::vector<std::string_view> out;
  for (;;) {
    const std::size_t comma = name.find(',');
    out.push_back(text::trim(name.substr(0, comma)));
    if (comma == std::string_view::npos) return out;
    name.remove_prefix(comma + 1);
  }
}

}  // namespace robomosp::units
