// SPDX-License-Identifier: Apache-2.0
// Checks of values against plain types, shared by schema.cpp and part_faults.cpp (layer: core).
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>

#include <robomosp/sdk/result.h>

#include "kernel/schema.h"

namespace robomosp {

/// A parameter reduced to its plain type (plain_type()), for checking values. Holds views of the
/// ParamSpec, which must outlive it; copies would be made for each argument of each call.
struct PlainSpec {
  std::string_view type{};
  std::string_view unit{};
  std::span<const std::string> choices{};
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  bool infinite = false;
};

/// check_value() for a plain type. "any" is refused: it takes every value and needs no check.
[[nodiscard]] Result<Value> check_plain(const PlainSpec&, const Value&, std::string_view path,
                                        const ResolveRef& = {});

}  // namespace robomosp
