// SPDX-License-Identifier: Apache-2.0
// Programs of records, compiled with the values that their places in worlds give them (layer:
// application, program_source).
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/language.h>

#include "program_source/place.h"
#include "program_source/workshop.h"

namespace robomosp::program_source {

struct Compiled {
  std::vector<std::string> texts;  ///< of its files
  std::shared_ptr<CompiledProgram> program;
  [[nodiscard]] const rmp_code& code() const { return program->code(); }
};

/// Compiles the program of a record, which exists; faults of its source are in its tables. Points
/// and numbers that follow a world are those of `places`, which must agree. `text` replaces the
/// content of the program's file, the first.
[[nodiscard]] Result<Compiled> compile(const Workshop&, AnyId program,
                                       std::span<const ProgramPlace> places,
                                       const std::string* text = nullptr);
/// The same, but the first error of the source is that of this function, with all of them as its
/// faults.
[[nodiscard]] Result<Compiled> compile_whole(const Workshop&, AnyId program,
                                             std::span<const ProgramPlace> places,
                                             const std::string* text = nullptr);
/// compile_whole() with the values of a place, or of the only place if none is given.
[[nodiscard]] Result<std::shared_ptr<const CompiledProgram>> compile_program(
    const Workshop&, AnyId program, const ProgramPlace* = nullptr);

}  // namespace robomosp::program_source
