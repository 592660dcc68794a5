// SPDX-License-Identifier: Apache-2.0
// Source of IRL to a program (layer: data processing, plugin irl).
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/language.h>
#include <robomosp/sdk/program_tables.h>

namespace robomosp::irl {

/// The first file with what it names among the others, and values of its variables in place of
/// those that it declares. Every fault is in the tables; an error is what keeps the compiler from
/// its work: no file, a text that is too long, being cancelled.
[[nodiscard]] Result<std::unique_ptr<ProgramTables>> compile(
    std::span<const SourceFile> files, Progress& progress, std::span<const GivenValue> values = {});
/// Files that a source names in its head; a module's name is that of its file, "tools.irl".
[[nodiscard]] std::vector<std::string> needs(const SourceFile& file);

}  // namespace robomosp::irl
