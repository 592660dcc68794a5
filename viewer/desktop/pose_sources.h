// SPDX-License-Identifier: GPL-3.0-or-later
// Poses that fields take from the window: of the camera and of the selected member (layer: GUI).
#pragma once

#include <functional>

#include "kernel/value.h"

namespace robomosp::viewer {

class MainWindow;

/// Calls back with a pose, at once; not at all if there is none, which the status bar then says.
using PoseSource = std::function<void(std::function<void(const Value&)> answer)>;

/// The camera of the current view in the world: x to the right, y upwards, looking along -z.
[[nodiscard]] PoseSource pose_of_camera(MainWindow& window);
/// The frame of the only selected member of the current view in its world.
[[nodiscard]] PoseSource pose_of_selection(MainWindow& window);

}  // namespace robomosp::viewer
