// SPDX-License-Identifier: Apache-2.0
// Programs in worlds: compiled, with the bindings of their names (layer: application, ioci only).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/language.h>

#include "ioci/core/command.h"
#include "program_source/place.h"
#include "task/run.h"

namespace robomosp::ioci {

using program_source::describe, program_source::named_once, program_source::program_in,
    program_source::ProgramPlace, program_source::programs_of;

/// Compiles a program with the values that bindings of a place give its variables (of its only
/// place if none is given); an error of its source names the first fault.
Result<std::shared_ptr<const CompiledProgram>> compile_program(CommandContext&, AnyId,
                                                               const ProgramPlace* = nullptr);

/// The place that the arguments world and name_there select.
[[nodiscard]] program_source::PlaceWish place_wish(const Map& args);
/// The places of a program in worlds, those of one world in a row; world and name_there of `args`
/// select among them.
[[nodiscard]] std::vector<ProgramPlace> places_of(const document::Snapshot&, AnyId program,
                                                  const Map& args = {});
/// The place of the program `id` selected by world and name_there, or the only one.
Result<ProgramPlace> place_of(CommandContext&, const Map& args);
/// A binding as program.bindings returns it.
[[nodiscard]] Map binding_value(const model::ProgramBinding&);
/// Values of variables from a table of names with numbers, Booleans or expressions of the language.
Result<std::vector<program::Preset>> read_presets(const Value*, std::string_view path);
/// The argument values of what runs one program.
[[nodiscard]] ParamSpec values_field();

}  // namespace robomosp::ioci
