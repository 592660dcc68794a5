// SPDX-License-Identifier: Apache-2.0
#include "ioci/core/chosen_providers.h"

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <system_error>

#include "io/native.h"
#include "kernel/interface_adapters.h"

namespace robomosp::ioci {

std::filesystem::path chosen_providers_file() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  if (config && *config == '/') return std::filesystem::path(config) / "robomosp" / "providers";
  if (home && *home) return std::filesystem::path(home) / ".config" / "robomosp" / "providers";
  return {};
}

// One choice a line: interface id, a blank, name. Ids may be of an older program.
std::map<std::string, std::string> chosen_providers() {
  std::map<std::string, std::string> out;
  std::ifstream in(chosen_providers_file());
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string id, name;
    if (words >> id >> name; name.empty() || id.starts_with('#')) continue;
    if (const std::string now = current_interface(id); !now.empty()) out[now] = name;
  }
  return out;
}

Result<void> keep_chosen_provider(const std::string& interface_id, const std::string& name) {
  const std::filesystem::path file = chosen_providers_file();
  if (file.empty())
    return error(ErrorCode::io, "there is no home folder to keep the choice in",
                 "Set HOME or XDG_CONFIG_HOME, or leave keep out.");
  auto chosen = chosen_providers();
  if (name.empty()) chosen.erase(interface_id);
  else chosen[interface_id] = name;
  std::string text = "# Defaults chosen with provider.default{keep = \"user\"}.\n";
  for (const auto& [id, provider] : chosen) text += id + " " + provider + "\n";
  std::error_code failed;
  std::filesystem::create_directories(file.parent_path(), failed);  // write_file says what failed
  return io::write_file(file, text);
}

}  // namespace robomosp::ioci
