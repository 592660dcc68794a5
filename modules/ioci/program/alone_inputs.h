// SPDX-License-Identifier: Apache-2.0
// Inputs of programs that run without a world (layer: application, ioci and shell).
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/result.h>

#include "ioci/core/application.h"
#include "kernel/schema.h"
#include "kernel/value.h"
#include "program/world.h"

namespace robomosp::ioci {

/// Values of inputs from a table by their names: numbers and truths.
Result<std::map<std::string, program::SignalValue>> read_inputs(const Value*,
                                                                std::string_view path);
/// What READ gets: a list of lines for the only program of `names`, or a table of such lists by the
/// names of programs. A list in their order.
Result<std::vector<std::vector<std::string>>> read_lines(const Value*,
                                                         const std::vector<std::string>& names,
                                                         std::string_view path);
/// The argument lines of what runs programs of worlds.
[[nodiscard]] ParamSpec lines_field();
/// A program of the document, compiled outside of any command; it has no errors (program.check).
Result<std::shared_ptr<const CompiledProgram>> compile_now(Application&, const Handle&, Progress&);

}  // namespace robomosp::ioci
