// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>

#include "shell/shell.h"

int main(int argc, char** argv) {
  try {
    return robomosp::shell::shell_main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "error: an unexpected failure: %s. Please report this.\n", e.what());
  } catch (...) {
    std::fprintf(stderr, "error: an unexpected failure. Please report this.\n");
  }
  return 1;
}
