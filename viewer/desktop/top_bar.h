// SPDX-License-Identifier: GPL-3.0-or-later
// TopBar: the menus, the workspaces and the field for commands in one row. Where space is missing,
// the field shrinks to its icon, then the workspaces become one button with a menu, and at last the
// menus continue behind an arrow (layer: GUI).
#pragma once

#include <array>
#include <cstddef>
#include <functional>

#include <QWidget>

class QMenu;
class QMenuBar;
class QPushButton;
class QToolButton;

namespace robomosp::viewer {

/// [GUI thread]
class TopBar : public QWidget {
 public:
  /// Takes the menus; `spaces` is the menu of the workspaces.
  TopBar(QMenuBar& menus, QMenu& spaces, std::size_t workspace);

  std::function<void(std::size_t)> on_workspace;
  std::function<void()> on_find;
  /// Keys of the field for commands.
  void show_keys(const QString& keys);
  /// Marks a workspace as the present one.
  void show_workspace(std::size_t workspace);

  [[nodiscard]] QSize sizeHint() const override;
  [[nodiscard]] QSize minimumSizeHint() const override;

 protected:
  void resizeEvent(QResizeEvent* event) override;
  void changeEvent(QEvent* event) override;
  bool eventFilter(QObject* object, QEvent* event) override;

 private:
  class Find;
  void arrange();
  void apply_theme();

  QMenuBar& menus_;
  QWidget* spaces_;
  std::array<QToolButton*, 4> buttons_{};
  QToolButton* one_;  ///< in place of the four
  Find* find_;
  int themed_ = -1;
};

}  // namespace robomosp::viewer
