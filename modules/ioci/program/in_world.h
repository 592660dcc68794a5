// SPDX-License-Identifier: Apache-2.0
// Programs in worlds: compiled, with the bindings of their names (layer: application, ioci only).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/language.h>

#include "ioci/core/command.h"
#include "ioci/program/program_place.h"
#include "model/program.h"
#include "task/run.h"

namespace robomosp::ioci {

/// The program of a record; nullptr = missing, or of another kind.
[[nodiscard]] const model::Program* program_in(const document::Snapshot&, AnyId);
/// Compiles a program with the values that bindings of a place give its variables (of its only
/// place if none is given); an error of its source names the first fault.
Result<std::shared_ptr<const CompiledProgram>> compile_program(CommandContext&, AnyId,
                                                               const ProgramPlace* = nullptr);

/// The error with `where` before its place, unless it already begins with that, since runs and
/// bindings name the program themselves.
[[nodiscard]] Error named_once(Error e, const std::string& where);

/// Programs of a world, in the order of its list; empty if the world does not exist.
[[nodiscard]] std::vector<ProgramPlace> programs_of(const document::Snapshot&, WorldId);
/// The places of a program in worlds, those of one world in a row; world and name_there of `args`
/// select among them.
[[nodiscard]] std::vector<ProgramPlace> places_of(const document::Snapshot&, AnyId program,
                                                  const Map& args = {});
/// The place of the program `id` selected by world and name_there, or the only one.
Result<ProgramPlace> place_of(CommandContext&, const Map& args);
/// A binding as program.bindings returns it.
[[nodiscard]] Map binding_value(const model::ProgramBinding&);
/// "carry" in world "bench", with its quotes.
[[nodiscard]] std::string describe(const document::Snapshot&, const ProgramPlace&);
/// Values of variables from a table of names with numbers, Booleans or expressions of the language.
Result<std::vector<program::Preset>> read_presets(const Value*, std::string_view path);
/// The argument values of what runs one program.
[[nodiscard]] ParamSpec values_field();

}  // namespace robomosp::ioci
