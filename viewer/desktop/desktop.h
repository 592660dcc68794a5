// SPDX-License-Identifier: GPL-3.0-or-later
// run_desktop: the window of the program until it is closed (layer: GUI; Qt stays behind the source
// file).
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ioci/client/opening.h"
#include "ioci/client/window_program.h"
#include "viewer/frame.h"

namespace robomosp::viewer {

class StartTimes;

struct DesktopOptions {
  std::vector<ioci::OpenRequest> open{};  ///< shown in tabs, in this order; none = the start page
  std::vector<std::filesystem::path> plugin_path{};
  // How the first tab is shown.
  std::optional<double> at{};  ///< time of the recording [s]
  Camera camera{};
  Style style = Style::smooth;
  bool has_edges = true, has_hidden_edges = false;
  std::vector<std::string> layers{};
  double explode = 0;
  std::string map{}, map_robot{}, map_cut{};  ///< "" = no map
  double map_opacity = 1;

  std::string screenshot{};  ///< PNG file of the window, after which it ends; "" = none
  std::string tour{};        ///< folder for pictures of all panels, after which it ends
  std::vector<std::string> tour_pictures{};  ///< names of those taken; none = all
  std::array<int, 2> size{0, 0};      ///< of the window [device-independent px]; 0 = as it was last
  bool software_view = false;         ///< draw through EGL even where a window could use OpenGL
  bool is_safe = false;               ///< without the settings of the user, with a note
  StartTimes* start_times = nullptr;  ///< printed once the window is usable, then it ends
};

/// Opens the window and returns its exit status when it is closed. Call check_display() before, and
/// this from the thread of `main`.
[[nodiscard]] int run_desktop(ioci::Application& app, DesktopOptions options);

}  // namespace robomosp::viewer
