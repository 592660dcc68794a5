// SPDX-License-Identifier: Apache-2.0
// Points and numbers of programs that follow objects, frames and parameters of a world (layer:
// application, program_source).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/language.h>

#include "program_source/place.h"
#include "program_source/workshop.h"

namespace robomosp::program_source {

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
Result<std::vector<BoundValue>> bound_values(const Workshop&, const ProgramPlace&,
                                             const rmp_code& plain);

}  // namespace robomosp::program_source
