// SPDX-License-Identifier: Apache-2.0
// Programs in worlds: compiled, with what their names mean there (layer: application, ioci only).
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

/// The program of a record; nullptr = it is another kind's, or none.
[[nodiscard]] const model::Program* program_in(const document::Snapshot&, AnyId);
/// Compiled, with what bindings of a place give its variables (the only one's where none is given);
/// an error of its source is an error that names the first.
Result<std::shared_ptr<const CompiledProgram>> compile_program(CommandContext&, AnyId,
                                                               const ProgramPlace* = nullptr);

/// The error with `where` before its place, unless it begins with that: runs and bindings name the
/// program already.
[[nodiscard]] Error named_once(Error e, const std::string& where);

/// Programs of a world, in the order of its list; none where there is no such world.
[[nodiscard]] std::vector<ProgramPlace> programs_of(const document::Snapshot&, WorldId);
/// The places of a program in worlds, those of one world in a row; of `args`, world and name_there
/// leave out others.
[[nodiscard]] std::vector<ProgramPlace> places_of(const document::Snapshot&, AnyId program,
                                                  const Map& args = {});
/// The place of the program `id` that world and name_there mean, or the only one.
Result<ProgramPlace> place_of(CommandContext&, const Map& args);
/// A binding as program.bindings tells it.
[[nodiscard]] Map binding_value(const model::ProgramBinding&);
/// "carry" in world "bench", with its quotes.
[[nodiscard]] std::string describe(const document::Snapshot&, const ProgramPlace&);
/// Values of variables from a table: names, and numbers, truths or expressions of the language.
Result<std::vector<program::Preset>> read_presets(const Value*, std::string_view path);
/// The argument values of what runs one program.
[[nodiscard]] ParamSpec values_field();

}  // namespace robomosp::ioci
