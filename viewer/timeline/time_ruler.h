// SPDX-License-Identifier: GPL-3.0-or-later
// TimeRuler: the times that the timeline shows, and the flag of the present one (layer: GUI).
#pragma once

#include <optional>
#include <vector>

#include <QColor>
#include <QPointF>
#include <QPointer>
#include <QWidget>

#include "viewer/desktop/player.h"
#include "viewer/plots/time_axis.h"

class QPainter;

namespace robomosp::viewer {

/// A press or drag moves the time; arrow keys, Home and End do, too; the wheel zooms. [GUI thread]
class TimeRuler : public QWidget {
 public:
  explicit TimeRuler(TimeAxis& axis, QWidget* parent = nullptr);
  void set_player(Player* player);
  [[nodiscard]] QSize sizeHint() const override;
  /// The time at a place [s], and back.
  [[nodiscard]] double time_at(double x) const { return axis_.time_at(x); }
  [[nodiscard]] double x_of(double time) const { return axis_.x_of(time); }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;

 private:
  void scrub(double x);
  void paint_focus(QPainter& painter) const;
  TimeAxis& axis_;
  QPointer<Player> player_;
};

/// The line of the present time over ruler, bands and plots. It takes no events. [GUI thread]
class TimeCursor : public QWidget {
 public:
  struct Dot {
    QPointF at;
    QColor colour;
  };
  TimeCursor(TimeAxis& axis, QWidget* over);
  /// In the coordinates of the widget that it lies over; no line without a time.
  void show_at(std::optional<double> time, std::vector<Dot> dots);

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  TimeAxis& axis_;
  std::optional<double> time_;
  std::vector<Dot> dots_;
};

}  // namespace robomosp::viewer
