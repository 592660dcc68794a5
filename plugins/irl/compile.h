// SPDX-License-Identifier: Apache-2.0
// Source of IRL to a program (layer: data processing, plugin irl).
#pragma once

#include <memory>

#include <robomosp/sdk/program_tables.h>

namespace robomosp::irl {

/// The first file with what it names among the others. Every fault is in the tables; an error is
/// what keeps the compiler from its work: no file, a text that is too long, being cancelled.
[[nodiscard]] Result<std::unique_ptr<ProgramTables>> compile(std::span<const SourceFile> files,
                                                             Progress& progress);

}  // namespace robomosp::irl
