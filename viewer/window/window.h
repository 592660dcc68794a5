// SPDX-License-Identifier: GPL-3.0-or-later
// run_window: shows a Frame in a separate window, with mouse camera and timeline (layer: GUI; Qt
// stays behind the source file). For a larger program use ViewerWindow from viewer_window.h.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <robomosp/sdk/result.h>

#include "viewer/frame.h"
#include "viewer/scene/scene_view.h"

class QWidget;

namespace robomosp::viewer {

class ViewerWindow;

/// Options of a window.
struct WindowOptions {
  std::string title = "ROBOMOSP";
  int width = 1280, height = 860;  ///< of the window [device-independent px]
  std::optional<Quality> quality;  ///< nothing: chosen by the speed of the OpenGL renderer
  bool software_view = false;      ///< draw through EGL even where a window could use OpenGL
  bool refine = true;              ///< replace a static picture by one of best quality
  bool play = false;               ///< start the playback at once
  double speed = 1.0;              ///< playback seconds per second
  std::string screenshot;          ///< PNG file of the whole window; empty: none
  double screenshot_after = 1.0;   ///< earliest time of the screenshot, after which the program
                                   ///< ends [s]
  /// Called before the window is shown, such as to connect it to a live scene.
  std::function<void(ViewerWindow& window)> on_open;
  std::function<void(std::optional<Pick>)> on_pick;  ///< after each click; nothing = background
  std::function<void(QWidget& window)> on_shown;     ///< once the first picture is on the screen
};

/// Checks that a display is available; the error explains why no window can be opened. Qt itself
/// would end the program, so a child process tries it, for at most five seconds; the result is
/// cached. Call from the thread of `main`, before other threads start: it forks.
[[nodiscard]] Result<void> check_display();

/// Opens the window and returns when it is closed: 0, or 1 after printing to standard error why no
/// window can be opened. Call from the thread of `main`; creates the QApplication if there is none.
[[nodiscard]] int run_window(const Frame& frame, const Playback& playback,
                             const WindowOptions& options = {});

}  // namespace robomosp::viewer
