// SPDX-License-Identifier: GPL-3.0-or-later
// The OpenGL that windows get in the format of the display (layer: GUI). [GUI thread]
#pragma once

#include <QString>

namespace robomosp::viewer {

struct WindowOpenGl {
  QString renderer, version;  ///< renderer empty: windows of this platform get none
};
/// Asks the platform of the running application.
[[nodiscard]] WindowOpenGl window_opengl();

}  // namespace robomosp::viewer
