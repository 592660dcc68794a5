// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/desktop/pose_sources.h"

#include <optional>

#include <QPointer>
#include <QStatusBar>

#include "kernel/schema.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/view_tab.h"

namespace robomosp::viewer {
namespace {

PoseSource pose_source(MainWindow& window, std::function<std::optional<Pose>(const ViewTab&)> of,
                       const char* missing) {
  return [window = QPointer<MainWindow>(&window), of = std::move(of),
          missing](const std::function<void(const Value&)>& answer) {
    if (!window) return;
    const ViewTab* view = window->current_view();
    const std::optional<Pose> pose = view ? of(*view) : std::nullopt;
    constexpr int kShownMs = 10000;
    if (pose) answer(pose_value(*pose));
    else window->statusBar()->showMessage(missing, kShownMs);
  };
}

}  // namespace

PoseSource pose_of_camera(MainWindow& window) {
  return pose_source(
      window,
      [](const ViewTab& view) -> std::optional<Pose> {
        const OrbitCamera& camera = view.display().camera();
        const Vec3 x = camera.right(), y = camera.up(), z = camera.backward();
        Pose pose;
        pose.p = camera.eye();
        pose.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
        return pose;
      },
      "No view is open, and so no camera. Open a world or a robot.");
}

PoseSource pose_of_selection(MainWindow& window) {
  return pose_source(
      window, [](const ViewTab& view) { return view.selected_pose(); },
      "Select one member of the world in the current view to take its pose.");
}

}  // namespace robomosp::viewer
