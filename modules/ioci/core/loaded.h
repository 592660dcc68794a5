// SPDX-License-Identifier: Apache-2.0
// What commands that load and save files have in common: arguments, and what they report
// (layer: application, ioci).
#pragma once

#include "io/native.h"
#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// The argument reload of a command that loads.
[[nodiscard]] ParamSpec reload_field();
/// The argument overwrite of a command that saves.
[[nodiscard]] ParamSpec overwrite_field();
/// Loads a file as io::load() does and reports its notes.
Result<io::Loaded> load_file(CommandContext&, const std::filesystem::path& file,
                             io::Reload reload = io::Reload::no, std::optional<Kind> wanted = {});
/// What overwrite of the arguments says; `replaced` gets files as in io::SaveOptions.
[[nodiscard]] io::SaveOptions save_options(const Map& args,
                                           std::vector<std::filesystem::path>& replaced);
/// Writes the file that a user named. Where it held something else, a note says that this was
/// replaced, unless the file follows edits (recording.watched).
Result<void> write_named_file(CommandContext&, const std::filesystem::path& file,
                              std::string_view bytes);
/// Reports the files that held something of somebody else.
void report_replaced(CommandContext&, Severity, const std::vector<std::filesystem::path>& replaced);

}  // namespace robomosp::ioci
