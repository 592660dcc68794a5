// SPDX-License-Identifier: Apache-2.0
// Files that an exporter made, checked and written (layer: application, ioci).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <robomosp/sdk/io.h>

namespace robomosp::ioci {

/// Writes the files of one export: the main one at `file`, the others beside it or in folders
/// beside it. Names that lead out of the folder, and a main file that is missing, are the
/// provider's fault; nothing is written then.
Result<void> write_exported(const std::vector<ExportedFile>& files,
                            const std::filesystem::path& file, const std::string& provider);

}  // namespace robomosp::ioci
