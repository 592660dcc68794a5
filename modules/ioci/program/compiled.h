// SPDX-License-Identifier: Apache-2.0
// A compiled program, for commands (layer: application).
#pragma once

#include "ioci/core/commands.h"
#include "program_source/compile.h"

namespace robomosp::ioci {

using program_source::Compiled;

/// Compiles the program of a checked `id`; the first error of its source is the command's, with its
/// place. Points and numbers that follow a world are those of the place selected by the arguments
/// `world` and `name_there`, or of the only one.
Result<Compiled> compile_whole(CommandContext& ctx, const Map& args);

}  // namespace robomosp::ioci
