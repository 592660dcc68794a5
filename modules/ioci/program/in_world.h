// SPDX-License-Identifier: Apache-2.0
// Programs in worlds: compiled, with what their names mean there (layer: application, ioci only).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/language.h>

#include "ioci/core/command.h"
#include "model/program.h"
#include "task/run.h"

namespace robomosp::ioci {

/// The program of a record; nullptr = it is another kind's, or none.
[[nodiscard]] const model::Program* program_in(const document::Snapshot&, AnyId);
/// Compiled, with what bindings of a place give its variables (the only one's where none is given);
/// an error of its source is an error that names the first.
Result<std::shared_ptr<const CompiledProgram>> compile_program(
    CommandContext&, AnyId, const model::ProgramPlacement* placed = nullptr);

struct PlacedProgram {
  AnyId program;
  const model::ProgramPlacement* placement = nullptr;  ///< of the snapshot
};
/// Programs of a world, in the order in which they and their places were made.
[[nodiscard]] std::vector<PlacedProgram> programs_of(const document::Snapshot&, WorldId);
/// The same by their names there; an error names one that is none.
Result<std::vector<PlacedProgram>> programs_of(const document::Snapshot&, WorldId,
                                               const std::vector<std::string>& names);
/// Which place of a program is meant: by its name there, its world, or the only one.
Result<std::size_t> placement_of(CommandContext&, const Map& args, const model::Program&);
/// Values of variables from a table: names, and numbers, truths or expressions of the language.
Result<std::vector<program::Preset>> read_presets(const Value*, std::string_view path);
/// The argument values of what runs one program.
[[nodiscard]] ParamSpec values_field();
/// What world.run_task was asked for.
Result<task::TaskRun> task_run(CommandContext&, const Map& args);

}  // namespace robomosp::ioci
