// SPDX-License-Identifier: GPL-3.0-or-later
// WidgetPage: every widget for values in every state, with palette and type, for the tour, tests
// and those who change widgets (layer: GUI).
#pragma once

#include <vector>

#include <QPoint>
#include <QRect>
#include <QString>
#include <QWidget>

class QLabel;

namespace robomosp::viewer {

class Field;
class NumberField;

/// A page of 960 x 1200 at zoom 1, in the current theme. It has no client and changes nothing.
/// Made anew after a change of the theme. [GUI thread]
class WidgetPage : public QWidget {
 public:
  explicit WidgetPage(QWidget* parent = nullptr);
  QSize sizeHint() const override;

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  [[nodiscard]] QRect at(double x, double y, double width, double height) const;
  QLabel* text(const QString& words, const QRect& place, const char* property = nullptr);
  void block(const QString& title, const QString& about, double x, double y, double width,
             double height);
  void add_numbers();
  void add_pose();
  void add_materials();
  void add_buttons();
  void add_rows();
  void add_choices();
  void add_joints();
  void add_lengths();
  NumberField* number_row(double& y, const QString& label, const QString& note);

  std::vector<QRect> blocks_;
  std::vector<QPoint> marks_;  ///< of changed values
};

}  // namespace robomosp::viewer
