// SPDX-License-Identifier: Apache-2.0
// Files that an exporter made, checked and written (layer: application, ioci).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

namespace robomosp::ioci {

/// Writes the files of one export, whose names the guard of exporters has looked at: the main one
/// at `file`, the others beside it or in folders beside it.
Result<void> write_exported(const std::vector<ExportedFile>& files,
                            const std::filesystem::path& file);

/// An error that names files which are there already.
Result<void> check_new(const std::vector<ExportedFile>& files, const std::filesystem::path& file);

}  // namespace robomosp::ioci
