// SPDX-License-Identifier: Apache-2.0
// Programs of controllers as commands read them (layer: application, ioci only).
#pragma once

#include <filesystem>
#include <string>

#include "ioci/core/commands.h"
#include "program_source/foreign_files.h"

namespace robomosp::ioci {

/// Where a command reads files.
[[nodiscard]] inline program_source::ReadingPlace reading_place(CommandContext& ctx) {
  return {ctx.app.registry, ctx.app.messages, ctx.progress};
}

/// Reads a file and those that belong to it, with the arguments `settings` (values of the reader's
/// parameters) and `profile` (a controller's record that has them).
[[nodiscard]] Result<program_source::Foreign> read_foreign(CommandContext&,
                                                           const std::filesystem::path&,
                                                           const std::string& reader,
                                                           const Map& args);

}  // namespace robomosp::ioci
