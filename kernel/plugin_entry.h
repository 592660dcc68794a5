// SPDX-License-Identifier: Apache-2.0
// Opens a plugin file in the current process: the program's, or the plugin's own (layer: core).
#pragma once

#include <filesystem>
#include <string>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// Opens a file, which is never closed, and reads its tables as far as this runs no further code of
/// it; an error explains the refusal in one sentence.
[[nodiscard]] Result<const rmp_plugin*> open_plugin(const std::filesystem::path& file);
/// True if its parameters cannot be read.
[[nodiscard]] bool has_broken_parameters(const rmp_provider& row);
/// Creates a provider of the current interface number (kernel/interface_adapters.h).
[[nodiscard]] Result<void*> make_provider(const rmp_provider& row, const rmp_host* host,
                                          const std::string& label);

}  // namespace robomosp
