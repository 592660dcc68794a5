// SPDX-License-Identifier: GPL-3.0-or-later
// VariablePicker: the searchable list of the columns of a recording, and a line for an expression
// over them (layer: GUI).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <QFrame>
#include <QString>

#include "viewer/timeline/recording_data.h"

class QLabel;
class QLineEdit;
class QListWidget;
class QListWidgetItem;
class QPushButton;

namespace robomosp::viewer {

/// "tau" of "tau3", "arm.qd" of "arm.qd2"; "" of a name without a number at its end.
[[nodiscard]] std::string stem_of(const std::string& column);

/// [GUI thread]
class VariablePicker : public QFrame {
 public:
  explicit VariablePicker(QWidget* parent = nullptr);
  /// Opens below a button.
  void open_below(const QWidget& button, const std::vector<ColumnInfo>& columns);

  /// Columns that were chosen: for a new lane, or for the present one.
  std::function<void(std::vector<std::string> columns, bool into_present_lane)> on_choose;
  /// An expression over the columns, to become a column of this name; "" = a name is made.
  std::function<void(const QString& expression, const QString& name, const QString& unit)>
      on_expression;
  /// Shows why an expression was refused; "" = nothing is.
  void show_fault(const QString& sentence);
  [[nodiscard]] QListWidget& list() const { return *list_; }
  [[nodiscard]] QLineEdit& search() const { return *search_; }

 protected:
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  void fill();
  void choose(bool into_present_lane);
  void compute();

  QLineEdit *search_, *expression_, *name_, *unit_;
  QListWidget* list_;
  QPushButton *add_, *add_to_lane_, *compute_;
  QLabel* fault_;
  std::vector<ColumnInfo> columns_;
};

}  // namespace robomosp::viewer
