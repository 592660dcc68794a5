// SPDX-License-Identifier: GPL-3.0-or-later
// Display: the 3-D picture as a widget, drawn by OpenGL in the window or, if that is unavailable,
// through EGL into an image (layer: GUI). Repaints only after changes.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include <QTimer>
#include <QVariantAnimation>
#include <QWidget>

#include <robomosp/sdk/result.h>

#include "viewer/frame.h"
#include "viewer/scene/image.h"
#include "viewer/scene/scene_view.h"

namespace robomosp::viewer {

class OffscreenRenderer;

class Display : public QWidget {
 public:
  /// Selects the drawing method for the running QApplication. Fails if neither method works.
  [[nodiscard]] static Result<std::unique_ptr<Display>> create(std::optional<Quality> quality,
                                                               bool software_view);
  ~Display() override;

  void set_frame(const Frame& frame);
  void set_playback(std::shared_ptr<const Playback> playback);
  void set_time(double time);  ///< [s]
  void select(const std::vector<std::uint64_t>& ids);
  void look(Camera::View view);
  void fit();
  /// The next frame is fitted again, even if its camera equals the last one's.
  void forget_camera();
  /// Moves the camera to these items, or to all without any, in a quarter of a second.
  void fly_to(const std::vector<std::uint64_t>& ids);
  void set_perspective(bool on);
  /// Shows the studio with a dark floor and wall.
  void set_dark(bool on);
  /// While nothing changes, replaces the picture by a still of best quality. Off by default.
  void set_refining(bool on);

  [[nodiscard]] const OrbitCamera& camera() const;
  /// True once the user moved the camera.
  [[nodiscard]] bool is_touched() const { return is_touched_; }
  /// True unless stills are impossible or off.
  [[nodiscard]] bool can_refine() const { return is_refining_; }
  /// The item at a position of the widget [device-independent px].
  [[nodiscard]] std::optional<Pick> pick(QPointF place) const;
  /// The picture as a still of the best quality; size in pixels.
  [[nodiscard]] Result<Image> still(int width, int height);
  /// The image currently on the screen.
  [[nodiscard]] QImage shown();
  /// Pictures drawn so far; does not grow while nothing changes.
  [[nodiscard]] int pictures_drawn() const;
  /// True once the still is on the screen.
  [[nodiscard]] bool is_refined() const;
  [[nodiscard]] bool uses_window_opengl() const;
  [[nodiscard]] const QString& renderer_name() const;

  std::function<void(std::optional<Pick>)> on_pick;  ///< after each click without a drag
  std::function<void()> on_camera;                   ///< after each change of the camera

 protected:
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  class Surface;
  class GlSurface;
  class ImageSurface;
  class Overlay;
  Display();
  void prepare_still(OffscreenRenderer& renderer) const;
  void refine();
  void forget_refiner();
  void changed();
  void camera_moved();
  void resize_scene();
  [[nodiscard]] SceneView& scene() const;

  std::unique_ptr<Surface> surface_;
  std::unique_ptr<OffscreenRenderer> refiner_;
  Overlay* overlay_;
  QTimer idle_;  // expires after a while without changes, then once per pass
  bool is_refining_ = false, is_started_ = false;
  Frame frame_;
  std::shared_ptr<const Playback> playback_;
  std::optional<double> time_;
  std::vector<std::uint64_t> selected_;
  QPointF pressed_, last_;
  bool is_click_ = false, is_dark_ = false, is_touched_ = false;
  std::optional<Vec3> pivot_;  ///< that a drag circles [m]; none = the camera's target
  QVariantAnimation flight_;
};

}  // namespace robomosp::viewer
