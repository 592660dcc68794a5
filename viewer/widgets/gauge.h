// SPDX-License-Identifier: GPL-3.0-or-later
// Gauges: how near a value is to its limits (layer: GUI).
#pragma once

#include <optional>

#include "viewer/widgets/field.h"
#include "viewer/widgets/number_field.h"

class QLabel;
class QToolButton;

namespace robomosp::viewer {

/// A bar from 0 to 1: green, amber from `warn` on, red from 1 on; the words beside it say the same.
class Gauge : public QWidget {
 public:
  explicit Gauge(QWidget* parent = nullptr);
  void set_share(double share);  ///< clamped to the bar; above 1 = over the limit
  void set_text(const QString& text);
  /// A label in front of the bar; empty = none.
  void set_label(const QString& label);
  void set_warn(double share) { warn_ = share; }
  [[nodiscard]] double share() const { return share_; }
  QSize sizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  double share_ = 0, warn_ = 0.8;
  QString text_, label_;
};

/// A joint: number, name, buttons to step, position between the limits with the torque as a share
/// of its limit below, and the value as a number. The keys - and + step.
class JointRow : public Field {
 public:
  JointRow(int number, const QString& name, NumberFormat format, QWidget* parent = nullptr);
  [[nodiscard]] std::optional<Value> value() const override;
  void set_value(const std::optional<Value>& value) override;
  void set_step(double si) { step_ = si; }
  /// Torque or force and its limit; no limit = not shown as a share.
  void set_effort(std::optional<double> effort, std::optional<double> limit);
  [[nodiscard]] NumberField* field() const { return field_; }
  /// Whether the position is within 5 % of the range of a limit.
  [[nodiscard]] bool is_near_limit() const;
  /// Whether the bar and the number are below the name, since there is no space beside it.
  [[nodiscard]] bool is_stacked() const { return is_stacked_; }
  QSize sizeHint() const override;
  QSize minimumSizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void keyPressEvent(QKeyEvent* event) override;
  void take_theme() override;
  void mousePressEvent(QMouseEvent* event) override;
  void mouseMoveEvent(QMouseEvent* event) override;
  void mouseReleaseEvent(QMouseEvent* event) override;

 private:
  void arrange();
  [[nodiscard]] QRect bar() const;
  /// Top and height of the line with the bar.
  [[nodiscard]] QRect bar_line() const;
  void step(int by);
  void drag_to(int x, Stage stage);
  int number_;
  QString name_;
  NumberFormat format_;
  NumberField* field_;
  QToolButton *less_, *more_;
  double step_;
  std::optional<double> effort_, effort_limit_;
  bool is_dragged_ = false, is_stacked_ = false;
};

}  // namespace robomosp::viewer
