// SPDX-License-Identifier: Apache-2.0
// The library's files of one kind (layer: application, ioci only).
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "ioci/core/command.h"

namespace robomosp::ioci {

/// The files of a kind by the names of their records; of one name the file in the first folder.
[[nodiscard]] std::map<std::string, std::filesystem::path> library_files(const Application&, Kind);

}  // namespace robomosp::ioci
