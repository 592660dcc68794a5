// SPDX-License-Identifier: Apache-2.0
// Plugins with heavy libraries in two parts: a stub that is all tables and opens at once, and the
// part with the providers, opened with the first of them that is made (layer: contract).
// RMP_LAZY_DOOR compiles a plugin's entry as such a stub; `robomosp_plugin(... LAZY)` does both.
#pragma once

#include <dlfcn.h>

#include <cstdio>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>

#include <robomosp/sdk/plugin.h>

extern "C" const rmp_plugin* rmp_plugin_entry_v1(void);

namespace robomosp::detail {

/// The table of `lazy/<file name>` beside the library that holds `door`; throws with the reason.
inline const rmp_plugin& open_behind(const rmp_plugin* door) {
  Dl_info info{};
  if (dladdr(door, &info) == 0 || !info.dli_fname)
    throw std::runtime_error("the plugin's own file cannot be found");
  const std::string own = info.dli_fname;
  const std::size_t slash = own.rfind('/') + 1;  // 0 when there is none
  const std::string file = own.substr(0, slash) + "lazy/" + own.substr(slash);
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (!library) {
    const char* reason = dlerror();
    throw std::runtime_error("the plugin's library cannot be opened: " +
                             std::string(reason ? reason : file.c_str()));
  }
  void* symbol = dlsym(library, "rmp_plugin_entry_v1");
  rmp_plugin_entry_fn entry = nullptr;
  std::memcpy(&entry, &symbol, sizeof entry);
  const rmp_plugin* behind = entry ? entry() : nullptr;
  if (!behind || std::string_view(behind->abi_tag) != door->abi_tag ||
      behind->provider_count != door->provider_count)
    throw std::runtime_error(file + " is of another version than " + own);
  return *behind;
}

/// Makes a provider by the row of the same number in the library behind the stub.
template <class T>
void* create_later(const rmp_host* host, char* error, std::uint32_t error_size) {
  try {
    const rmp_plugin* door = rmp_plugin_entry_v1();
    static const rmp_plugin& behind = open_behind(door);
    for (std::uint32_t i = 0; i < door->provider_count; ++i)
      if (rmp_provider_at(*door, i).create == &create_later<T>)
        return rmp_provider_at(behind, i).create(host, error, error_size);
  } catch (const std::exception& e) {
    if (error && error_size) std::snprintf(error, error_size, "%s", e.what());
  } catch (...) {
    if (error && error_size) std::snprintf(error, error_size, "%s", "unknown exception");
  }
  return nullptr;
}

}  // namespace robomosp::detail
