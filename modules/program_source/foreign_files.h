// SPDX-License-Identifier: Apache-2.0
// Programs of controllers, read to IRL with the files that belong to them (layer: application,
// program_source).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/program_reader.h>
#include <robomosp/sdk/progress.h>

#include "kernel/messages.h"
#include "kernel/registry.h"
#include "kernel/value.h"
#include "program_source/reader_settings.h"

namespace robomosp::program_source {

constexpr std::uint64_t kMostSource = std::uint64_t{64} << 20;  // [bytes]

/// Where files are read: the providers, and where notes are posted.
struct ReadingPlace {
  Registry& registry;
  Messages& messages;
  Progress& progress;
};

/// Text of a file or argument; a note is posted if it was not in UTF-8 (program/source_bytes.h).
[[nodiscard]] Result<std::string> told_source(Messages&, const std::string& file,
                                              std::string_view bytes);

/// The reader for a file: `name` if it is a reader's, else by the extension and, if several readers
/// accept it, by the text. Empty = none does: the file is IRL. Errors list the names to choose
/// from.
[[nodiscard]] Result<std::string> reader_of(const ReadingPlace&, const std::filesystem::path&,
                                            const std::string& name);

/// Text of a file beside a program. Nothing, and a warning, if it cannot be read: the program is
/// read without it. Errors: cancelled.
[[nodiscard]] Result<std::optional<std::string>> source_beside(const ReadingPlace&,
                                                               const std::filesystem::path&);

struct Foreign {
  std::string reader;
  std::vector<ForeignFile> files;  ///< as they were read
  std::unique_ptr<ReadProgram> program;
};
/// Reads a file and those that belong to it. `settings` are values of the reader's parameters, over
/// those that the record of a `controller` has, if any.
[[nodiscard]] Result<Foreign> read_foreign(const ReadingPlace&, const std::filesystem::path&,
                                           const std::string& reader, const Map& settings,
                                           const model::Controller* controller);

}  // namespace robomosp::program_source
