// SPDX-License-Identifier: Apache-2.0
// Generated from the examples of commands; do not edit.
#include "ioci/core/example_arguments.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace robomosp::ioci {
namespace {

/// By name of the command.
constexpr std::pair<std::string_view, std::string_view> kExampleArguments[] = {
    {"version", ""},
};

}  // namespace

std::string_view example_arguments(std::string_view command) {
  const auto* it =
      std::lower_bound(std::begin(kExampleArguments), std::end(kExampleArguments), command,
                       [](const auto& row, std::string_view name) { return row.first < name; });
  return it != std::end(kExampleArguments) && it->first == command ? it->second
                                                                   : std::string_view();
}

}  // namespace robomosp::ioci
