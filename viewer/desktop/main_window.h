// SPDX-License-Identifier: GPL-3.0-or-later
// MainWindow: the window of the desktop: four workspaces over the same docks, tabs of views in the
// centre, menus of commands, a status bar (layer: GUI).
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <QMainWindow>
#include <QTimer>

#include "viewer/desktop/actions.h"
#include "viewer/desktop/desk.h"
#include "viewer/desktop/settings.h"
#include "viewer/desktop/view_tab.h"
#include "viewer/theme/theme.h"

class QDockWidget;
class QLabel;
class QMenuBar;
class QProgressBar;
class QTabWidget;
class QToolButton;

namespace robomosp::viewer {

class Automation;
class CommandPalette;
class Console;
class JobsPanel;
class MessagesPanel;
class Navigator;
class PropertiesPanel;
class StartPage;
class Timeline;

enum class Workspace : std::uint8_t { model, robot, motion, program };
inline constexpr const char* kWorkspaceNames[] = {"model", "robot", "motion", "program"};

/// [GUI thread]
class MainWindow : public QMainWindow {
 public:
  struct Options {
    QString settings_file;       ///< "" = the user's
    bool software_view = false;  ///< draw through EGL even where a window could use OpenGL
  };
  MainWindow(Desk& desk, Options options);
  ~MainWindow() override;

  /// Opens a file, a record of the library or what a script returns, and shows it.
  void open(ioci::OpenRequest request, bool plays, std::function<void(ViewTab& view)> opened = {});
  /// Shows a record in a tab, in its own or a new one. Null if the system draws no pictures.
  ViewTab* open_view(const Handle& what, const QString& name);
  [[nodiscard]] ViewTab* current_view() const;
  [[nodiscard]] std::vector<ViewTab*> views() const;
  void show_panel(const QString& name);
  void set_workspace(Workspace workspace);
  [[nodiscard]] Workspace workspace() const { return workspace_; }
  void reset_layout();
  void set_theme_and_zoom(bool is_dark, double zoom);
  void show_start();

  [[nodiscard]] Desk& desk() const { return desk_; }
  [[nodiscard]] const Actions& actions() const { return actions_; }
  [[nodiscard]] Console& console() const { return *console_; }
  [[nodiscard]] Navigator& navigator() const { return *navigator_; }
  [[nodiscard]] MessagesPanel& messages() const { return *messages_; }
  [[nodiscard]] Timeline& timeline() const { return *timeline_; }
  [[nodiscard]] PropertiesPanel& properties() const { return *properties_; }
  [[nodiscard]] CommandPalette& palette() const { return *palette_; }
  /// True if no call of the window waits and all visible pictures are shown.
  [[nodiscard]] bool is_settled() const;
  /// Closes without asking for unsaved work.
  void close_now();
  /// Names of the panels that can be shown.
  [[nodiscard]] QStringList panels() const;

 protected:
  void closeEvent(QCloseEvent* event) override;
  void changeEvent(QEvent* event) override;

 private:
  void make_actions();
  void make_file_menu();
  void make_edit_menu();
  void make_view_menu();
  void make_display_menu(QMenu* menu);
  void make_run_menu();
  void make_tools_menu();
  void make_top_bar();
  void make_docks();
  QDockWidget* add_dock(const char* name, const QString& title, const char* icon_name,
                        QWidget* content, Qt::DockWidgetArea area);
  void make_status_bar();
  void set_up_palette();
  void show_help(const std::string& page);
  void make_guard();
  void arrange(Workspace workspace);
  void update_dock_heads();
  void save_layout();
  void show_tab_state();
  void show_selection();
  void show_jobs();
  void ask_undo_label();
  void take(const ioci::Event& event);
  void change_look(const std::function<void(ViewLook&)>& change);
  void add_toggle(QMenu* menu, const ActionSpec& spec, bool ViewLook::*flag);
  void new_record(const char* kind, Map fields);
  void open_file();
  void save_selected(bool as);
  void save_picture();
  void save_macro();
  void run_script();
  void remove_selected();
  void duplicate_selected();
  void fill_context_menu(QMenu& menu);
  void fill_recent_menu(QMenu& menu);
  void open_handle(const Handle& handle);
  void zoom_by(double factor);
  void close_tab(int index);
  void add_tab(QWidget* page, const char* icon_name, const QString& title, int at);
  void simulate();
  void ask_before_closing();
  void show_guard(const QStringList& names);

  Desk& desk_;
  const Options options_;
  Settings settings_;
  Actions actions_;
  QMenuBar* menu_bar_ = nullptr;
  QTabWidget* tabs_ = nullptr;
  StartPage* start_ = nullptr;
  Navigator* navigator_ = nullptr;
  Console* console_ = nullptr;
  MessagesPanel* messages_ = nullptr;
  JobsPanel* jobs_ = nullptr;
  Timeline* timeline_ = nullptr;
  PropertiesPanel* properties_ = nullptr;
  CommandPalette* palette_ = nullptr;
  std::map<QString, QDockWidget*> docks_;
  std::array<QToolButton*, 4> workspace_buttons_{};
  QLabel *status_units_ = nullptr, *status_selection_ = nullptr, *status_job_ = nullptr,
         *status_undo_ = nullptr, *status_renderer_ = nullptr;
  QProgressBar* status_progress_ = nullptr;
  QToolButton* status_cancel_ = nullptr;
  QWidget* guard_ = nullptr;
  QLabel* guard_text_ = nullptr;
  QTimer undo_timer_, heads_timer_, layout_timer_;
  Workspace workspace_ = Workspace::motion;
  int themed_ = theme_revision();  ///< the theme that it shows
  std::vector<Handle> unsaved_;
  bool is_closing_ = false, is_arranging_ = false;
  std::shared_ptr<Automation> automation_;
};

}  // namespace robomosp::viewer
