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

class QLabel;
class QLineEdit;
class QMenu;
class QToolButton;
class QTreeView;

namespace robomosp::viewer {

class RowFilter;

/// [GUI thread]
class Navigator : public QWidget {
 public:
  explicit Navigator(Desk& desk, QWidget* parent = nullptr);
  ~Navigator() override;

  /// Opens a record, recording or run in a tab; set by the window.
  std::function<void(const Handle&)> on_open;
  /// Gets a record of the library, "robot" and "puma560", and opens it.
  std::function<void(const std::string& kind, const std::string& name)> on_open_shipped;
  /// The eye of a member was clicked.
  std::function<void(const Selected&)> on_eye;
  /// Adds entries for the selected rows to the context menu.
  std::function<void(QMenu&)> on_menu;

  /// Edits the name of the selected row.
  void rename_selected();
  void focus_search();
  /// Keeps rows of these kinds; empty = of all.
  void show_kinds(const QStringList& kinds);
  /// Opens the row of the library with its kinds.
  void open_library();
  /// Says below the tree why a record was not deleted, with links to the records that use it.
  void show_users(const Handle& record, const Error& refusal);
  /// Opens the row of a record once it is there.
  void open_parts_of(const Handle& record);
  /// Draws the eyes of members again.
  void refresh_eyes();
  /// The row of what the mouse is over in a picture, in the tree; invalid = none.
  [[nodiscard]] QModelIndex hovered_row() const;
  [[nodiscard]] NavigatorModel& model() const { return *model_; }
  [[nodiscard]] QTreeView& tree() const { return *tree_; }

 protected:
  void changeEvent(QEvent* event) override;
  void showEvent(QShowEvent* event) override;

 private:
  void show_selection();
  void show_hovered(bool is_elsewhere);
  void search(const QString& text);
  /// Opens all rows that a filter keeps, and after the last filter those that were open before.
  void change_filter(const std::function<void()>& change);
  void keep_open_rows(const QModelIndex& parent);
  void open_row(const QModelIndex& index);
  void apply_theme();
  void make_kinds_menu();
  void show_all_kinds();
  void ask_memory();

  Desk& desk_;
  NavigatorModel* model_;
  RowFilter* filter_;
  QLineEdit* search_;
  QTreeView* tree_;
  QToolButton* kinds_;
  QLabel* users_;
  QLabel* memory_;
  QTimer search_timer_, memory_timer_;
  std::optional<Handle> to_open_;
  QList<QPersistentModelIndex> open_before_;  ///< of the model, before a filter
  bool is_selecting_ = false, is_revealing_ = false;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
