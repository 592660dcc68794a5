// SPDX-License-Identifier: GPL-3.0-or-later
// ResultView: the result of a command as plot, table, picture or value (layer: GUI).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <QWidget>

#include "ioci/client/client.h"
#include "kernel/value.h"

class QLabel;
class QPlainTextEdit;
class QPushButton;
class QStackedWidget;
class QTableView;

namespace robomosp::viewer {

class ChoiceField;
class PlotView;
struct PlotData;

/// A result as rows and columns: a list of maps, a matrix, a map of columns of equal length, a
/// vector, a map of plain values. Empty columns = it has none of these forms.
struct ResultTable {
  std::vector<std::string> columns, units;
  std::vector<std::vector<Value>> rows;
  bool is_curve = false;  ///< all columns are numbers with a first one that rises: worth a plot
};
[[nodiscard]] ResultTable table_of(const Value& result);

/// Chooses how to show a result by its form; tabs switch between the modes that apply. Recordings
/// are asked for their columns. [GUI thread]
class ResultView : public QWidget {
 public:
  /// The client outlives the view.
  explicit ResultView(ioci::Client& client, QWidget* parent = nullptr);
  void show_result(const Value& result, const std::string& unit = {});
  void clear();
  /// "plot", "table", "picture", "value": the modes that apply, the first is shown at first.
  [[nodiscard]] std::vector<std::string> modes() const { return modes_; }
  [[nodiscard]] std::string shown_mode() const;
  void show_mode(const std::string& mode);
  [[nodiscard]] PlotView* plot() const { return plot_; }
  [[nodiscard]] QTableView* table() const { return table_; }
  [[nodiscard]] QPlainTextEdit* text() const { return text_; }
  [[nodiscard]] QLabel* picture() const { return picture_; }

 protected:
  void resizeEvent(QResizeEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  void set_plot(std::shared_ptr<const PlotData> data);
  void show_units();
  void set_modes(std::vector<std::string> modes);
  void show_table(ResultTable table);
  void show_recording(const Handle& recording);
  bool show_picture_file(const std::string& file);
  void fit_picture();
  ioci::Client& client_;
  std::vector<std::string> modes_;
  QWidget* tabs_;
  std::vector<QPushButton*> buttons_;  ///< plot, table, picture, value
  ChoiceField* units_;
  QStackedWidget* stack_;
  PlotView* plot_;
  QTableView* table_;
  QLabel* picture_;
  QPlainTextEdit* text_;
  QPixmap pixmap_;
  int asked_ = 0;
};

}  // namespace robomosp::viewer
