// SPDX-License-Identifier: Apache-2.0
// A plugin's file in the process that opens it: the program's own, or that of the plugin
// (layer: core).
#pragma once

#include <filesystem>
#include <string>

#include <robomosp/sdk/plugin.h>
#include <robomosp/sdk/result.h>

namespace robomosp {

/// Opens a file, never to be closed, and reads its tables, as far as they can be without running
/// more of it; an error is a refusal's sentence.
[[nodiscard]] Result<const rmp_plugin*> open_plugin(const std::filesystem::path& file);
/// Whether its parameters cannot be read.
[[nodiscard]] bool has_broken_parameters(const rmp_provider& row);
/// Makes a provider, as one of its current interface (kernel/interface_adapters.h).
[[nodiscard]] Result<void*> make_provider(const rmp_provider& row, const rmp_host* host,
                                          const std::string& label);

}  // namespace robomosp
