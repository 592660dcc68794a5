// SPDX-License-Identifier: GPL-3.0-or-later
// RunPull: pulls objects and links of a live run with the mouse, by run.pull and run.release
// (layer: GUI).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>

#include <QEvent>
#include <QObject>
#include <QPointF>
#include <QRectF>
#include <QString>
#include <QTimer>

#include "viewer/desktop/desk.h"
#include "viewer/gizmo/gizmo.h"
#include "viewer/window/display.h"

class QMouseEvent;
class QPainter;

namespace robomosp::viewer {

/// [GUI thread]
class RunPull : public QObject {
 public:
  /// Desk and display outlive it. `redraw` is called when paint() has something else to draw.
  RunPull(Desk& desk, Display& display, std::function<void()> redraw);
  ~RunPull() override;
  /// Pulls in this run from now on; none = in no run.
  void set_run(const std::optional<Handle>& run);
  void set_picture(const ioci::LiveView::PicturePtr& picture) { picture_ = picture; }

  /// A press that nothing else took: a drag from it pulls what is under it.
  void press(const QMouseEvent& event);
  /// True if the event belongs to a pull.
  [[nodiscard]] bool move(const QMouseEvent& event, const ScreenCamera& camera);
  [[nodiscard]] bool release(const QMouseEvent& event);
  /// Ends the pull, as Escape does and a window that is left.
  void end();

  [[nodiscard]] bool is_pulling() const { return held_.has_value(); }
  /// What is drawn beside the mouse: the force of the spring, or why it does not act.
  [[nodiscard]] QString readout() const;
  /// Why a drag of what is under the mouse turns the view instead, or what a drag would do.
  [[nodiscard]] QString hint() const;
  /// The pulled point in the world as the picture shows it; none = it is not there.
  [[nodiscard]] std::optional<Vec3> point() const;
  void paint(QPainter& painter, const ScreenCamera& camera) const;

 private:
  /// An object or link and a point of it.
  struct Body {
    std::string member, link;  ///< of the world; "" = an object
    std::string words;         ///< `"box"`, `link "forearm" of "arm"`
    std::int32_t body = 0;     ///< of the member of the scene
    Vec3 point{};              ///< in its frame [m]
    Vec3 to{};                 ///< in the world [m]
  };
  [[nodiscard]] std::optional<Body> body_under(const QPointF& at) const;
  [[nodiscard]] std::optional<Pose> world_T(const Body& body) const;
  [[nodiscard]] Map arguments(const Body& body, bool with_place) const;
  void take(const Map& state);
  void begin(Body body);
  void send();
  void echo_place();
  /// Calls `done` with an answer to the present pull only: that to an earlier one may come late.
  [[nodiscard]] Desk::Done of_this_pull(Desk::Done done);
  void sent();

  Desk& desk_;
  Display& display_;
  std::function<void()> redraw_;
  ioci::LiveView::PicturePtr picture_;
  std::optional<Handle> run_;
  std::set<std::string> pullable_;  ///< members of the run that forces move
  bool is_known_ = false, is_playing_ = false, is_over_ = false;  ///< the run, as reported
  bool is_pressed_ = false;                                       ///< a drag may begin
  QPointF pressed_at_;
  QString refused_;  ///< why the drag that began does not pull
  std::optional<Body> held_;
  std::uint64_t number_ = 0;  ///< of the pull, 1, 2, ...
  double force_ = 0;          ///< of the spring [N]
  bool has_force_ = false, is_waiting_ = false, has_newer_ = false;
  bool is_spent_ = false;  ///< the button is down, and the drag turns nothing any more
  QTimer rest_;            ///< until the mouse counts as at rest
};

}  // namespace robomosp::viewer
