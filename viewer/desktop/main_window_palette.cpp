// SPDX-License-Identifier: GPL-3.0-or-later
// The command palette above the views, or in a dock.
#include <QDockWidget>

#include "viewer/desktop/main_window.h"
#include "viewer/desktop/values.h"
#include "viewer/forms/command_palette.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {

void MainWindow::set_up_palette_dock() {
  // Empty until the palette is put into it.
  auto* empty = new QWidget;
  empty->setObjectName("palette_place");
  empty->setAccessibleName("Place of the command palette");
  QDockWidget* dock = add_dock("palette", "Commands", "search", empty, Qt::RightDockWidgetArea);
  dock->hide();
  connect(dock, &QDockWidget::visibilityChanged, this, [this](bool is_visible) {
    if (is_visible && !palette_->is_docked()) dock_palette(true);
  });
  palette_->on_dock = [this](bool on) { dock_palette(on); };
  palette_->on_open = [this] {
    leave_whole_start();
    docks_["palette"]->show();
    docks_["palette"]->raise();
  };
  std::vector<std::string> recent;
  for (const QString& name : settings_.recent_commands()) recent.push_back(utf8(name));
  palette_->set_recent(std::move(recent));
  palette_->on_recent = [this] {
    QStringList names;
    for (const std::string& name : palette_->recent()) names << shown(name);
    settings_.set_recent_commands(names);
  };
}

void MainWindow::dock_palette(bool on) {
  if (on == palette_->is_docked()) return;
  QDockWidget* dock = docks_["palette"];
  palette_->set_docked(on);
  if (on) {
    leave_whole_start();
    palette_->setMinimumWidth(theme().px(300));
    QWidget* before = dock->widget();
    dock->setWidget(palette_);
    if (before && before != palette_) before->deleteLater();
    // Beside the properties, where it has the whole height.
    QDockWidget* properties = docks_["properties"];
    if (!dock->isFloating() && dockWidgetArea(dock) == dockWidgetArea(properties))
      tabifyDockWidget(properties, dock);
    dock->show();
    dock->raise();
    palette_->show();
  } else {
    palette_->setMinimumWidth(0);
    palette_->setParent(this);
    dock->hide();
    palette_->open();
  }
}

}  // namespace robomosp::viewer
