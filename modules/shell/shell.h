// SPDX-License-Identifier: Apache-2.0
// The program `robomosp`: command line, console, script runner and JSON-RPC on standard input
// (layer: application, shell).
#pragma once

#include <robomosp/sdk/result.h>

namespace robomosp::shell {

/// Runs the program and returns its exit code: 0 ok, 1 the task failed, 2 wrong usage, 3 invalid
/// input, 4 not reachable, 130 interrupted. [application thread]
int shell_main(int argc, char** argv);

/// The exit code that an error means.
[[nodiscard]] int exit_code(ErrorCode code);

}  // namespace robomosp::shell
