// SPDX-License-Identifier: GPL-3.0-or-later
// Panels of the window that are opened when they are needed: help, connections, shortcuts.
#include <algorithm>
#include <utility>

#include <QApplication>
#include <QCursor>
#include <QDockWidget>
#include <QHBoxLayout>
#include <QLabel>
#include <QLayout>
#include <QPushButton>
#include <QTabBar>
#include <QTabWidget>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/desktop/connections.h"
#include "viewer/desktop/console.h"
#include "viewer/desktop/help_panel.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/note_bar.h"
#include "viewer/desktop/shortcuts.h"
#include "viewer/desktop/stories.h"
#include "viewer/desktop/story_panel.h"
#include "viewer/desktop/values.h"
#include "viewer/forms/command_form.h"
#include "viewer/forms/command_palette.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"

namespace robomosp::viewer {
namespace {

/// Panels that no workspace shows by itself.
constexpr const char* kRooms[] = {"help", "story", "connections", "shortcuts"};

/// The chapter about a kind of record.
QString page_of_kind(const std::string& kind) {
  return kind == "robot"        ? "user/mechanisms.md"
         : kind == "solid"      ? "user/solids.md"
         : kind == "material"   ? "user/solids.md"
         : kind == "trajectory" ? "user/trajectories.md"
         : kind == "task"       ? "user/tasks.md"
         : kind == "program"    ? "user/irl/language.md"
         : kind == "controller" ? "user/irl/posts.md"
         : kind == "recording"  ? "user/recordings.md"
         : kind == "run"        ? "user/live_runs.md"
         : kind == "world"      ? "user/simulation.md"
                                : "user/desktop.md";
}

}  // namespace

void MainWindow::make_rooms() {
  help_ = new HelpPanel(desk_);
  help_->on_run = [this](const QString& lua) {
    show_panel("console");
    console_->run(lua);
  };
  add_dock("help", "Help", "info", help_, Qt::RightDockWidgetArea);
  story_ = new StoryProgress(desk_, settings_, this);
  auto* steps = new StoryPanel(*story_);
  steps->on_show_me = [this](const std::vector<std::string>& lines) {
    show_panel("console");
    for (const std::string& line : lines) console_->run(shown(line));
  };
  steps->on_page = [this](const QString& page) { show_page(page); };
  steps->on_again = [this](const Story& story) { begin_story(story, true); };
  steps->on_leave = [this] {
    story_->leave();
    docks_["story"]->hide();
  };
  add_dock("story", "Story", "pin", steps, Qt::RightDockWidgetArea);
  connections_ = new ConnectionsPanel(desk_);
  add_dock("connections", "Connections", "server", connections_, Qt::BottomDockWidgetArea);
  shortcuts_ = std::make_unique<Shortcuts>(actions_, settings_);
  shortcuts_panel_ = new ShortcutsPanel(desk_, *shortcuts_);
  add_dock("shortcuts", "Shortcuts", "keyboard", shortcuts_panel_, Qt::BottomDockWidgetArea);
}

void MainWindow::finish_rooms() {
  // A dock without an area would be shown above all others: give it one first.
  for (const auto& [name, dock] : docks_)
    connect(dock->toggleViewAction(), &QAction::triggered, this, [this, n = name](bool on) {
      if (on) show_panel(n);
    });
  shortcuts_->load();
  shortcuts_panel_->fill();
  shortcuts_->changed.add(this, [this] { show_keys_in_palette(); });
  connections_->changed.add(this, [this] { show_server_state(); });
  show_server_state();
}

void MainWindow::arrange_rooms() {
  for (const char* name : kRooms) {
    QDockWidget* dock = docks_[name];
    dock->setFloating(false);
    removeDockWidget(dock);
  }
}

void MainWindow::restore_layout(const QByteArray& state) {
  const QSize before = size();
  restoreState(state);
  // It shows docks that it does not know, for which the window may have grown.
  arrange_rooms();
  if (layout()) layout()->activate();
  resize(before);
}

void MainWindow::enter_whole_start() {
  if (!options_.has_whole_start || is_whole_start_ || tabs_->count() != 1) return;
  for (const char* name : kRooms)
    if (docks_[name]->isVisible()) return;
  if (isVisible()) {
    layout_timer_.stop();
    save_layout();
  }
  is_whole_start_ = true;
  is_arranging_ = true;
  for (const auto& [name, dock] : docks_) dock->hide();
  is_arranging_ = false;
  tabs_->tabBar()->hide();
}

void MainWindow::leave_whole_start() {
  if (!std::exchange(is_whole_start_, false)) return;
  tabs_->tabBar()->show();
  setUpdatesEnabled(false);
  arrange_as_kept();
  setUpdatesEnabled(true);
}

void MainWindow::arrange_as_kept() {
  arrange(workspace_);
  const QString name = kWorkspaceNames[static_cast<std::size_t>(workspace_)];
  if (const QByteArray state = settings_.layout(name); !state.isEmpty()) {
    is_arranging_ = true;
    restore_layout(state);
    is_arranging_ = false;
  }
}

QWidget* MainWindow::make_empty() {
  empty_ = new QWidget;
  empty_->setObjectName("empty");
  empty_->setAccessibleName("Nothing is open");
  empty_->setProperty("ground", "window");
  empty_->setAttribute(Qt::WA_StyledBackground);
  auto* column = new QVBoxLayout(empty_);
  auto* text = new QLabel("Nothing is open. Double-click a row of the navigator, or");
  text->setObjectName("empty_text");
  text->setAccessibleName(text->text());
  text->setToolTip("Worlds, robots, objects and solids open in tabs");
  text->setAlignment(Qt::AlignCenter);
  text->setWordWrap(true);
  text->setProperty("dim", true);
  auto* start = new QPushButton("Show the start page");
  start->setObjectName("empty_start");
  start->setAccessibleName("Show the start page");
  start->setToolTip("Worlds, recent files and stories (Alt+Home)\nwindow.open{panel = \"start\"}");
  connect(start, &QPushButton::clicked, this, [this] { show_start(); });
  column->addStretch(1);
  column->addWidget(text);
  column->addWidget(start, 0, Qt::AlignCenter);
  column->addStretch(1);
  empty_->hide();
  return empty_;
}

void MainWindow::show_empty() {
  const bool is_empty = tabs_->count() == 0;
  tabs_->setVisible(!is_empty);
  empty_->setVisible(is_empty);
}

bool MainWindow::place_room(QDockWidget& dock, const QString& name) {
  if (std::none_of(std::begin(kRooms), std::end(kRooms),
                   [&](const char* room) { return name == QLatin1String(room); }))
    return false;
  const auto is_placed = [this](const QString& other) {
    const QDockWidget* d = docks_[other];
    return dockWidgetArea(const_cast<QDockWidget*>(d)) != Qt::NoDockWidgetArea &&
           !d->isFloating() && d->isVisible();
  };
  const bool is_low = name != "help" && name != "story";
  addDockWidget(is_low ? Qt::BottomDockWidgetArea : Qt::RightDockWidgetArea, &dock);
  // Beside what is there as a tab: room in the middle is worth more.
  const QStringList others =
      is_low ? QStringList{"timeline", "console"} : QStringList{"properties", "help", "story"};
  for (const QString& other : others)
    if (other != name && is_placed(other)) {
      tabifyDockWidget(docks_[other], &dock);
      break;
    }
  return true;
}

void MainWindow::show_page(const QString& page) {
  palette_->hide();
  show_panel("help");
  help_->open(page);
  desk_.echo("window.open{panel = \"help\", page = \"" + utf8(page) + "\"}");
}

void MainWindow::begin_story(const Story& story, bool anew) {
  const auto begin = [this, &story, anew] {
    story_->begin(story, anew);
    show_panel("story");
  };
  if (story.world.empty()) {
    begin();
    if (ViewTab* view = current_view()) view->setFocus();
    return;
  }
  ioci::OpenRequest request;
  request.what = story.world;
  request.simulates = false;
  open(std::move(request), false, [begin](ViewTab&) { begin(); });
}

void MainWindow::show_help_here() {
  if (palette_->isVisible() && palette_->has_form())
    return show_page("command:" + shown(palette_->form()->command()));
  const QWidget* at = QApplication::widgetAt(QCursor::pos());
  if (!at || at->window() != this) at = focusWidget();
  QString page = help_page_of(at);
  bool is_in_properties = false;
  for (const QWidget* w = at; w; w = w->parentWidget())
    is_in_properties = is_in_properties || w->objectName() == "properties";
  if (is_in_properties && !page.startsWith("command:") && !desk_.selection().empty())
    page = page_of_kind(desk_.selection().front().record.kind);
  show_page(page);
}

void MainWindow::make_notice() {
  notice_ = new NoteBar("notice", "What could not be opened", "Why it could not be opened");
  connect(&notice_->add_button("notice_messages", "Messages",
                               "Show it in the messages\nwindow.open{panel = \"messages\"}"),
          &QPushButton::clicked, this, [this] { show_panel("messages"); });
  connect(&notice_->add_button("notice_close", "Close", "Close this note"), &QPushButton::clicked,
          notice_, &QWidget::hide);
}

void MainWindow::show_notice(const QString& what, const Error& why) {
  if (why.code == ErrorCode::cancelled) return;
  notice_->text().setText(
      QString("<b>%1 was not opened.</b> %2 Nothing else was changed.")
          .arg(what.section('/', -1).toHtmlEscaped(), shown(why.sentence()).toHtmlEscaped()));
  notice_->show();
}

void MainWindow::show_server_state() {
  if (!status_server_) return;
  status_server_->setText(connections_->summary());
  status_server_->setAccessibleName("Server: " + connections_->summary());
}

Result<void> MainWindow::set_keys(const std::string& action, const std::optional<QString>& keys) {
  if (action.empty()) {
    shortcuts_->reset_all();
    return {};
  }
  if (!keys) return shortcuts_->reset(action);
  const QKeySequence wanted(*keys, QKeySequence::PortableText);
  if (!keys->isEmpty() && (wanted.isEmpty() || wanted.toString().isEmpty()))
    return error(ErrorCode::invalid_argument, "\"" + utf8(*keys) + "\" are no keys",
                 "Write them as \"Ctrl+Shift+K\".", "keys");
  return shortcuts_->set(action, wanted);
}

}  // namespace robomosp::viewer
