// SPDX-License-Identifier: Apache-2.0
// The program robomosp-plugin-trial FILE: opens one plugin as the host would, makes what the host
// makes of it at the start (its modules), and says so. Whatever the plugin does to the process, it
// does it here (kernel/plugin_trial.h).
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>

#include <dlfcn.h>
#include <unistd.h>

#include <robomosp/sdk/module.h>
#include <robomosp/sdk/plugin.h>

namespace {

void log_nothing(std::int32_t, const char*, const char*) {}

void make_modules(const rmp_plugin* plugin) {
  using robomosp::Module;
  const rmp_host host{sizeof(rmp_host), RMP_SDK_VERSION, &log_nothing, nullptr,
                      nullptr,          nullptr,         nullptr};
  // What is not as it should be is refused by the host, in its own words.
  if (!plugin || !RMP_HAS(plugin, provider_size) || !plugin->abi_tag ||
      std::string_view(plugin->abi_tag) != RMP_ABI_TAG || !plugin->providers ||
      plugin->provider_size < sizeof(rmp_provider))
    return;
  for (std::uint32_t i = 0; i < plugin->provider_count; ++i) {
    const rmp_provider& row = rmp_provider_at(*plugin, i);
    if (!row.interface_id || std::string_view(row.interface_id) != Module::kInterfaceId ||
        !row.create)
      continue;
    char reason[256] = "";
    const std::unique_ptr<Module> module(
        static_cast<Module*>(row.create(&host, reason, sizeof reason)));
    if (module) (void)module->table();
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: robomosp-plugin-trial FILE\n", stderr);
    return 2;
  }
  // A file that cannot be opened or has no entry is refused by the host, in its own words.
  if (void* library = ::dlopen(argv[1], RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) {
    if (void* symbol = ::dlsym(library, "rmp_plugin_entry_v1")) {
      rmp_plugin_entry_fn entry = nullptr;
      std::memcpy(&entry, &symbol, sizeof entry);
      try {
        make_modules(entry());
      } catch (...) {  // NOLINT: the host says what it threw
      }
    }
  }
  std::fflush(stdout);
  constexpr char kDone[] = "\x1erobomosp-plugin-trial: done\x1e";
  const bool said = ::write(STDOUT_FILENO, kDone, sizeof kDone - 1) == sizeof kDone - 1;
  // What its static objects do at the end is of no account: plugins are never unloaded.
  ::_exit(said ? 0 : 1);
}
