// SPDX-License-Identifier: GPL-3.0-or-later
// ShortcutsPanel: all entries of the menus with their keys, which can be changed here (layer: GUI).
#pragma once

#include <string>
#include <vector>

#include <QKeySequence>
#include <QWidget>

#include <robomosp/sdk/result.h>

#include "viewer/desktop/desk.h"
#include "viewer/theme/theme.h"

class QAction;
class QKeySequenceEdit;
class QLabel;
class QLineEdit;
class QPushButton;
class QTreeWidget;
class QTreeWidgetItem;

namespace robomosp::viewer {

class Actions;
class Settings;

/// Sets the keys of entries and keeps them. [GUI thread]
class Shortcuts {
 public:
  /// Both outlive it.
  Shortcuts(const Actions& actions, Settings& settings);
  /// Applies the keys that are kept. Those of entries that no longer exist are ignored.
  void load();
  /// Sets and keeps the keys of an entry; empty = none. Fails if the name is unknown or another
  /// entry has the keys.
  Result<void> set(const std::string& action, const QKeySequence& keys);
  /// Back to the keys that the program gives the entry. Fails as set() does.
  Result<void> reset(const std::string& action);
  void reset_all();
  /// The entry that has the keys, or begins with them; null = none.
  [[nodiscard]] QAction* holder(const QKeySequence& keys, const QAction* except) const;
  [[nodiscard]] const Actions& actions() const { return actions_; }

  Listeners<> changed;

 private:
  const Actions& actions_;
  Settings& settings_;
};

/// [GUI thread]
class ShortcutsPanel : public QWidget {
 public:
  ShortcutsPanel(Desk& desk, Shortcuts& shortcuts, QWidget* parent = nullptr);
  /// Lists the entries; called once all are made.
  void fill();

 protected:
  void changeEvent(QEvent* event) override;

 private:
  [[nodiscard]] QAction* chosen() const;
  void show_chosen();
  void show_rows();
  void filter(const QString& words);
  void apply(const QKeySequence& keys);

  Desk& desk_;
  Shortcuts& shortcuts_;
  QTreeWidget* list_;
  QLineEdit* search_;
  QLabel *name_, *note_;
  QKeySequenceEdit* keys_;
  QPushButton *set_, *clear_, *reset_, *take_;
  int themed_ = theme_revision();  ///< the theme that it shows
};

}  // namespace robomosp::viewer
