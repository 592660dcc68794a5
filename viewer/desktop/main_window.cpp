// SPDX-License-Identifier: GPL-3.0-or-later
// The frame of the window: docks, workspaces, tabs, status bar, guard of unsaved work.
#include "viewer/desktop/main_window.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <QApplication>
#include <QCloseEvent>
#include <QDockWidget>
#include <QEvent>
#include <QFileInfo>
#include <QHBoxLayout>
#include <QLabel>
#include <QMenu>
#include <QMenuBar>
#include <QProgressBar>
#include <QPushButton>
#include <QScreen>
#include <QSignalBlocker>
#include <QStatusBar>
#include <QTabBar>
#include <QTabWidget>
#include <QToolButton>
#include <QVBoxLayout>

#include "viewer/desktop/automation.h"
#include "viewer/desktop/console.h"
#include "viewer/desktop/dragging.h"
#include "viewer/desktop/jobs.h"
#include "viewer/desktop/messages.h"
#include "viewer/desktop/navigator.h"
#include "viewer/desktop/note_bar.h"
#include "viewer/desktop/pose_sources.h"
#include "viewer/desktop/shortcuts.h"
#include "viewer/desktop/start_page.h"
#include "viewer/desktop/status_line.h"
#include "viewer/desktop/thumbnails.h"
#include "viewer/desktop/top_bar.h"
#include "viewer/desktop/values.h"
#include "viewer/forms/command_form.h"
#include "viewer/forms/command_palette.h"
#include "viewer/forms/properties_panel.h"
#include "viewer/forms/result_view.h"
#include "viewer/gizmo/picking.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/timeline/timeline.h"

namespace robomosp::viewer {
namespace {

constexpr double kCloseIcon = 12;  ///< [px of the design]
constexpr int kUndoAfterMs = 40;
constexpr qsizetype kLongestTitle = 32;  ///< of the tab of a result [characters]
constexpr int kSaveLayoutAfterMs = 800;
/// How long closing waits for the list of unsaved records.
constexpr int kAnswerMs = 400;

/// The head of a dock: its title, and a button that hides it.
class DockHead : public QWidget {
 public:
  DockHead(QDockWidget& dock, const char* icon_name) : icon_(icon_name) {
    setObjectName(dock.objectName() + "_head");
    setAccessibleName(dock.windowTitle());
    setToolTip(QString());
    setAttribute(Qt::WA_StyledBackground);
    setProperty("ground", "header");
    auto* across = new QHBoxLayout(this);
    across->setContentsMargins(8, 0, 2, 0);
    mark_ = new QLabel;
    mark_->setObjectName(dock.objectName() + "_mark");
    mark_->setAccessibleName("Icon");
    mark_->setToolTip(dock.windowTitle());
    title_ = new QLabel(dock.windowTitle());
    title_->setObjectName(dock.objectName() + "_title");
    title_->setAccessibleName(dock.windowTitle());
    title_->setToolTip(dock.windowTitle() + "; drag it to move the panel");
    auto* hide = new QToolButton;
    hide->setObjectName(dock.objectName() + "_hide");
    hide->setAccessibleName("Hide " + dock.windowTitle());
    hide->setToolTip("Hide the panel; the menu View shows it again");
    hide->setIcon(icon("close"));
    hide->setFocusPolicy(Qt::TabFocus);
    connect(hide, &QToolButton::clicked, &dock, &QDockWidget::close);
    across->addWidget(mark_);
    across->addWidget(title_);
    across->addStretch(1);
    across->addWidget(hide);
    apply_theme();
  }
  [[nodiscard]] QSize sizeHint() const override { return {100, theme().dock_head}; }
  [[nodiscard]] QSize minimumSizeHint() const override { return {40, theme().dock_head}; }

 protected:
  void changeEvent(QEvent* event) override {
    if (std::exchange(themed_, theme_revision()) != theme_revision()) apply_theme();
    QWidget::changeEvent(event);
  }

 private:
  void apply_theme() {
    const Theme& t = theme();
    mark_->setPixmap(icon_pixmap(icon_, t.text_dim, t.icon, devicePixelRatioF()));
    use_font(*title_, &Theme::ui, true);
  }
  const char* icon_;
  QLabel *mark_, *title_;
  int themed_ = theme_revision();
};

/// In place of the head of a dock, when its title is in its tab.
class NoHead : public QWidget {
 public:
  explicit NoHead(QDockWidget& dock) {
    setObjectName(dock.objectName() + "_no_head");
    setAccessibleName("No head");
    setToolTip(QString());
    setFixedHeight(0);
  }
};

/// A result of the console in a tab.
class ResultTab : public ResultView {
 public:
  ResultTab(ioci::Client& client, Value shown_result)
      : ResultView(client), result(std::move(shown_result)) {
    setObjectName("result_tab");
    setProperty("ground", "panel");
    setAttribute(Qt::WA_StyledBackground);
    show_result(result);
  }
  const Value result;
};

QLabel* status_label(const char* name, const char* accessible, const char* tip) {
  auto* label = new ShortLabel;
  label->setObjectName(name);
  label->setAccessibleName(accessible);
  label->setToolTip(tip);
  return label;
}

}  // namespace

MainWindow::MainWindow(Desk& desk, Options options)
    : desk_(desk), options_(std::move(options)), settings_(options_.settings_file), actions_(this) {
  setObjectName("main_window");
  setAccessibleName("ROBOMOSP");
  setDockOptions(AllowTabbedDocks | AllowNestedDocks);
  setTabPosition(Qt::AllDockWidgetAreas, QTabWidget::North);
  setCorner(Qt::BottomLeftCorner, Qt::BottomDockWidgetArea);
  setCorner(Qt::BottomRightCorner, Qt::RightDockWidgetArea);
  resize(QSize(1440, 900).boundedTo(screen()->availableSize()));

  auto* centre = new QWidget;
  centre->setObjectName("centre");
  centre->setAccessibleName("Centre");
  auto* column = new QVBoxLayout(centre);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(0);
  tabs_ = new QTabWidget;
  tabs_->setObjectName("tabs");
  tabs_->setAccessibleName("Views");
  tabs_->setDocumentMode(true);
  tabs_->setMovable(true);
  tabs_->tabBar()->setObjectName("tab_bar");
  tabs_->tabBar()->setAccessibleName("Tabs of views");
  tabs_->tabBar()->setExpanding(false);
  tabs_->tabBar()->setToolTip("Records, results and the start page; drag a tab to move it");
  connect(tabs_, &QTabWidget::currentChanged, this, [this] { show_tab_state(); });
  make_guard();
  make_notice();
  column->addWidget(guard_);
  column->addWidget(notice_);
  column->addWidget(tabs_, 1);
  column->addWidget(make_empty(), 1);
  setCentralWidget(centre);
  actions_.echo = [this](const std::string& line) { desk_.echo(line); };

  make_docks();
  make_actions();
  set_least_widths();
  make_top_bar();
  make_status_bar();
  set_up_palette();
  finish_rooms();
  use_font(*menu_bar_, &Theme::menu);
  for (QMenu* menu : findChildren<QMenu*>()) use_font(*menu, &Theme::menu);
  navigator_->model().loaded.add(this, [this] { show_selection(); });
  navigator_->on_menu = [this](QMenu& menu) { fill_context_menu(menu); };
  navigator_->model().eye_of = [this](const Selected& part) {
    const ViewTab* view = current_view();
    if (!view || view->what() != part.record || !view->has_member(part.path))
      return NavigatorModel::Eye::none;
    return view->hidden().contains(part.path) ? NavigatorModel::Eye::hidden
                                              : NavigatorModel::Eye::shown;
  };
  navigator_->on_eye = [this](const Selected& part) {
    if (ViewTab* view = current_view())
      view->show_member(part.path, view->hidden().contains(part.path));
  };
  navigator_->on_open = [this](const Handle& h) { open_handle(h); };
  navigator_->on_open_shipped = [this](const std::string& kind, const std::string& name) {
    desk_.act(kind + ".get", {{"name", name}}, [this](const Result<Value>& r) {
      if (!r.ok()) return desk_.failed(r.error());
      if (const Handle* h = r->as_handle()) open_handle(*h);
    });
  };

  undo_timer_.setSingleShot(true);
  undo_timer_.setInterval(kUndoAfterMs);
  connect(&undo_timer_, &QTimer::timeout, this, [this] { ask_undo_label(); });
  heads_timer_.setSingleShot(true);
  heads_timer_.setInterval(0);
  connect(&heads_timer_, &QTimer::timeout, this, [this] { update_dock_heads(); });
  layout_timer_.setSingleShot(true);
  layout_timer_.setInterval(kSaveLayoutAfterMs);
  connect(&layout_timer_, &QTimer::timeout, this, [this] { save_layout(); });

  desk_.events.add(this, [this](const ioci::Event& e) { take(e); });
  desk_.unsaved_changed.add(this, [this] { show_unsaved(); });
  desk_.selection_changed.add(this, [this](const QObject*) {
    show_selection();
    properties_->set_selection(selected_paths(desk_.selection()));
    palette_->set_selection(selected_paths(desk_.selection()));
  });
  desk_.failed.add(
      this, [this](const Error& e) { statusBar()->showMessage(shown(e.sentence()), 15000); });
  jobs_->changed.add(this, [this] { show_jobs(); });

  if (const QByteArray geometry = settings_.geometry(); !geometry.isEmpty())
    restoreGeometry(geometry);
  const QString kept = settings_.workspace();
  for (std::size_t i = 0; i < 4; ++i)
    if (kept == kWorkspaceNames[i]) workspace_ = static_cast<Workspace>(i);
  arrange(workspace_);
  if (const QByteArray state = settings_.layout(kept); !state.isEmpty()) {
    restore_layout(state);
  }
  title_window();
  show_selection();
  show_jobs();
  ask_undo_label();
  if (settings_.value(kStartHidden) != "true") show_start();
  show_empty();
  automation_ = Automation::install(*this);
}

MainWindow::~MainWindow() {
  Automation::remove(*automation_, desk_.application());
  // Views use the client of the desk and leave first.
  for (ViewTab* view : views()) delete view;
}

// --- workspaces ------------------------------------------------------------------------------

QDockWidget* MainWindow::add_dock(const char* name, const QString& title, const char* icon_name,
                                  QWidget* content, Qt::DockWidgetArea area) {
  auto* dock = new QDockWidget(title, this);
  dock->setObjectName(QString(name) + "_dock");
  dock->setAccessibleName(title);
  dock->setToolTip(QString());
  dock->setWidget(content);
  dock->setProperty("icon", icon_name);
  dock->setProperty("head", QVariant::fromValue<QWidget*>(new DockHead(*dock, icon_name)));
  dock->setProperty("no_head", QVariant::fromValue<QWidget*>(new NoHead(*dock)));
  dock->setTitleBarWidget(dock->property("head").value<QWidget*>());
  for (const char* each : {"head", "no_head"})
    dock->property(each).value<QWidget*>()->setParent(dock);
  dock->property("no_head").value<QWidget*>()->hide();
  addDockWidget(area, dock);
  const auto note = [this] {
    heads_timer_.start();
    if (!is_arranging_) layout_timer_.start();
  };
  connect(dock, &QDockWidget::visibilityChanged, this, note);
  connect(dock, &QDockWidget::dockLocationChanged, this, note);
  connect(dock, &QDockWidget::topLevelChanged, this, note);
  docks_.emplace(name, dock);
  return dock;
}

void MainWindow::make_docks() {
  thumbnails_ = new Thumbnails(this);
  thumbnails_->failed.add(this, [this](const QString& why) {
    desk_.application().messages.post(Severity::info, "thumbnails", utf8(why), "desktop");
  });
  navigator_ = new Navigator(desk_);
  navigator_->model().set_thumbnails(thumbnails_);
  console_ = new Console(desk_, settings_);
  console_->output().on_open = [this](const QString& title, const Value& result) {
    open_result(title, result);
  };
  messages_ = new MessagesPanel(desk_);
  jobs_ = new JobsPanel(desk_);
  add_dock("navigator", "Navigator", "list", navigator_, Qt::LeftDockWidgetArea);
  properties_ = new PropertiesPanel(desk_.client());
  add_dock("properties", "Properties", "rename", properties_, Qt::RightDockWidgetArea);
  palette_ = new CommandPalette(desk_.client(), this);
  add_dock("console", "Console", "console", console_, Qt::BottomDockWidgetArea);
  add_dock("messages", "Messages", "messages", messages_, Qt::BottomDockWidgetArea);
  add_dock("jobs", "Jobs", "jobs", jobs_, Qt::BottomDockWidgetArea);
  make_rooms();
  messages_->unseen_changed.add(this, [this] {
    const int count = messages_->unseen();
    docks_["messages"]->setWindowTitle(count > 0 ? QString("Messages %1").arg(count)
                                                 : QString("Messages"));
    heads_timer_.start();
  });
}

void MainWindow::set_least_widths() {
  // Their rows adapt to narrow panels. With a zoomed interface these widths stay, so that the
  // window still fits small screens.
  const auto least = [](double design, int most) { return std::min(theme().px(design), most); };
  for (const auto& [name, dock] : docks_) {
    QWidget* panel = dock->widget();
    if (!panel) continue;  // of the command palette while it is not docked
    const bool is_right = name == "properties" || name == "help" || name == "story";
    panel->setMinimumWidth(name == "timeline" ? least(300, 320)
                           : is_right         ? least(240, std::max(250, theme().px(145)))
                                              : least(160, 170));
  }
}

void MainWindow::arrange(Workspace workspace) {
  is_arranging_ = true;
  QDockWidget *navigator = docks_["navigator"], *console = docks_["console"],
              *messages = docks_["messages"], *jobs = docks_["jobs"],
              *timeline = docks_["timeline"];
  for (QDockWidget* dock : {navigator, timeline, console, messages, jobs}) {
    dock->setFloating(false);
    removeDockWidget(dock);
  }
  arrange_rooms();
  addDockWidget(Qt::LeftDockWidgetArea, navigator);
  navigator->show();
  QDockWidget* properties = docks_["properties"];
  properties->setFloating(false);
  removeDockWidget(properties);
  addDockWidget(Qt::RightDockWidgetArea, properties);
  properties->setVisible(workspace != Workspace::program);
  const bool has_timeline = workspace == Workspace::motion;
  if (has_timeline) {
    addDockWidget(Qt::BottomDockWidgetArea, timeline);
    timeline->show();
    splitDockWidget(timeline, console, Qt::Horizontal);
  } else {
    addDockWidget(Qt::BottomDockWidgetArea, console);
  }
  console->show();
  tabifyDockWidget(console, messages);
  tabifyDockWidget(messages, jobs);
  messages->show();
  jobs->show();
  if (workspace == Workspace::program) messages->raise();
  else console->raise();
  // Widths and heights of the design, and less where the window is small.
  const Theme& t = theme();
  const auto at_most = [](double share, int of, int wanted) {
    return std::min(static_cast<int>(share * of), wanted);
  };
  const int left = at_most(0.21, width(), t.px(workspace == Workspace::model ? 320 : 288));
  const int right = at_most(0.25, width(), t.px(344));
  resizeDocks({navigator, properties}, {left, right}, Qt::Horizontal);
  if (has_timeline) {
    const int low = std::max(at_most(0.28, height(), t.px(336)), at_most(0.4, height(), t.px(200)));
    const int across = width() - (properties->isHidden() ? 0 : right);
    const int script = at_most(0.36, across, t.px(464));
    resizeDocks({timeline, console}, {low, low}, Qt::Vertical);
    resizeDocks({timeline, console}, {across - script, script}, Qt::Horizontal);
  } else {
    resizeDocks({console}, {at_most(0.3, height(), t.px(236))}, Qt::Vertical);
  }
  is_arranging_ = false;
  heads_timer_.start();
  if (palette_ && palette_->isVisible()) palette_->raise();  // docks that are shown come on top
}

void MainWindow::update_dock_heads() {
  for (const auto& [name, dock] : docks_) {
    const bool is_tab = !dock->isFloating() && !tabifiedDockWidgets(dock).isEmpty();
    QWidget* wanted = dock->property(is_tab ? "no_head" : "head").value<QWidget*>();
    if (dock->titleBarWidget() == wanted) continue;
    dock->titleBarWidget()->hide();
    dock->setTitleBarWidget(wanted);
    wanted->show();
  }
  for (QTabBar* bar : findChildren<QTabBar*>(QString(), Qt::FindDirectChildrenOnly)) {
    bar->setObjectName("dock_tabs");
    bar->setAccessibleName("Tabs of panels");
    bar->setToolTip("Panels at the same place");
    bar->setExpanding(false);
    bar->setDrawBase(false);
    bar->setIconSize(QSize(theme().icon, theme().icon));
    for (int i = 0; i < bar->count(); ++i)
      for (const auto& [name, dock] : docks_)
        if (bar->tabText(i) == dock->windowTitle())
          bar->setTabIcon(i, icon(dock->property("icon").toString().toStdString()));
  }
}

void MainWindow::save_layout() {
  if (is_closing_ || is_whole_start_) return;
  settings_.set_layout(kWorkspaceNames[static_cast<std::size_t>(workspace_)], saveState());
}

void MainWindow::set_workspace(Workspace workspace) {
  leave_whole_start();
  if (workspace == workspace_) {
    top_bar_->show_workspace(static_cast<std::size_t>(workspace));
    return;
  }
  layout_timer_.stop();
  save_layout();
  workspace_ = workspace;
  const QString name = kWorkspaceNames[static_cast<std::size_t>(workspace)];
  settings_.set_workspace(name);
  setUpdatesEnabled(false);
  arrange_as_kept();
  if (palette_->isVisible()) palette_->raise();
  setUpdatesEnabled(true);
  top_bar_->show_workspace(static_cast<std::size_t>(workspace));
  for (std::size_t i = 0; i < 4; ++i)
    actions_.check(std::string("workspace_") + kWorkspaceNames[i],
                   i == static_cast<std::size_t>(workspace));
  desk_.echo("window.set{workspace = \"" + utf8(name) + "\"}");
}

void MainWindow::reset_layout() {
  leave_whole_start();
  settings_.forget_layouts();
  arrange(workspace_);
}

QStringList MainWindow::panels() const {
  QStringList out;
  for (const auto& [name, dock] : docks_) out += name;
  out += "start";
  return out;
}

void MainWindow::show_panel(const QString& name) {
  if (name == "start") return show_start();
  const auto at = docks_.find(name);
  if (at == docks_.end()) return;
  leave_whole_start();
  const bool has_area =
      dockWidgetArea(at->second) != Qt::NoDockWidgetArea || at->second->isFloating();
  if (!has_area && !place_room(*at->second, name))
    addDockWidget(name == "navigator"    ? Qt::LeftDockWidgetArea
                  : name == "properties" ? Qt::RightDockWidgetArea
                                         : Qt::BottomDockWidgetArea,
                  at->second);
  at->second->show();
  at->second->raise();
  if (QWidget* content = at->second->widget()) content->setFocus(Qt::ShortcutFocusReason);
}

void MainWindow::set_theme_and_zoom(bool is_dark, double zoom) {
  const Theme wanted = make_theme(is_dark, zoom, settings_.has_strong_borders());
  const bool is_same = wanted.is_dark == theme().is_dark && wanted.zoom == theme().zoom;
  if (is_same && wanted.has_strong_borders == theme().has_strong_borders) return;
  settings_.set_dark(wanted.is_dark);
  settings_.set_zoom(wanted.zoom);
  if (auto* application = qobject_cast<QApplication*>(QCoreApplication::instance()))
    set_theme(*application, wanted);
  if (is_same) return;  // the borders are an entry of a menu
  desk_.echo("window.set{theme = \"" + std::string(is_dark ? "dark" : "light") +
             "\", zoom = " + utf8(QString::number(wanted.zoom, 'g', 4)) + "}");
}

void MainWindow::changeEvent(QEvent* event) {
  QMainWindow::changeEvent(event);
  if (!status_units_ || std::exchange(themed_, theme_revision()) == theme_revision()) return;
  const Theme& t = theme();
  statusBar()->setFixedHeight(t.status);
  set_least_widths();
  tabs_->setIconSize(QSize(t.icon, t.icon));
  for (QToolButton* close : tabs_->tabBar()->findChildren<QToolButton*>("tab_close"))
    close->setIconSize(QSize(t.px(kCloseIcon), t.px(kCloseIcon)));
  heads_timer_.start();
  show_jobs();
}

// --- tabs ------------------------------------------------------------------------------------

void MainWindow::show_start() {
  if (!start_) {
    start_ = new StartPage(desk_, settings_, actions_, *thumbnails_);
    start_->on_world = [this](const QString& world) {
      ioci::OpenRequest request;
      request.what = utf8(world);
      open(std::move(request), true);
    };
    start_->on_shipped = navigator_->on_open_shipped;
    start_->on_file = [this](const QString& file) {
      ioci::OpenRequest request;
      request.what = utf8(file);
      request.simulates = false;
      open(std::move(request), false);
    };
    start_->on_restore = [this](const std::string& journal) {
      Map args;
      if (!journal.empty()) args.set("file", journal);
      desk_.act("recovery.restore", std::move(args));
      show_panel("navigator");
    };
    start_->on_page = [this](const QString& page) { show_page(page); };
    start_->on_story = [this](const Story& story, bool anew) { begin_story(story, anew); };
    start_->on_library = [this] {
      show_panel("navigator");
      navigator_->open_library();
    };
    add_tab(start_, "home", "Start", 0);
  }
  start_->show_ticks();
  tabs_->setCurrentWidget(start_);
  enter_whole_start();
  start_->take_focus(Qt::OtherFocusReason);
}

void MainWindow::add_tab(QWidget* page, const char* icon_name, const QString& title, int at) {
  const int i = tabs_->insertTab(at, page, icon(icon_name), title);
  auto* close = new QToolButton;
  close->setObjectName("tab_close");
  close->setAccessibleName("Close the tab");
  close->setToolTip("Close the tab (Ctrl+W)");
  close->setIcon(icon("close"));
  close->setIconSize(QSize(theme().px(kCloseIcon), theme().px(kCloseIcon)));
  close->setFocusPolicy(Qt::NoFocus);
  connect(close, &QToolButton::clicked, this, [this, page] { close_tab(tabs_->indexOf(page)); });
  tabs_->tabBar()->setTabButton(i, QTabBar::RightSide, close);
  show_empty();
}

ViewTab* MainWindow::current_view() const { return dynamic_cast<ViewTab*>(tabs_->currentWidget()); }

std::vector<ViewTab*> MainWindow::views() const {
  std::vector<ViewTab*> out;
  for (int i = 0; i < tabs_->count(); ++i)
    if (auto* view = dynamic_cast<ViewTab*>(tabs_->widget(i))) out.push_back(view);
  return out;
}

ViewTab* MainWindow::open_view(const Handle& what, const QString& name) {
  for (ViewTab* view : views())
    if (view->what() == what) {
      tabs_->setCurrentWidget(view);
      return view;
    }
  auto made = ViewTab::create(desk_, actions_, options_.software_view);
  if (!made.ok()) {
    status_renderer_->setText("no OpenGL: no pictures");
    status_renderer_->setToolTip(shown(made.error().sentence()) +
                                 "\nrobomosp-desktop --graphics reports more");
    desk_.failed(made.error());
    return nullptr;
  }
  ViewTab* view = made->release();
  // Pictures without the window's OpenGL are slower: the reason is worth a place.
  status_renderer_->setText(view->display().drawing_method() == DrawingMethod::image
                                ? "pictures through EGL"
                                : QString());
  status_renderer_->setToolTip(view->display().renderer_name() +
                               "\nrobomosp-desktop --graphics reports more");
  add_tab(view, std::string(icon_of_kind(what.kind)).c_str(), name, tabs_->count());
  view->changed.add(this, [this, view] {
    title_tab(*view);
    if (view == current_view()) show_tab_state();
  });
  view->player().state_changed.add(this, [this, view] {
    if (view == current_view()) show_tab_state();
  });
  new DropTarget(desk_, *view);
  ViewLook look = view->look();
  look.is_refined_at_rest = settings_.has_fine_pictures();
  view->set_look(look);
  view->show_record(what, name);
  // The page that hides would pass its focus to a button of the bar.
  const bool had_focus = tabs_->isAncestorOf(focusWidget());
  tabs_->setCurrentWidget(view);
  if (had_focus) view->setFocus();
  return view;
}

void MainWindow::open(ioci::OpenRequest request, bool plays,
                      std::function<void(ViewTab& view)> opened) {
  request.simulates = request.simulates || plays;
  const std::string file = request.script.empty() ? request.what : request.script.string();
  statusBar()->showMessage("Opening " + shown(file));
  desk_.open_record(std::move(request),
                    [this, file, plays, opened = std::move(opened)](const Result<ioci::Opened>& r) {
                      statusBar()->clearMessage();
                      if (!r.ok()) return show_notice(shown(file), r.error());
                      notice_->hide();
                      std::error_code ignored;
                      if (std::filesystem::is_regular_file(file, ignored)) {
                        settings_.add_recent_file(QFileInfo(shown(file)).absoluteFilePath());
                        if (start_) start_->show_recent();
                      }
                      ViewTab* view = open_view(r->what, shown(r->name));
                      if (!view) return;
                      desk_.select({{r->what, {}}});
                      navigator_->open_parts_of(r->what);
                      if (r->recording) {
                        view->show_recording(*r->recording, r->from, r->to);
                        if (plays) view->player().play(true);
                      }
                      if (opened) opened(*view);
                    });
}

void MainWindow::with_moved(const Handle& subject, const std::string& by,
                            std::function<void(ViewTab&)> then) {
  desk_.ask("document.outline", {}, *this,
            [this, subject, by, then = std::move(then)](const Result<Value>& r) {
              if (!r.ok()) return desk_.failed(r.error());
              for (const Value& row : list_of(*r)) {
                if (handle_at(map_of(row), "id") != subject) continue;
                ViewTab* view = open_view(subject, shown(text_at(map_of(row), "name")));
                if (!view) return;  // which open_view() has said
                then(*view);
                return show_panel("timeline");
              }
              desk_.failed(error(ErrorCode::not_found,
                                 "the " + subject.kind + " that " + by + " moves was removed",
                                 "Undo its removal, or simulate again."));
            });
}

void MainWindow::open_recording(const Handle& recording) {
  desk_.ask("recording.list", {}, *this, [this, recording](const Result<Value>& r) {
    if (!r.ok()) return desk_.failed(r.error());
    const List& all = list_of(*r);
    const auto at = std::find_if(all.begin(), all.end(), [&](const Value& row) {
      return handle_at(map_of(row), "recording") == recording;
    });
    if (at == all.end())
      return desk_.failed(error(ErrorCode::stale_handle, "the recording no longer exists",
                                "recording.list lists those that exist."));
    const std::string robot = text_at(map_of(*at), "robot"),
                      by = "the recording \"" + text_at(map_of(*at), "title") + "\"";
    std::optional<Handle> subject = handle_at(map_of(*at), "subject");
    if (!subject && !robot.empty())
      return desk_.failed(error(ErrorCode::not_found,
                                "the robot \"" + robot + "\" that " + by + " moves is not open",
                                "Open it first."));
    if (!subject) {
      // A table of measurements moves nothing; it is plotted beside what is shown.
      const ViewTab* view = current_view();
      if (!view || (view->what().kind != "world" && view->what().kind != "robot"))
        return desk_.failed(error(ErrorCode::not_found, by + " moves no world or robot",
                                  "Open a world or robot to plot it beside."));
      subject = view->what();
    }
    desk_.ask("recording.values", {{"id", recording}, {"columns", "time"}}, *this,
              [this, recording, by, subject = *subject](const Result<Value>& values) {
                if (!values.ok()) return desk_.failed(values.error());
                const NumericArray* times = values->as_array();
                if (!times || times->size() == 0)
                  return desk_.failed(error(ErrorCode::not_found, by + " has no rows",
                                            "Simulate again, or append rows."));
                const double from = (*times)[0], to = (*times)[times->size() - 1];
                with_moved(subject, by, [recording, from, to](ViewTab& view) {
                  view.show_recording(recording, from, to);
                });
              });
  });
}

void MainWindow::open_run(const Handle& run) {
  desk_.ask("run.list", {}, *this, [this, run](const Result<Value>& r) {
    if (!r.ok()) return desk_.failed(r.error());
    for (const Value& row : list_of(*r))
      if (handle_at(map_of(row), "id") == run)
        if (const auto subject = handle_at(map_of(row), "subject"))
          return with_moved(*subject, "the run \"" + text_at(map_of(row), "title") + "\"",
                            [run](ViewTab& view) { view.show_run(run); });
    desk_.failed(error(ErrorCode::stale_handle, "the run no longer exists", "Start another one."));
  });
}

void MainWindow::open_handle(const Handle& handle) {
  if (handle.kind == "recording") return open_recording(handle);
  if (handle.kind == "run") return open_run(handle);
  static constexpr const char* kDrawn[] = {"world", "robot", "object", "solid", "material"};
  if (std::none_of(std::begin(kDrawn), std::end(kDrawn),
                   [&](const char* kind) { return handle.kind == kind; })) {
    desk_.select({{handle, {}}});
    show_panel("properties");
    return;
  }
  const auto rows = navigator_->model().rows_of({handle, {}});
  const QString name =
      rows.isEmpty() ? shown(handle.kind) : rows.front().data(Qt::DisplayRole).toString();
  open_view(handle, name);
  desk_.select({{handle, {}}});
}

void MainWindow::open_result(const QString& title, const Value& result) {
  for (int i = 0; i < tabs_->count(); ++i)
    if (auto* tab = dynamic_cast<ResultTab*>(tabs_->widget(i)); tab && tab->result == result)
      return tabs_->setCurrentIndex(i);
  auto* tab = new ResultTab(desk_.client(), result);
  tab->setAccessibleName("Result: " + title);
  add_tab(tab, "plot", title.size() > kLongestTitle ? title.left(kLongestTitle) + "..." : title,
          tabs_->count());
  tabs_->setTabToolTip(tabs_->count() - 1, title + ", a result of the console");
  tabs_->setCurrentWidget(tab);
}

void MainWindow::close_tab(int index) {
  QWidget* page = tabs_->widget(index);
  if (!page) return;
  if (dynamic_cast<ResultTab*>(page)) {
    tabs_->removeTab(index);
    delete page;
    if (tabs_->count() == 0) show_start();
    return;
  }
  if (page == start_) {
    tabs_->removeTab(index);
    start_->deleteLater();
    start_ = nullptr;
    leave_whole_start();
    return show_empty();
  }
  if (dynamic_cast<ViewTab*>(page) == nullptr) return;
  timeline_->set_player(nullptr);
  tabs_->removeTab(index);
  delete page;
  if (tabs_->count() == 0) show_start();
}

void MainWindow::show_tab_state() {
  if (tabs_->currentWidget() != start_ || tabs_->count() > 1) leave_whole_start();
  ViewTab* view = current_view();
  timeline_->set_player(view ? &view->player() : nullptr);
  timeline_->set_subject(view ? view->what() : Handle{}, view ? view->recording() : std::nullopt,
                         view ? view->run() : std::nullopt);
  title_window();
  enable_saving();
  show_hidden_count();
  navigator_->refresh_eyes();
  enable_live();
  for (const char* name : {"fit",
                           "fly_to_selection",
                           "view_isometric",
                           "view_front",
                           "view_back",
                           "view_left",
                           "view_right",
                           "view_top",
                           "view_bottom",
                           "perspective",
                           "style_smooth",
                           "style_flat",
                           "style_wireframe",
                           "style_hidden_line",
                           "show_edges",
                           "show_grid",
                           "show_axes",
                           "show_lights",
                           "refine",
                           "section_none",
                           "section_x",
                           "section_y",
                           "section_z",
                           "save_picture",
                           "close_tab"})
    actions_.enable(name, view != nullptr);
  actions_.enable("close_tab", tabs_->count() > 0);
  const ViewLook look = view ? view->look() : ViewLook();
  static constexpr const char* kStyles[] = {"style_smooth", "style_flat", "style_wireframe",
                                            "style_hidden_line"};
  for (std::size_t i = 0; i < 4; ++i)
    actions_.check(kStyles[i], static_cast<std::size_t>(look.style) == i);
  static constexpr const char* kSections[] = {"section_none", "section_x", "section_y",
                                              "section_z"};
  for (int i = 0; i < 4; ++i) actions_.check(kSections[i], look.section_axis == i - 1);
  for (const char* name : {"section_turn", "section_forward", "section_back"})
    actions_.enable(name, view && look.section_axis >= 0);
  actions_.check("section_turn", look.is_section_turned);
  actions_.enable("show_hidden_edges", view && look.style == Style::hidden_line);
  actions_.check("show_hidden_edges", look.has_hidden_edges);
  actions_.check("show_edges", look.has_edges);
  actions_.check("show_grid", look.has_grid);
  actions_.check("show_axes", look.has_axes);
  actions_.check("show_lights", look.has_lights);
  actions_.check("refine", look.is_refined_at_rest);
  actions_.check("perspective", look.is_perspective);
  check_views(look, view != nullptr);
  const bool has_layers = view && (view->what().kind == "world" || view->what().kind == "robot" ||
                                   view->what().kind == "object" || view->what().kind == "solid");
  for (QAction* action : actions_.all())
    if (const QString name = action->objectName(); name.startsWith("layer_")) {
      action->setEnabled(has_layers);
      action->setChecked(std::find(look.layers.begin(), look.layers.end(), utf8(name.mid(6))) !=
                         look.layers.end());
    }
  const bool has_motion = view && view->player().has_motion();
  for (const char* name : {"play", "to_start", "step_back", "step_forward", "loop"})
    actions_.enable(name, has_motion);
  if (QAction* play = actions_.find("play")) {
    const bool is_playing = has_motion && view->player().is_playing();
    play->setIcon(icon(is_playing ? "pause" : "play"));
    play->setText(is_playing ? "&Pause" : "&Play");
  }
  actions_.check("loop", view && view->player().is_looping());
  actions_.enable("rest", view && view->recording().has_value());
}

// --- status bar ------------------------------------------------------------------------------

void MainWindow::make_status_bar() {
  auto* bar = new StatusLine;
  setStatusBar(bar);
  bar->setObjectName("status");
  bar->setAccessibleName("Status");
  bar->setSizeGripEnabled(false);
  bar->setFixedHeight(theme().status);
  status_units_ = status_label("status_units", "Units", "Units of lengths, angles and times");
  status_units_->setText(QString("mm %1 deg %1 s").arg(QChar(0x00B7)));
  status_selection_ = status_label("status_selection", "Selection", "What is selected, and where");
  // It yields first where space is missing.
  status_selection_->setSizePolicy(QSizePolicy::Ignored, QSizePolicy::Preferred);
  bar->addWidget(status_units_);
  bar->addWidget(status_selection_, 1);
  status_hidden_ = new QToolButton;
  status_hidden_->setObjectName("status_hidden");
  status_hidden_->setAccessibleName("Hidden members");
  status_hidden_->setToolTip("Members that the view does not draw; a click shows all");
  status_hidden_->setIcon(icon("hidden"));
  status_hidden_->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  status_hidden_->setFocusPolicy(Qt::TabFocus);
  status_hidden_->hide();
  connect(status_hidden_, &QToolButton::clicked, this, [this] {
    if (QAction* all = actions_.find("show_all")) all->trigger();
  });
  status_job_ = status_label("status_job", "Running job", "The job that started last");
  status_progress_ = new QProgressBar;
  status_progress_->setObjectName("status_progress");
  status_progress_->setAccessibleName("Progress of the job");
  status_progress_->setToolTip("Progress of the job");
  status_progress_->setRange(0, 1000);
  status_progress_->setTextVisible(false);
  status_progress_->setFixedWidth(80);
  status_cancel_ = new QToolButton;
  status_cancel_->setObjectName("status_cancel");
  status_cancel_->setAccessibleName("Cancel the job");
  status_cancel_->setToolTip("Cancel the job\njob.cancel(id)");
  status_cancel_->setIcon(icon("close"));
  status_cancel_->setFocusPolicy(Qt::TabFocus);
  connect(status_cancel_, &QToolButton::clicked, this, [this] {
    if (const JobStatus* job = jobs_->current()) jobs_->cancel(job->id);
  });
  status_undo_ = status_label("status_undo", "Next step to undo", "Ctrl+Z undoes it");
  status_renderer_ =
      status_label("status_renderer", "Renderer",
                   "What draws the pictures\nrobomosp-desktop --graphics reports more");
  status_server_ = new QToolButton;
  status_server_->setObjectName("status_server");
  status_server_->setToolTip(
      "Whether other programs can connect; a click opens the connections\n"
      "window.open{panel = \"connections\"}");
  status_server_->setIcon(icon("server"));
  status_server_->setToolButtonStyle(Qt::ToolButtonTextBesideIcon);
  status_server_->setFocusPolicy(Qt::TabFocus);
  connect(status_server_, &QToolButton::clicked, this, [this] { show_panel("connections"); });
  auto* theme_button = new QToolButton;
  theme_button->setObjectName("status_theme");
  theme_button->setAccessibleName("Theme");
  theme_button->setToolTip("Dark or light\nwindow.set{theme = \"light\"}");
  theme_button->setIcon(icon("dark"));
  theme_button->setFocusPolicy(Qt::TabFocus);
  connect(theme_button, &QToolButton::clicked, this,
          [this] { set_theme_and_zoom(!theme().is_dark, theme().zoom); });
  QLabel* safe = nullptr;
  if (options_.is_safe) {
    safe = new QLabel("Safe mode");
    safe->setObjectName("status_safe");
    safe->setAccessibleName("Safe mode");
    safe->setToolTip(
        "Started with --safe: without the settings and layouts of the user, without plugins that\n"
        "are not part of the program, and with software OpenGL");
  }
  for (QWidget* widget :
       {static_cast<QWidget*>(safe), static_cast<QWidget*>(status_hidden_),
        static_cast<QWidget*>(status_job_), static_cast<QWidget*>(status_progress_),
        static_cast<QWidget*>(status_cancel_), static_cast<QWidget*>(status_undo_),
        static_cast<QWidget*>(status_renderer_), static_cast<QWidget*>(status_server_),
        static_cast<QWidget*>(theme_button)})
    if (widget) bar->add_end(widget);
}

void MainWindow::show_hidden_count() {
  const ViewTab* view = current_view();
  const std::size_t count = view ? view->hidden().count() : 0;
  status_hidden_->setVisible(count > 0);
  if (count == 0) return;
  status_hidden_->setText(QString("%1 hidden").arg(count));
  QStringList names;
  for (const std::string& name : view->hidden().names()) names += shown(name);
  status_hidden_->setToolTip(names.join(", ") + "\nA click shows all (Alt+H)\n" +
                             "window.trigger{action = \"show_all\"}");
}

void MainWindow::title_tab(const ViewTab& view) {
  const int i = tabs_->indexOf(const_cast<ViewTab*>(&view));
  if (i < 0) return;
  const bool is_unsaved = desk_.is_unsaved(view.what());
  QString title = view.name();
  if (!view.is_there()) title += " (deleted)";
  else if (is_unsaved) title += QString(" ") + QChar(0x25CF);
  tabs_->setTabText(i, title);
  tabs_->setTabToolTip(
      i, shown(view.what().kind) + " " + view.name() + (is_unsaved ? ", not saved" : ""));
}

void MainWindow::title_window() {
  const ViewTab* view = current_view();
  QString title = "ROBOMOSP";
  if (view)
    title = view->name() + (desk_.is_unsaved(view->what()) ? QString(" ") + QChar(0x25CF) : "") +
            " - ROBOMOSP";
  if (const std::size_t count = desk_.unsaved().size(); count > 0)
    title += QString(" (%1 not saved)").arg(count);
  setWindowTitle(title + (options_.is_safe ? " (safe mode)" : ""));
}

void MainWindow::show_unsaved() {
  for (const ViewTab* view : views()) title_tab(*view);
  title_window();
  enable_saving();
}

std::optional<Handle> MainWindow::record_to_save() const {
  const Selection& selection = desk_.selection();
  const ViewTab* view = current_view();
  if (selection.empty()) return view ? std::optional(view->what()) : std::nullopt;
  const Handle& record = selection.front().record;
  const bool is_one = std::all_of(selection.begin(), selection.end(),
                                  [&](const Selected& s) { return s.record == record; });
  if (!is_one || record.kind == "recording" || record.kind == "run") return std::nullopt;
  return record;
}

void MainWindow::enable_saving() {
  const auto record = record_to_save();
  actions_.enable("save_as", record.has_value());
  actions_.enable("save", record && desk_.may_be_unsaved(*record));
  actions_.enable("reload", record.has_value());
  const std::size_t count = desk_.unsaved().size();
  actions_.enable("save_all", desk_.has_unsaved());
  if (QAction* all = actions_.find("save_all"))
    all->setText(count > 0 ? QString("Save a&ll %1").arg(count) : QString("Save a&ll"));
}

void MainWindow::show_keys_in_palette() {
  if (const QAction* find = actions_.find("palette"))
    top_bar_->show_keys(find->shortcut().toString(QKeySequence::NativeText));
  std::map<std::string, QString> keys;
  for (const QAction* action : actions_.all()) {
    const std::string command = utf8(command_of(*action));
    const std::string name = command.substr(0, command.find_first_of("({"));
    if (!action->shortcut().isEmpty() && !name.empty() && name != "window.trigger")
      keys.emplace(name, action->shortcut().toString(QKeySequence::NativeText));
  }
  palette_->set_shortcuts(std::move(keys));
}

void MainWindow::set_up_palette() {
  show_keys_in_palette();
  palette_->form()->on_macro = [this](const QString& line) { desk_.echo(utf8(line)); };
  palette_->form()->on_help = [this](const std::string& page) { show_help(page); };
  properties_->on_help = [this](const std::string& page) { show_help(page); };
  properties_->on_go = [this](const Handle& h) { desk_.select({{h, ""}}); };
  properties_->pose_of_view = pose_of_camera(*this);
  palette_->form()->on_show = [this](const Handle& h) { open_handle(h); };
  set_up_palette_dock();
  palette_->form()->set_pose_sources(pose_of_selection(*this), pose_of_camera(*this));
}

void MainWindow::show_help(const std::string& page) {
  palette_->step_aside();
  show_page("command:" + shown(page));
}

void MainWindow::show_selection() {
  const Selection& selection = desk_.selection();
  QString text;
  if (selection.empty()) {
    text = "Nothing is selected";
  } else if (selection.size() > 1) {
    text = QString("%1 selected").arg(selection.size());
  } else {
    const Selected& s = selection.front();
    const auto rows = navigator_->model().rows_of(s);
    QStringList names;
    for (QModelIndex i = rows.isEmpty() ? QModelIndex() : rows.front(); i.isValid();
         i = i.parent()) {
      const QString kind = i.data(NavigatorModel::kKind).toString();
      if (kind != "section" && kind != "group") names.prepend(i.data(Qt::DisplayRole).toString());
    }
    text = names.isEmpty() ? shown(s.path.empty() ? s.record.kind : s.path)
                           : names.join(QString(" %1 ").arg(QChar(0x203A)));
    if (ViewTab* view = current_view())
      if (const QString pose = view->selection_pose(); !pose.isEmpty()) text += "     " + pose;
  }
  status_selection_->setText(text);
  const bool is_record = selection.size() == 1 && selection.front().path.empty() &&
                         selection.front().record.kind != "recording" &&
                         selection.front().record.kind != "run";
  const bool is_one = selection.size() == 1;
  enable_saving();
  enable_live();
  actions_.enable("duplicate", is_record);
  actions_.enable("rename", is_one);
  actions_.enable("delete", !selection.empty());
  actions_.enable("open_selected", is_one);
  actions_.enable("simulate", is_one && selection.front().record.kind == "world");
}

void MainWindow::show_jobs() {
  const JobStatus* job = jobs_->current();
  for (QWidget* widget :
       {static_cast<QWidget*>(status_job_), static_cast<QWidget*>(status_progress_),
        static_cast<QWidget*>(status_cancel_)})
    widget->setVisible(job != nullptr);
  if (job) {
    status_job_->setText(shown(job->label) + (job->fraction > 0
                                                  ? QString(" %1 %").arg(static_cast<int>(
                                                        std::lround(100 * job->fraction)))
                                                  : QString()));
    status_progress_->setValue(static_cast<int>(std::lround(1000 * job->fraction)));
  }
  const std::size_t count = jobs_->running();
  docks_["jobs"]->setWindowTitle(count > 0 ? QString("Jobs %1").arg(count) : QString("Jobs"));
  actions_.enable("cancel_jobs", count > 0);
}

void MainWindow::ask_undo_label() {
  desk_.ask("document.history", {{"at_most", 1}}, *this, [this](const Result<Value>& r) {
    if (!r.ok()) return;
    const auto first = [&](const char* key) {
      const List& labels = list_at(map_of(*r), key);
      const std::string* label = labels.empty() ? nullptr : labels.front().as_string();
      return label ? shown(*label) : QString();
    };
    const QString undo = first("undo"), redo = first("redo");
    status_undo_->setText(undo.isEmpty() ? QString() : "Undo: " + undo);
    actions_.enable("undo", !undo.isEmpty());
    actions_.enable("redo", !redo.isEmpty());
    if (QAction* a = actions_.find("undo"))
      a->setText(undo.isEmpty() ? QString("&Undo") : "&Undo " + undo);
    if (QAction* a = actions_.find("redo"))
      a->setText(redo.isEmpty() ? QString("&Redo") : "&Redo " + redo);
  });
}

void MainWindow::take(const ioci::Event& event) {
  switch (event.topic) {
    case ioci::Topic::change:
      properties_->take(event);
      undo_timer_.start();
      show_selection();
      break;
    default: break;
  }
}

// --- the end ---------------------------------------------------------------------------------

void MainWindow::make_guard() {
  guard_ = new NoteBar("guard", "Unsaved records", "What is not saved");
  QPushButton& save = guard_->add_button("guard_save", "Save all and quit", "document.save{}");
  save.setProperty("filled", true);
  connect(&save, &QPushButton::clicked, this, [this] {
    desk_.act("document.save", {}, [this, attempt = ++close_attempt_](const Result<Value>& r) {
      if (!r.ok()) return desk_.failed(r.error());
      if (attempt != close_attempt_) return;  // the user stays
      // Records of the library are skipped: they are listed again then.
      ask_before_closing(true);
    });
  });
  connect(&guard_->add_button("guard_discard", "Discard and quit", "Quit without saving"),
          &QPushButton::clicked, this, [this] { close_now(); });
  connect(&guard_->add_button("guard_stay", "Stay", "Continue working"), &QPushButton::clicked,
          this, [this] {
            ++close_attempt_;
            guard_->hide();
          });
}

void MainWindow::ask_before_closing(bool is_saved) {
  const int attempt = ++close_attempt_;
  // A command that runs long holds up the answer: what events have reported is enough then. After
  // a save the answer comes at once, and events of it may be yet to come.
  if (!is_saved)
    QTimer::singleShot(kAnswerMs, this, [this, attempt] {
      if (attempt != close_attempt_) return;
      ++close_attempt_;
      QStringList names;
      for (const Handle& record : desk_.unsaved()) {
        const auto rows = navigator_->model().rows_of({record, {}});
        names += shown(record.kind) +
                 (rows.isEmpty() ? QString() : " " + rows.front().data(Qt::DisplayRole).toString());
      }
      if (names.isEmpty() && desk_.has_unsaved()) names += "a record that was just edited";
      if (names.isEmpty()) close_now();
      else show_guard(names, names);
    });
  desk_.ask("document.unsaved", {}, *this, [this, is_saved, attempt](const Result<Value>& r) {
    if (attempt != close_attempt_) return;
    ++close_attempt_;
    if (!r.ok()) {
      const QStringList why{"unknown records: " + shown(r.error().sentence())};
      return show_guard(why, why);
    }
    QStringList names, details;
    for (const Value& row : list_of(*r)) {
      const Map& m = map_of(row);
      const QString file = shown(text_at(m, "file"));
      names += shown(text_at(m, "kind")) + " " + shown(text_at(m, "name"));
      details += names.back() + (file.isEmpty() ? ": has no file" : ": differs from " + file);
    }
    if (names.isEmpty()) close_now();
    else show_guard(names, details);
    if (is_saved && !names.isEmpty())
      guard_->text().setText(guard_->text().text() +
                             ". Records of the library are only saved as copies: use Save as.");
  });
}

void MainWindow::show_guard(const QStringList& names, const QStringList& details) {
  constexpr qsizetype kMostNames = 6;
  const qsizetype more = names.size() - kMostNames;
  guard_->text().setText(QString("%1 %2 not saved: %3%4")
                             .arg(names.size())
                             .arg(names.size() == 1 ? "record is" : "records are")
                             .arg(names.mid(0, kMostNames).join(", "),
                                  more > 0 ? QString(" and %1 more").arg(more) : QString()));
  guard_->text().setToolTip(details.join('\n'));
  guard_->show();
  if (auto* save = guard_->findChild<QPushButton*>("guard_save")) save->setFocus();
}

void MainWindow::end_now() {
  save_layout();
  settings_.set_geometry(saveGeometry());
  settings_.sync();
}

void MainWindow::close_now() {
  is_closing_ = true;
  close();
}

void MainWindow::closeEvent(QCloseEvent* event) {
  if (!is_closing_) {
    event->ignore();
    layout_timer_.stop();
    save_layout();
    settings_.set_geometry(saveGeometry());
    ask_before_closing();
    return;
  }
  desk_.client().cancel_all();
  QMainWindow::closeEvent(event);
}

bool MainWindow::is_settled() const {
  if (!desk_.is_idle()) return false;
  if (undo_timer_.isActive() || heads_timer_.isActive() || !properties_->is_settled()) return false;
  const ViewTab* view = current_view();
  return (!view || view->is_settled()) && timeline_->is_settled() && !console_->is_drawing();
}

}  // namespace robomosp::viewer
