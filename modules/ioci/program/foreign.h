// SPDX-License-Identifier: Apache-2.0
// Programs of controllers, read to IRL (layer: application).
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <robomosp/sdk/program_reader.h>

#include "ioci/core/commands.h"
#include "program_source/reader_settings.h"

namespace robomosp::ioci {

constexpr std::uint64_t kMostSource = std::uint64_t{64} << 20;

/// The reader for a file: `name` if it is a reader's, else by the extension and, if several readers
/// accept it, by the text. Empty = none does: the file is IRL. Errors list the names to choose
/// from.
Result<std::string> reader_of(CommandContext&, const std::filesystem::path&,
                              const std::string& name);

/// Text of a file beside a program. Nothing, and a warning, if it cannot be read: the program is
/// read without it. Errors: cancelled.
Result<std::optional<std::string>> source_beside(CommandContext&, const std::filesystem::path&);
using program_source::ForeignFile;

struct Foreign {
  std::string reader;
  std::vector<ForeignFile> files;  ///< as they were read
  std::unique_ptr<ReadProgram> program;
};
/// Reads a file and those that belong to it, with the arguments `settings` (values of the reader's
/// parameters) and `profile` (a controller's record that has them).
Result<Foreign> read_foreign(CommandContext&, const std::filesystem::path&,
                             const std::string& reader, const Map& args);

}  // namespace robomosp::ioci
