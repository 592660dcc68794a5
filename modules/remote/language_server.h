// SPDX-License-Identifier: Apache-2.0
// The Language Server Protocol (3.17) for the languages of robots' programs: messages with their
// length over two descriptors (layer: application, remote).
#pragma once

#include "ioci/core/application.h"

namespace robomosp::remote {

/// Answers an editor on `in` and `out` until it says exit, or the input ends. Gives the exit code
/// of the program: 0 where shutdown came before. [one thread]
[[nodiscard]] int serve_editor(ioci::Application& app, int in, int out);

}  // namespace robomosp::remote
