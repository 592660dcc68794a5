// SPDX-License-Identifier: GPL-3.0-or-later
// ResultView: the result of a command as plot, table, picture or value (layer: GUI).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <QWidget>

#include "ioci/client/client.h"
#include "kernel/value.h"
#include "viewer/forms/result_table.h"

class QLabel;
class QPlainTextEdit;
class QPushButton;
class QStackedWidget;
class QTableView;

namespace robomosp::viewer {

class ChoiceField;
class PlotView;
struct PlotData;
struct ResultPicture;

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
  bool eventFilter(QObject* object, QEvent* event) override;
  void resizeEvent(QResizeEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  void set_plot(std::shared_ptr<const PlotData> data);
  void show_units();
  void set_modes(std::vector<std::string> modes);
  void show_table(ResultTable table);
  void show_recording(const Handle& recording);
  bool show_picture(const ResultPicture& picture);
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
