// SPDX-License-Identifier: GPL-3.0-or-later
// PlotLanes: curves over time in lanes one below the other, with one axis of time and one cursor; a
// legend at the left shows the values under the cursor (layer: GUI).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QColor>
#include <QPointF>
#include <QString>
#include <QTimer>
#include <QWidget>

#include "viewer/plots/series.h"
#include "viewer/plots/time_axis.h"

class QCustomPlot;
class QCPAxisRect;
class QCPGraph;

namespace robomosp::viewer {

struct Curve {
  std::string key;  ///< of the column, unique in its lane
  QString name;     ///< in the legend
  std::shared_ptr<const Series> series;
  double scale = 1;        ///< from the unit of the series to the shown one
  std::size_t colour = 0;  ///< of the theme's series
  bool is_step = false;
  int base = -1;  ///< of a compared recording: the curve of the lane that it is compared with
};
struct Lane {
  QString title;  ///< quantity and unit
  std::vector<Curve> curves;
  bool has_one_unit = true;
};

/// A number with digits that do not change while it moves, and a true minus sign.
[[nodiscard]] QString fixed_number(double value, int decimals);
/// Decimals for three digits of numbers up to `greatest`.
[[nodiscard]] int decimals_for(double greatest);

/// A click moves the time, the wheel zooms it, dragging moves a zoomed range, a double click shows
/// all; Shift with the wheel moves it. [GUI thread]
class PlotLanes : public QWidget {
 public:
  explicit PlotLanes(TimeAxis& axis, QWidget* parent = nullptr);
  ~PlotLanes() override;

  void show_lanes(std::vector<Lane> lanes);
  /// Draws the same lanes again, after samples were added.
  void refresh();
  [[nodiscard]] const std::vector<Lane>& lanes() const { return lanes_; }
  void set_cursor(std::optional<double> time);
  /// Draws the curves dimmed, such as of a recording that is out of date.
  void set_dimmed(bool on);
  [[nodiscard]] bool is_dimmed() const { return is_dimmed_; }
  /// Values under the cursor as the legend has them; "" without a value.
  [[nodiscard]] QString value_text(std::size_t lane, std::size_t curve) const;
  /// Where curves cross a time, in px of this widget.
  struct Mark {
    QPointF at;
    QColor colour;
  };
  [[nodiscard]] std::vector<Mark> marks(double time) const;
  /// Points that were given to the painter the last time, and how long that took [ms].
  [[nodiscard]] std::size_t drawn_points() const { return drawn_points_; }
  [[nodiscard]] double drawn_ms() const { return drawn_ms_; }
  [[nodiscard]] int current_lane() const { return current_; }
  void set_current_lane(int lane);
  [[nodiscard]] int lane_at(int y) const;
  [[nodiscard]] QRect lane_rect(int lane) const;
  [[nodiscard]] QSize sizeHint() const override;
  [[nodiscard]] QSize minimumSizeHint() const override;
  [[nodiscard]] QCustomPlot& plot() const { return *plot_; }

  std::function<void(double time)> on_scrub;
  std::function<void(int lane)> on_remove;
  std::function<void(int lane, int by)> on_move;  ///< up or down
  std::function<void(int lane, QPoint global)> on_menu;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void contextMenuEvent(QContextMenuEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  struct Drawn {
    QCPAxisRect* rect = nullptr;
    std::vector<QCPGraph*> graphs;
    double low = 0, high = 1;
    std::vector<int> decimals;  ///< of each curve
  };
  void build();
  void measure();
  void place();
  void draw();
  void draw_later();
  void style();
  void paint_legend(QPainter& p, std::size_t lane, const QRect& area) const;
  [[nodiscard]] std::optional<double> value(const Curve& curve, double time) const;
  [[nodiscard]] int legend_width() const;

  TimeAxis& axis_;
  QCustomPlot* plot_;
  std::vector<Lane> lanes_;
  std::vector<Drawn> drawn_;
  std::optional<double> cursor_;
  QTimer draw_timer_;
  bool is_dimmed_ = false, is_dragging_ = false;
  int current_ = 0;
  std::optional<QPointF> pressed_;
  double pressed_low_ = 0, pressed_high_ = 0;
  std::size_t drawn_points_ = 0;
  double drawn_ms_ = 0;
  int themed_ = 0;
};

}  // namespace robomosp::viewer
