// SPDX-License-Identifier: GPL-3.0-or-later
// Navigator: the panel with the tree of all records, recordings, runs and the library, with search
// (layer: GUI).
#pragma once

#include <functional>
#include <optional>

#include <QTimer>
#include <QWidget>

#include "viewer/desktop/navigator_model.h"
#include "viewer/theme/theme.h"

class QLineEdit;
class QMenu;
class QSortFilterProxyModel;
class QTreeView;

namespace robomosp::viewer {

/// [GUI thread]
class Navigator : public QWidget {
 public:
  explicit Navigator(Desk& desk, QWidget* parent = nullptr);
  ~Navigator() override;

  /// Opens a record, recording or run in a tab; set by the window.
  std::function<void(const Handle&)> on_open;
  /// Gets a record of the library, "robot" and "puma560", and opens it.
  std::function<void(const std::string& kind, const std::string& name)> on_open_shipped;
  /// Adds entries for the selected rows to the context menu.
  std::function<void(QMenu&)> on_menu;

  /// Edits the name of the selected row.
  void rename_selected();
  void focus_search();
  /// Opens the row of a record once it is there.
  void open_parts_of(const Handle& record);
  [[nodiscard]] NavigatorModel& model() const { return *model_; }
  [[nodiscard]] QTreeView& tree() const { return *tree_; }

 protected:
  void changeEvent(QEvent* event) override;

 private:
  void show_selection();
  void search(const QString& text);
  void open_row(const QModelIndex& index);
  void apply_theme();

  Desk& desk_;
  NavigatorModel* model_;
  QSortFilterProxyModel* filter_;
  QLineEdit* search_;
  QTreeView* tree_;
  QTimer search_timer_;
  std::optional<Handle> to_open_;
  bool is_selecting_ = false, is_revealing_ = false;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
