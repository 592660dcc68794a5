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
#include "kernel/registry.h"
#include "model/controller.h"

namespace robomosp::ioci {

constexpr std::uint64_t kMostSource = std::uint64_t{64} << 20;

/// The reader that takes a file: `name` if it is one of a reader, else by the extension and, where
/// several take it, by the text. Empty = none does, and IRL it is. Errors say what to name.
Result<std::string> reader_of(CommandContext&, const std::filesystem::path&,
                              const std::string& name);

/// Text of a file that lies beside a program. Nothing, and a warning, if it cannot be read: the
/// program is taken without it. Errors: cancelled.
Result<std::optional<std::string>> source_beside(CommandContext&, const std::filesystem::path&);
/// What a controller's record says of a reader's parameters: pulses of its axes, and options of
/// the same name.
[[nodiscard]] Map reader_settings(const ProviderInfo& reader, const model::Controller&);

struct ForeignFile {
  std::string name, text;
};
/// Tools and frames of a controller by their numbers, in the file of its backup that a reader
/// knows: TOOL.CND for `inform`, SYSFRAME.VA for `tp`. Its text is empty for other readers, and
/// without numbered tools and frames.
[[nodiscard]] ForeignFile places_file(std::string_view reader, const model::Controller&);
struct Foreign {
  std::string reader;
  std::vector<ForeignFile> files;  ///< as they were read
  std::unique_ptr<ReadProgram> program;
};
/// Reads a file and what belongs to it, with `settings` and `profile` of the arguments: values of
/// the reader's parameters, and the controller's record that has them.
Result<Foreign> read_foreign(CommandContext&, const std::filesystem::path&,
                             const std::string& reader, const Map& args);

}  // namespace robomosp::ioci
