// SPDX-License-Identifier: Apache-2.0
// Names of the providers that a plugin file offers for one interface, for suites that run on all of
// them (layer: contract helper for tests, header-only, POSIX).
#pragma once

#include <dlfcn.h>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/plugin.h>

namespace robomosp::conformance {

/// Empty when the file is no plugin of this SDK or offers nothing of that interface.
template <class Interface>
[[nodiscard]] std::vector<std::string> provider_names(const char* plugin_file) {
  std::vector<std::string> names;
  void* library = dlopen(plugin_file, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  void* symbol = library ? dlsym(library, "rmp_plugin_entry_v1") : nullptr;
  if (!symbol) return names;
  rmp_plugin_entry_fn entry = nullptr;
  std::memcpy(&entry, &symbol, sizeof entry);
  const rmp_plugin* plugin = entry();
  for (std::uint32_t i = 0; plugin && i < plugin->provider_count; ++i)
    if (const rmp_provider& row = rmp_provider_at(*plugin, i);
        std::string_view(row.interface_id) == Interface::kInterfaceId)
      names.emplace_back(row.name);
  return names;
}

}  // namespace robomosp::conformance
