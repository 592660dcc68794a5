// SPDX-License-Identifier: GPL-3.0-or-later
// Measuring: distances, angles, lengths and radii between what clicks in a picture hold to
// (layer: GUI).
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <QObject>
#include <QString>

#include "viewer/desktop/desk.h"
#include "viewer/gizmo/gizmo.h"
#include "viewer/gizmo/snapping.h"
#include "viewer/window/display.h"

class QPainter;

namespace robomosp::viewer {

/// A line with its numbers, as the command `measure` of the shown record gave them.
struct Measurement {
  Vec3 from{}, to{};  ///< in the world [m]
  QString text;
};

/// [GUI thread]
class Measuring : public QObject {
 public:
  /// Desk and display outlive it.
  Measuring(Desk& desk, Display& display) : desk_(desk), display_(display) {}
  void set_picture(const ioci::LiveView::PicturePtr& picture, const viewer::Frame& frame) {
    picture_ = picture;
    frame_ = &frame;
  }
  /// Arguments of `measure` for the time of a recording or run that moves the picture.
  std::function<Map()> motion;
  /// Takes mouse and keys while the tool is chosen: a click holds to what is under the mouse, the
  /// second one measures, Escape forgets all, Ctrl+C copies.
  bool take(QEvent& event);
  void paint(QPainter& painter, const ScreenCamera& camera) const;
  [[nodiscard]] const std::vector<Measurement>& all() const { return all_; }
  [[nodiscard]] bool is_asking() const { return asking_ > 0; }
  void forget();

 private:
  [[nodiscard]] std::optional<SnapTarget> under(QPointF at);
  void hold(const SnapTarget& target);
  /// The argument a or b of `measure` for what a click holds to; an empty map: the element is gone.
  [[nodiscard]] Map place_of(const SnapTarget& target) const;
  /// Calls `measure` of the record that is shown; `done` gets its result.
  void ask(Map arguments, const std::function<void(const Map&)>& done);
  void measure_one(const SnapTarget& target);
  void measure(const SnapTarget& a, const SnapTarget& b);
  void add(Measurement m);

  Desk& desk_;
  Display& display_;
  ioci::LiveView::PicturePtr picture_;
  const viewer::Frame* frame_ = nullptr;
  Snapper snapper_;
  std::optional<SnapTarget> hovered_, first_;
  std::vector<Measurement> all_;
  int asking_ = 0;
};

}  // namespace robomosp::viewer
