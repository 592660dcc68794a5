// SPDX-License-Identifier: GPL-3.0-or-later
// check_display: whether a window can be opened (layer: GUI; Qt stays behind the source file).
#pragma once

#include <robomosp/sdk/result.h>

namespace robomosp::viewer {

/// Checks that a display is available; the error explains why no window can be opened. Qt itself
/// would end the program, so a child process tries it, for at most five seconds; the result is
/// cached. Call from the thread of `main`, before other threads start: it forks.
[[nodiscard]] Result<void> check_display();

}  // namespace robomosp::viewer
