// SPDX-License-Identifier: Apache-2.0
// A compiled program, for commands (layer: application).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/language.h>

#include "ioci/core/commands.h"
#include "ioci/program/program_place.h"

namespace robomosp::ioci {

struct Compiled {
  std::vector<std::string> texts;  ///< of its files
  std::shared_ptr<CompiledProgram> program;
  [[nodiscard]] const rmp_code& code() const { return program->code(); }
};

/// Compiles the program of a checked `id`; the first error of its source is the command's, with its
/// place. Points and numbers that follow a world are those of `place`, or of the place selected by
/// the arguments `world` and `name_there`, or of the only one. `text` replaces the content of the
/// program's file, the first.
Result<Compiled> compile_whole(CommandContext& ctx, const Map& args,
                               const ProgramPlace* place = nullptr,
                               const std::string* text = nullptr);

}  // namespace robomosp::ioci
