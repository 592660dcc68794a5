// SPDX-License-Identifier: Apache-2.0
// The program robomosp-plugin-trial FILE: opens one plugin as the host would and says so. Whatever
// the plugin does to the process, it does it here (kernel/plugin_trial.h).
#include <cstdio>
#include <cstring>

#include <dlfcn.h>
#include <unistd.h>

#include <robomosp/sdk/plugin.h>

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
        (void)entry();
      } catch (...) {  // NOLINT: the host tells what it threw
      }
    }
  }
  std::fflush(stdout);
  constexpr char kDone[] = "\x1erobomosp-plugin-trial: done\x1e";
  const bool said = ::write(STDOUT_FILENO, kDone, sizeof kDone - 1) == sizeof kDone - 1;
  // What its static objects do at the end is of no account: plugins are never unloaded.
  ::_exit(said ? 0 : 1);
}
