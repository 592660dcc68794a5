// SPDX-License-Identifier: Apache-2.0
// The first names of a folder, for completion and choices: without sizes, so that folders of many
// files are listed at once (layer: core). [any thread]
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string_view>
#include <vector>

#include "kernel/file_root.h"

namespace robomosp {

/// The first `most` entries by name of those that `wanted` accepts. `size` is 0. Restricted to the
/// folder of the session, as list_folder() is.
[[nodiscard]] Result<std::vector<FolderEntry>> first_names(
    const std::filesystem::path& folder, std::size_t most,
    const std::function<bool(std::string_view name, FileKind)>& wanted);

}  // namespace robomosp
