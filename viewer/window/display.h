// SPDX-License-Identifier: GPL-3.0-or-later
// Display: the 3-D picture as a widget (layer: GUI). Repaints only after changes.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include <QElapsedTimer>
#include <QTimer>
#include <QVariantAnimation>
#include <QWidget>

#include <robomosp/sdk/result.h>

#include "viewer/desktop/listeners.h"
#include "viewer/frame.h"
#include "viewer/scene/image.h"
#include "viewer/scene/scene_view.h"
#include "viewer/window/pace.h"
#include "viewer/window/views.h"

namespace robomosp::viewer {

class Refiner;

/// How a picture gets into its window.
enum class DrawingMethod : std::uint8_t {
  automatic,  ///< `window` with a graphics card, `copied` with software OpenGL, otherwise `image`
  window,     ///< by the window's OpenGL, with which Qt composes the window
  copied,     ///< by the platform's OpenGL into memory, then painted as any widget is
  image       ///< through EGL into an image, without any OpenGL of the platform
};

class Display : public QWidget {
 public:
  /// A press that moves the mouse by less is a click, since a hand trembles [px].
  static constexpr int kLeastDrag = 4;

  /// For the running QApplication. Where the platform has no OpenGL, every method is `image`; fails
  /// if that does not work, either. Without a quality, one that suits the renderer.
  [[nodiscard]] static Result<std::unique_ptr<Display>> create(
      std::optional<Quality> quality = {}, DrawingMethod method = DrawingMethod::automatic);
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

  /// Shows four views beside each other: top, perspective, front and right, each with a separate
  /// camera. Mouse and keys act on the active one, which is the one last pressed in.
  void set_four_view(bool on);
  [[nodiscard]] bool has_four_view() const { return !panes_.empty(); }
  [[nodiscard]] std::size_t active_pane() const { return active_; }
  void activate_pane(std::size_t pane);
  /// The view at a place of the widget [device-independent px]; the active one beside them.
  [[nodiscard]] std::size_t pane_at(QPointF place) const;
  /// Upper left corner of the active view in the widget [device-independent px]. camera() and its
  /// projection belong to that view.
  [[nodiscard]] QPointF pane_origin() const;
  /// One of the views beside each other, or the only one.
  struct View {
    OrbitCamera camera;
    QRectF place;  ///< in the widget [device-independent px]
  };
  [[nodiscard]] std::vector<View> views() const;
  [[nodiscard]] View active_view() const;
  /// The view that shows a place of the widget [device-independent px].
  [[nodiscard]] View view_at(QPointF place) const;
  /// Makes the view at a place the active one. True if another was.
  bool activate_at(QPointF place);
  void set_stereo(const StereoSettings& settings);
  [[nodiscard]] const StereoSettings& stereo() const { return stereo_; }
  /// Puts the camera of the active view where another one is.
  void set_camera(const OrbitCamera& camera);

  /// Of the active view.
  [[nodiscard]] const OrbitCamera& camera() const;
  /// True once the user moved the camera.
  [[nodiscard]] bool is_touched() const { return is_touched_; }
  /// True unless stills are impossible or off.
  [[nodiscard]] bool can_refine() const { return is_refining_; }
  /// The item at a position of the widget [device-independent px], as the view there shows it.
  [[nodiscard]] std::optional<Pick> pick(QPointF place) const;
  /// The picture as a still of the best quality; size in pixels.
  [[nodiscard]] Result<Image> still(int width, int height);
  /// The image currently on the screen.
  [[nodiscard]] QImage shown();
  /// Pictures drawn so far; does not grow while nothing changes.
  [[nodiscard]] int pictures_drawn() const;
  /// True once the still is on the screen.
  [[nodiscard]] bool is_refined() const;
  /// True while the picture has fewer pixels than its place, because the view moves.
  [[nodiscard]] bool is_coarse() const;
  /// By which method the picture is drawn; never `automatic`.
  [[nodiscard]] DrawingMethod drawing_method() const { return drawing_method_; }
  [[nodiscard]] const QString& renderer_name() const;

  std::function<void(std::optional<Pick>)> on_pick;  ///< after each click without a drag
  std::function<void()> on_camera;                   ///< after each change of the camera
  Listeners<> redrawn;  ///< after each change of what is shown, and when a still covers it

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
  class CopiedSurface;
  class ImageSurface;
  class Painted;
  class Overlay;
  class PaneMarks;
  struct Pane {
    OrbitCamera camera, fitted;
    QRect rect;  ///< [px]
  };
  Display();
  void refine();
  void changed(bool is_motion = false);
  void come_to_rest();
  // display_views.cpp
  [[nodiscard]] std::vector<SceneShot> shots() const;
  void draw_shots(SceneView& scene, int only) const;
  void show_mixed();
  void lay_panes();
  void fit_pane(std::size_t pane);
  void fit_panes();
  void mark_panes();
  [[nodiscard]] QPointF in_pane(QPointF place) const;
  [[nodiscard]] View pane_view(std::size_t pane) const;
  [[nodiscard]] QSize pixels() const;
  void camera_moved();
  void resize_scene();
  [[nodiscard]] SceneView& scene() const;

  DrawingMethod drawing_method_ = DrawingMethod::image;
  std::unique_ptr<Surface> surface_;
  std::unique_ptr<Refiner> refiner_;
  Overlay* overlay_;
  QTimer idle_;    // expires after a while without changes
  QTimer mixing_;  // the picture of both eyes is due
  QTimer still_;   // expires when the view does not move any more
  Pace pace_;
  QElapsedTimer since_frame_;  // time since the last frame was set
  bool is_refining_ = false, is_refined_ = false, refits_panes_ = false;
  std::vector<Pane> panes_;  ///< empty = one view
  std::size_t active_ = 0;
  PaneMarks* marks_ = nullptr;
  StereoSettings stereo_;
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
