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

/// What a variable begins with, as LanguageTask::values takes it.
struct BoundValue {
  std::string name, field, text;
  bool operator==(const BoundValue&) const = default;
};

/// Whether bindings of a place give variables what they begin with.
[[nodiscard]] bool gives_values(const model::PlacedProgram&);
/// What they give now, in their order. `plain` is the program without them, which tells the types
/// of its variables. An error names the binding: a member, feature, parameter or variable that is
/// not there, an object that a robot holds, a dimension that does not fit.
Result<std::vector<BoundValue>> bound_values(CommandContext&, const ProgramPlace&,
                                             const rmp_code& plain);

}  // namespace robomosp::ioci
