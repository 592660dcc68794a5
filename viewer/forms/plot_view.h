// SPDX-License-Identifier: GPL-3.0-or-later
// PlotView: curves of columns over time, in a panel for each unit (layer: GUI).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QWidget>

namespace robomosp::viewer {

/// Columns of equal length. Immutable once shown.
struct PlotData {
  struct Column {
    std::string name, unit;
    std::vector<double> values;
  };
  std::string x_name, x_unit;
  std::vector<double> x;
  std::vector<Column> columns;
};

/// Draws at most a few points for each pixel. The wheel zooms the horizontal axis about the cursor,
/// dragging moves it, a double click shows everything; the cursor reads values. [GUI thread]
class PlotView : public QWidget {
 public:
  explicit PlotView(QWidget* parent = nullptr);
  void show_data(std::shared_ptr<const PlotData> data);
  /// Shows a column or not.
  void set_shown(std::size_t column, bool on);
  [[nodiscard]] const PlotData* data() const { return data_.get(); }
  /// Range of the horizontal axis that is shown.
  [[nodiscard]] std::pair<double, double> range() const { return {from_, to_}; }
  QSize sizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void wheelEvent(QWheelEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;
  void mouseDoubleClickEvent(QMouseEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void leaveEvent(QEvent* event) override;

 private:
  struct Panel {
    std::string unit;
    std::vector<std::size_t> columns;
    double low = 0, high = 1;
  };
  void fit();
  void make_panels();
  [[nodiscard]] QRect area() const;
  [[nodiscard]] double x_at(double pixel) const;
  [[nodiscard]] double pixel_at(double x) const;
  void zoom(double factor, double about);
  void move_by(double x);
  std::shared_ptr<const PlotData> data_;
  std::vector<bool> shown_;
  std::vector<Panel> panels_;
  double from_ = 0, to_ = 1;
  std::optional<double> cursor_;
  std::optional<int> drag_x_;
};

}  // namespace robomosp::viewer
