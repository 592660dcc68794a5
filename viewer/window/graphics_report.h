// SPDX-License-Identifier: GPL-3.0-or-later
// What the window draws with: Qt, its platform, OpenGL of windows and of EGL, fonts (layer: GUI).
#pragma once

#include <string>

namespace robomosp::viewer {

/// A line each, indented by two spaces; what is missing begins with "missing: ". Starts a
/// QApplication if none runs, so call check_display() before. [thread of main]
[[nodiscard]] std::string graphics_report(bool has_display);

}  // namespace robomosp::viewer
