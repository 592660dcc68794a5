// SPDX-License-Identifier: Apache-2.0
// Points and numbers of programs that follow objects, frames and parameters of a world (layer:
// application, ioci only).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/language.h>

#include "ioci/core/command.h"
#include "ioci/program/program_place.h"

namespace robomosp::ioci {

/// Initial value of a variable, as for LanguageTask::values.
struct BoundValue {
  std::string name, field, text;
  bool operator==(const BoundValue&) const = default;
};

/// True if bindings of a place set initial values of variables.
[[nodiscard]] bool gives_values(const model::PlacedProgram&);
/// Their current values, in order. `plain` is the program without them, with the types of its
/// variables. An error names the binding: a missing member, feature, parameter or variable, an
/// object held by a robot, a dimension that does not fit.
Result<std::vector<BoundValue>> bound_values(CommandContext&, const ProgramPlace&,
                                             const rmp_code& plain);

}  // namespace robomosp::ioci
