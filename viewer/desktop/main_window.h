// SPDX-License-Identifier: GPL-3.0-or-later
// MainWindow: the window of the desktop: four workspaces over the same docks, tabs of views in the
// centre, menus of commands, a status bar (layer: GUI).
#pragma once

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
class ConnectionsPanel;
class Console;
class HelpPanel;
class JobsPanel;
class MessagesPanel;
class Navigator;
class NoteBar;
class PropertiesPanel;
class Shortcuts;
class ShortcutsPanel;
class StartPage;
struct Story;
class StoryProgress;
class Thumbnails;
class TopBar;
class Timeline;

enum class Workspace : std::uint8_t { model, robot, motion, program };
inline constexpr const char* kWorkspaceNames[] = {"model", "robot", "motion", "program"};

/// [GUI thread]
class MainWindow : public QMainWindow {
 public:
  struct Options {
    QString settings_file;         ///< "" = the user's
    bool software_view = false;    ///< draw through EGL even where a window could use OpenGL
    bool is_safe = false;          ///< says that the program was started with --safe
    bool has_whole_start = false;  ///< the start page alone has no panels beside it
  };
  MainWindow(Desk& desk, Options options);
  ~MainWindow() override;

  /// Opens a file, a record of the library or what a script returns, and shows it.
  void open(ioci::OpenRequest request, bool plays, std::function<void(ViewTab& view)> opened = {});
  /// Shows a record in a tab, in its own or a new one. Null if the system draws no pictures.
  ViewTab* open_view(const Handle& what, const QString& name);
  [[nodiscard]] ViewTab* current_view() const;
  [[nodiscard]] std::vector<ViewTab*> views() const;
  /// Shows a result of a command in a tab: as plot, table, picture or value.
  void open_result(const QString& title, const Value& result);
  /// Shows a record in its tab or in the properties, a recording or run in the tab of what it
  /// moves.
  void open_handle(const Handle& handle);
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
  [[nodiscard]] HelpPanel& help() const { return *help_; }
  [[nodiscard]] ConnectionsPanel& connections() const { return *connections_; }
  [[nodiscard]] StoryProgress& story() const { return *story_; }
  /// Opens the world of a story, and its steps beside it.
  void begin_story(const Story& story, bool anew);
  [[nodiscard]] Shortcuts& shortcuts() const { return *shortcuts_; }
  /// Shows a page in the help: "user/desktop.md#views", "command:robot.fk"; see HelpPanel.
  void show_page(const QString& page);
  /// The page for the widget under the mouse, or else for the one with the focus.
  void show_help_here();
  /// Sets the keys of a menu entry; none = the program's; "" as action = those of all entries.
  Result<void> set_keys(const std::string& action, const std::optional<QString>& keys);
  /// True if no call of the window waits and all visible pictures are shown.
  [[nodiscard]] bool is_settled() const;
  /// Closes without asking for unsaved work.
  void close_now();
  /// Writes the layout and the settings, when the process ends without closing.
  void end_now();
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
  // display_menu.cpp
  void make_views_menu(QMenu* menu);
  void make_stereo_menu(QMenu* menu);
  void fill_user_views(QMenu& menu);
  void save_user_view(const QString& name);
  void check_views(const ViewLook& look, bool has_view);
  void make_run_menu();
  // main_window_live.cpp
  void make_live_menu(QMenu* menu);
  /// The world or robot that a live run would be of: selected, or else shown.
  [[nodiscard]] std::optional<Handle> live_subject() const;
  void enable_live();
  /// Opens the form of the command that starts a live run. `with`: arguments of the simulation.
  void open_live_form(const Handle& subject, const char* of, Map with);
  void run_tasks_live();
  /// Opens the form for the first of the worlds that a task or program is a member of.
  void run_in_a_world(const Handle& record, std::vector<Handle> worlds);
  void make_tools_menu();
  void make_top_bar();
  void make_docks();
  void set_least_widths();
  QDockWidget* add_dock(const char* name, const QString& title, const char* icon_name,
                        QWidget* content, Qt::DockWidgetArea area);
  void make_status_bar();
  void show_hidden_count();
  /// Names of tabs, with a dot if the record is not saved.
  void title_tab(const ViewTab& view);
  void title_window();
  /// Titles, entries and marks that depend on which records are saved.
  void show_unsaved();
  void enable_saving();
  void set_up_palette();
  void set_up_palette_dock();
  void dock_palette(bool on);
  void show_help(const std::string& page);
  void show_keys_in_palette();
  // Panels that are opened when they are needed: main_window_rooms.cpp.
  void make_rooms();
  void finish_rooms();
  void arrange_rooms();
  /// Restores docks as they were; panels opened when needed stay closed.
  void restore_layout(const QByteArray& state);
  /// Gives a panel an area; false if it is none of those.
  bool place_room(QDockWidget& dock, const QString& name);
  /// Hides the panels while nothing but the start page is open, and shows them again.
  void enter_whole_start();
  void leave_whole_start();
  /// What the centre shows without tabs.
  QWidget* make_empty();
  void show_empty();
  void show_server_state();
  void make_notice();
  /// Explains above the views why something was not opened.
  void show_notice(const QString& what, const Error& why);
  void make_guard();
  void arrange(Workspace workspace);
  /// Arranges the panels of the workspace as the user left them.
  void arrange_as_kept();
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
  /// What Save, Save as and Reload take: the selected record or that of the selected parts; with
  /// nothing selected, that of the current tab.
  [[nodiscard]] std::optional<Handle> record_to_save() const;
  void save_selected(bool as);
  void reload_selected();
  /// Opens the form of the picture of what the current view shows, at the time that it shows.
  void save_picture();
  /// Opens the form of a film of the recording or live run that moves the current view.
  void film();
  /// Calls `then` with the recording that moves a view: of a live run, with its rows so far.
  void with_recording(ViewTab& view, std::function<void(std::optional<Handle>)> then);
  void save_macro();
  void run_script();
  void remove_selected();
  void duplicate_selected();
  void fill_context_menu(QMenu& menu);
  void fill_recent_menu(QMenu& menu);
  /// Shows them in the tab of what they move.
  void open_recording(const Handle& recording);
  void open_run(const Handle& run);
  /// Calls `then` with the tab of what a recording or run moves. `by` names that in failures.
  void with_moved(const Handle& subject, const std::string& by, std::function<void(ViewTab&)> then);
  void zoom_by(double factor);
  void close_tab(int index);
  void add_tab(QWidget* page, const char* icon_name, const QString& title, int at);
  void simulate();
  /// `is_saved`: all was saved that can be.
  void ask_before_closing(bool is_saved = false);
  /// Names of what is not saved, and a line of its tool tip for each.
  void show_guard(const QStringList& names, const QStringList& details);

  Desk& desk_;
  const Options options_;
  Settings settings_;
  Actions actions_;
  QMenuBar* menu_bar_ = nullptr;
  QTabWidget* tabs_ = nullptr;
  Thumbnails* thumbnails_ = nullptr;
  StartPage* start_ = nullptr;
  Navigator* navigator_ = nullptr;
  Console* console_ = nullptr;
  MessagesPanel* messages_ = nullptr;
  JobsPanel* jobs_ = nullptr;
  Timeline* timeline_ = nullptr;
  PropertiesPanel* properties_ = nullptr;
  CommandPalette* palette_ = nullptr;
  HelpPanel* help_ = nullptr;
  ConnectionsPanel* connections_ = nullptr;
  StoryProgress* story_ = nullptr;
  std::unique_ptr<Shortcuts> shortcuts_;
  ShortcutsPanel* shortcuts_panel_ = nullptr;
  std::map<QString, QDockWidget*> docks_;
  TopBar* top_bar_ = nullptr;
  QLabel *status_units_ = nullptr, *status_selection_ = nullptr, *status_job_ = nullptr,
         *status_undo_ = nullptr, *status_renderer_ = nullptr;
  QProgressBar* status_progress_ = nullptr;
  QToolButton *status_cancel_ = nullptr, *status_server_ = nullptr, *status_hidden_ = nullptr;
  NoteBar *guard_ = nullptr, *notice_ = nullptr;
  QWidget* empty_ = nullptr;
  QTimer undo_timer_, heads_timer_, layout_timer_;
  Workspace workspace_ = Workspace::motion;
  int themed_ = theme_revision();  ///< the theme that it shows
  int close_attempt_ = 0;          ///< counts wishes to close, and their ends
  bool is_closing_ = false, is_arranging_ = false, is_whole_start_ = false;
  std::shared_ptr<Automation> automation_;
};

}  // namespace robomosp::viewer
