// SPDX-License-Identifier: Apache-2.0
// Opens a built plugin as the host does and makes one of its providers (test support).
#pragma once

#include <dlfcn.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include <robomosp/sdk/plugin.h>

namespace robomosp::test {

/// The plugin's table; throws with the reason when the file is not a plugin of this ABI.
inline const rmp_plugin& open_plugin(const std::string& file) {
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (!library) throw std::runtime_error(dlerror());
  const auto entry = reinterpret_cast<rmp_plugin_entry_fn>(dlsym(library, "rmp_plugin_entry_v1"));
  if (!entry) throw std::runtime_error(file + " exports no rmp_plugin_entry_v1");
  const rmp_plugin* plugin = entry();
  if (std::string_view(plugin->abi_tag) != RMP_ABI_TAG)
    throw std::runtime_error(file + " was built for ABI " + plugin->abi_tag);
  return *plugin;
}

/// One instance of the provider `name` of Interface.
template <class Interface>
std::unique_ptr<Interface> make_provider(const std::string& file, std::string_view name) {
  const rmp_plugin& plugin = open_plugin(file);
  for (std::uint32_t i = 0; i < plugin.provider_count; ++i) {
    const rmp_provider& p = rmp_provider_at(plugin, i);
    if (name != p.name || std::string_view(p.interface_id) != Interface::kInterfaceId) continue;
    static const rmp_host host{sizeof(rmp_host), "test",
                               [](std::int32_t, const char*, const char*) {}, nullptr};
    char text[256] = "";
    auto* made = static_cast<Interface*>(p.create(&host, text, sizeof text));
    if (!made) throw std::runtime_error(text);
    return std::unique_ptr<Interface>(made);
  }
  throw std::runtime_error(file + " has no provider " + std::string(name));
}

}  // namespace robomosp::test
