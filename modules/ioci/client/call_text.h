// SPDX-License-Identifier: Apache-2.0
// Calls of commands as Lua for forms: the line and the place of each argument in it (layer:
// application).
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "kernel/value.h"

namespace robomosp::ioci {

/// A call as one line of Lua: `robot.fk{id = "pa10", q = {0, 0}}`. Secrets are left out.
struct CallText {
  struct Part {
    std::string argument;
    std::size_t begin = 0, end = 0;  ///< bytes of `name = value` in the line
  };
  std::string line;
  std::vector<Part> parts;  ///< in the order of the arguments
  bool is_whole = true;     ///< false: a secret was left out
};

[[nodiscard]] CallText call_text(std::string_view command, const Map& args);

}  // namespace robomosp::ioci
