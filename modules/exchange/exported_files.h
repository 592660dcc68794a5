// SPDX-License-Identifier: Apache-2.0
// Checks and writes the files made by an exporter (layer: application, exchange).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

namespace robomosp::exchange {

/// Writes the files of one export, with names already checked by the guard of exporters: the main
/// one at `file`, the others beside it or in folders beside it.
Result<void> write_exported(const std::vector<ExportedFile>& files,
                            const std::filesystem::path& file);

/// An error that names files that exist already.
Result<void> check_new(const std::vector<ExportedFile>& files, const std::filesystem::path& file);

}  // namespace robomosp::exchange
