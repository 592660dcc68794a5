// SPDX-License-Identifier: Apache-2.0
// What commands return, as types (layer: application, ioci only).
#pragma once

#include <string>
#include <vector>

#include "ioci/core/command.h"

namespace robomosp::ioci {

/// The type of a result: `map{...}` or `list<map{...}>` of its fields, else the declared type with
/// its unit. All fields may be left out of a result.
[[nodiscard]] std::string result_type(const ReturnSpec&);

/// The facts about a parameter that param_value() returns; as a type, `type:parameter_facts`.
[[nodiscard]] std::vector<ParamSpec> param_value_fields();

}  // namespace robomosp::ioci
