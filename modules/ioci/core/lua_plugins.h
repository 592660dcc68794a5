// SPDX-License-Identifier: Apache-2.0
// Plugins that are scripts: *.lua in the folders of plugins (layer: application, ioci).
#pragma once

#include <filesystem>
#include <span>
#include <vector>

namespace robomosp::ioci {

/// The scripts in these folders, by name in each; of several of one name the first.
[[nodiscard]] std::vector<std::filesystem::path> lua_plugins(
    std::span<const std::filesystem::path> folders);

}  // namespace robomosp::ioci
