// SPDX-License-Identifier: Apache-2.0
// The user's own default providers, kept from run to run in ~/.config/robomosp/providers
// (layer: application, ioci).
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include <robomosp/sdk/result.h>

namespace robomosp::ioci {

/// $XDG_CONFIG_HOME/robomosp/providers or ~/.config/robomosp/providers; empty = there is no home.
[[nodiscard]] std::filesystem::path chosen_providers_file();

/// Interface ids of this program and the names chosen for them; what cannot be read is left out.
[[nodiscard]] std::map<std::string, std::string> chosen_providers();

/// Keeps a choice; an empty name takes it back.
Result<void> keep_chosen_provider(const std::string& interface_id, const std::string& name);

}  // namespace robomosp::ioci
