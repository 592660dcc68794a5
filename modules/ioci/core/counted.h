// SPDX-License-Identifier: Apache-2.0
// List indices counted from 0 or from 1 (layer: application, ioci only).
#pragma once

#include <string>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// The argument `first` of commands with indices: the number of the first element, 0, or 1 as in
/// lines of the program of 2006.
[[nodiscard]] inline ParamSpec first_field() {
  return between(defaulted("first", "int", "", 0, "Number of the first one: 0 or 1."), 0, 1);
}

/// Zero-based position, in a list of `count`, of the argument `index`; an error gives the valid
/// numbers. `what` is "robot".
[[nodiscard]] inline Result<std::size_t> counted(const Map& args, std::size_t count,
                                                 const std::string& what) {
  const std::int64_t first = integer(args, "first"), i = integer(args, "index");
  const auto most = static_cast<std::int64_t>(count) - 1 + first;
  if (i >= first && i <= most) return static_cast<std::size_t>(i - first);
  std::string range = "There is none.";
  if (count > 0)
    range = "There " + std::string(count == 1 ? "is " : "are ") + std::to_string(count) +
            ", numbered from " + std::to_string(first) + " to " + std::to_string(most) + ".";
  return error(ErrorCode::invalid_argument, "there is no " + what + " " + std::to_string(i),
               std::move(range), "index");
}

}  // namespace robomosp::ioci
