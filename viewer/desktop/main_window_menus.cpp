// SPDX-License-Identifier: GPL-3.0-or-later
// The menus of the window: each entry is a command.
#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

#include <QActionGroup>
#include <QApplication>
#include <QDockWidget>
#include <QFileDialog>
#include <QFileInfo>
#include <QMenu>
#include <QMenuBar>
#include <QStatusBar>
#include <QTabWidget>
#include <QToolButton>

#include "scene/extras.h"
#include "viewer/desktop/console.h"
#include "viewer/desktop/jobs.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/messages.h"
#include "viewer/desktop/navigator.h"
#include "viewer/desktop/stories.h"
#include "viewer/desktop/top_bar.h"
#include "viewer/desktop/values.h"
#include "viewer/forms/command_form.h"
#include "viewer/forms/command_palette.h"
#include "viewer/forms/properties_panel.h"
#include "viewer/gizmo/tool_bar.h"
#include "viewer/theme/icons.h"
#include "viewer/theme/theme.h"
#include "viewer/timeline/timeline.h"

namespace robomosp::viewer {
namespace {

constexpr double kZoomStep = 1.1;
constexpr double kSectionStep = 0.05;  ///< of the box of all items
constexpr const char* kFileFilter =
    "All that can be opened (*.wld *.rbt *.part *.csg *.mtr *.tjc *.tsk *.prg *.ctl *.lua *.step "
    "*.stp *.iges *.igs *.stl *.obj *.ply *.glb *.3mf *.dxf *.urdf *.xml *.sdf);;All files (*)";

QMenu* add_menu(QMenuBar& bar, const QString& title, const char* name) {
  QMenu* menu = bar.addMenu(title);
  menu->setObjectName(name);
  menu->setAccessibleName(QString(title).remove('&'));
  menu->setToolTipsVisible(true);
  return menu;
}

QString layer_title(const std::string& layer) {
  QString text = QString::fromStdString(layer);
  text.replace('_', ' ');
  text[0] = text[0].toUpper();
  return text;
}

std::string base64_of(const QString& text) { return text.toUtf8().toBase64().toStdString(); }

}  // namespace

void MainWindow::make_top_bar() {
  auto* spaces = menu_bar_->findChild<QMenu*>("workspace_menu");
  top_bar_ = new TopBar(*menu_bar_, *spaces, static_cast<std::size_t>(workspace_));
  top_bar_->on_workspace = [this](std::size_t i) { set_workspace(static_cast<Workspace>(i)); };
  top_bar_->on_find = [this] { palette_->open(); };
  setMenuWidget(top_bar_);
}

void MainWindow::make_actions() {
  // Not menuBar(): that would replace the bar that it is in.
  menu_bar_ = new QMenuBar;
  menu_bar_->setObjectName("menu_bar");
  menu_bar_->setAccessibleName("Menus");
  menu_bar_->setNativeMenuBar(false);
  make_file_menu();
  make_edit_menu();
  make_view_menu();
  make_run_menu();
  make_tools_menu();
  timeline_ = new Timeline(desk_, settings_, actions_);
  timeline_->on_open = [this](const Handle& handle) { open_handle(handle); };
  timeline_->on_film = [this] { film(); };
  add_dock("timeline", "Timeline", "plot", timeline_, Qt::BottomDockWidgetArea);
  // Panels in the menu View, in the order of their names.
  QMenu* panels = menu_bar_->findChild<QMenu*>("panels_menu");
  for (const auto& [name, dock] : docks_) {
    QAction* toggle = dock->toggleViewAction();
    toggle->setObjectName("show_" + name);
    toggle->setText(dock->windowTitle());
    actions_.adopt(*toggle, "window.open{panel = \"" + name + "\"}");
    panels->addAction(toggle);
  }
}

void MainWindow::make_file_menu() {
  QMenu* menu = add_menu(*menu_bar_, "&File", "file_menu");
  QMenu* fresh = menu->addMenu("&New");
  fresh->setObjectName("new_menu");
  fresh->setToolTipsVisible(true);
  actions_.add(fresh, {"new_world", "New &world", "world", "Ctrl+N", "world.create{name = ...}"},
               [this](bool) { new_record("world", {}); });
  actions_.add(fresh, {"new_robot", "New &robot", "robot", "", "robot.create{name = ...}"},
               [this](bool) {
                 new_record("robot", {{"links", List{Map{{"a", 0.3}}, Map{{"a", 0.2}}}}});
               });
  actions_.add(
      fresh, {"new_solid", "New &solid", "solid", "", "solid.create{name = ...}"}, [this](bool) {
        new_record("solid", {{"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
      });
  actions_.add(fresh, {"new_program", "New &program", "program", "", "program.create{name = ...}"},
               [this](bool) {
                 new_record("program", {{"source", "PROGRAM new;\nBEGIN\n  HALT;\nENDPROGRAM;\n"}});
               });
  actions_.add(menu, {"open", "&Open...", "folder", "Ctrl+O", "file.load(file)"},
               [this](bool) { open_file(); });
  QMenu* recent = menu->addMenu("Open &recent");
  recent->setObjectName("recent_menu");
  recent->setToolTipsVisible(true);
  connect(recent, &QMenu::aboutToShow, this, [this, recent] { fill_recent_menu(*recent); });
  actions_.add(menu,
               {"start_page", "S&tart page", "home", "Alt+Home", "window.open{panel = \"start\"}"},
               [this](bool) { show_start(); });
  menu->addSeparator();
  actions_.add(menu, {"save", "&Save", "save", "Ctrl+S", "record.save{id = ..., file = ...}"},
               [this](bool) { save_selected(false); });
  actions_.add(menu,
               {"save_as", "Save &as...", "", "Ctrl+Shift+S", "record.save{id = ..., file = ...}"},
               [this](bool) { save_selected(true); });
  actions_.add(menu, {"save_all", "Save a&ll", "", "Ctrl+Alt+S", "document.save{}"},
               [this](bool) { desk_.act("document.save"); });
  actions_.add(
      menu,
      {"reload", "Re&load from its file", "refresh", "", "file.load{file = ..., reload = true}"},
      [this](bool) { reload_selected(); });
  menu->addSeparator();
  actions_.add(menu,
               {"save_picture", "Save &picture...", "camera", "Ctrl+Shift+I",
                "world.render{id = ..., file = ...}"},
               [this](bool) { save_picture(); });
  actions_.add(menu,
               {"film", "Save f&ilm...", "recording", "", "recording.video{id = ..., file = ...}"},
               [this](bool) { film(); });
  menu->addSeparator();
  actions_.add(menu, {"close_tab", "&Close tab", "close", "Ctrl+W", ""},
               [this](bool) { close_tab(tabs_->currentIndex()); });
  actions_.add(menu, {"quit", "&Quit", "", "Ctrl+Q", "quit()"}, [this](bool) { close(); });
}

void MainWindow::make_edit_menu() {
  QMenu* menu = add_menu(*menu_bar_, "&Edit", "edit_menu");
  actions_.add(menu, {"undo", "&Undo", "undo", "Ctrl+Z", "document.undo()"},
               [this](bool) { desk_.act("document.undo"); });
  actions_.add(menu, {"redo", "&Redo", "redo", "Ctrl+Shift+Z", "document.redo()"},
               [this](bool) { desk_.act("document.redo"); });
  menu->addSeparator();
  actions_.add(
      menu,
      {"find", "&Find in the navigator", "search", "Ctrl+F", "window.open{panel = \"navigator\"}"},
      [this](bool) {
        show_panel("navigator");
        navigator_->focus_search();
      });
  actions_.add(menu,
               {"open_selected", "&Open in a tab", "external", "", "window.open{record = ...}"},
               [this](bool) {
                 if (!desk_.selection().empty()) open_handle(desk_.selection().front().record);
               });
  actions_.add(menu, {"rename", "Re&name", "rename", "F2", "handle:rename(name)"}, [this](bool) {
    show_panel("navigator");
    navigator_->rename_selected();
  });
  actions_.add(menu, {"duplicate", "&Duplicate", "copy", "Ctrl+D", "handle:duplicate()"},
               [this](bool) { duplicate_selected(); });
  actions_.add(menu, {"delete", "De&lete", "trash", "Del", "handle:remove()"},
               [this](bool) { remove_selected(); });
}

void MainWindow::add_toggle(QMenu* menu, const ActionSpec& spec, bool ViewLook::*flag) {
  actions_.add(menu, spec,
               [this, flag](bool on) { change_look([&](ViewLook& look) { look.*flag = on; }); });
}

void MainWindow::change_look(const std::function<void(ViewLook&)>& change) {
  ViewTab* view = current_view();
  if (!view) return;
  ViewLook look = view->look();
  change(look);
  view->set_look(look);
  show_tab_state();
}

void MainWindow::make_display_menu(QMenu* menu) {
  struct Named {
    const char *name, *text, *keys;
    Camera::View view;
  };
  actions_.add(menu, {"fit", "&Fit all", "fit", "F", ""}, [this](bool) {
    if (ViewTab* view = current_view()) view->fit();
  });
  actions_.add(menu, {"fly_to_selection", "Fly to &selection", "target", "Shift+F", ""},
               [this](bool) {
                 if (ViewTab* view = current_view()) view->fly_to_selection();
               });
  menu->addSeparator();
  constexpr std::array<Named, 7> kViews{
      {{"view_isometric", "&Isometric", "1", Camera::View::isometric},
       {"view_front", "F&ront", "2", Camera::View::front},
       {"view_back", "&Back", "3", Camera::View::back},
       {"view_left", "&Left", "4", Camera::View::left},
       {"view_right", "Ri&ght", "5", Camera::View::right},
       {"view_top", "&Top", "6", Camera::View::top},
       {"view_bottom", "B&ottom", "7", Camera::View::bottom}}};
  for (const Named& each : kViews)
    actions_.add(menu,
                 {each.name, each.text, each.view == Camera::View::isometric ? "isometric" : "",
                  each.keys, ""},
                 [this, v = each.view](bool) {
                   if (ViewTab* view = current_view()) view->view_from(v);
                 });
  menu->addSeparator();
  add_toggle(menu, {"perspective", "&Perspective", "perspective", "P", "", true},
             &ViewLook::is_perspective);
  make_views_menu(menu);
  make_stereo_menu(menu);
  QMenu* style = menu->addMenu("Drawing &style");
  style->setObjectName("style_menu");
  struct Styled {
    const char *name, *text, *icon, *keys;
    Style style;
  };
  constexpr std::array<Styled, 4> kStyles{
      {{"style_smooth", "&Smooth", "shading", "Shift+1", Style::smooth},
       {"style_flat", "&Flat", "solid", "Shift+2", Style::flat},
       {"style_wireframe", "&Wireframe", "wireframe", "Shift+3", Style::wireframe},
       {"style_hidden_line", "&Hidden line", "box", "Shift+4", Style::hidden_line}}};
  auto* styles = new QActionGroup(this);
  for (const Styled& each : kStyles)
    styles->addAction(actions_.add(
        style, {each.name, each.text, each.icon, each.keys, "", true},
        [this, s = each.style](bool) { change_look([s](ViewLook& look) { look.style = s; }); }));
  style->addSeparator();
  add_toggle(style, {"show_hidden_edges", "Hidden edges &dashed", "", "", "", true},
             &ViewLook::has_hidden_edges);
  QMenu* section = menu->addMenu("Se&ction plane");
  section->setObjectName("section_menu");
  actions_.add(nullptr, {"sections", "Section plane", "section", "", ""}, {})->setMenu(section);
  auto* sections = new QActionGroup(this);
  struct Cut {
    const char *name, *text, *icon;
    int axis;
  };
  constexpr std::array<Cut, 4> kCuts{{{"section_none", "&None", "", -1},
                                      {"section_x", "Across &x", "", 0},
                                      {"section_y", "Across &y", "", 1},
                                      {"section_z", "Across &z", "", 2}}};
  for (const Cut& each : kCuts)
    sections->addAction(actions_.add(section, {each.name, each.text, each.icon, "", "", true},
                                     [this, axis = each.axis](bool) {
                                       change_look([axis](ViewLook& look) {
                                         look.section_axis = axis;
                                         look.section_share = 0.5;
                                       });
                                     }));
  section->addSeparator();
  add_toggle(section, {"section_turn", "Keep the &other side", "", "", "", true},
             &ViewLook::is_section_turned);
  const auto move = [&](const char* name, const char* text, const char* keys, double by) {
    actions_.add(section, {name, text, "", keys, ""}, [this, by](bool) {
      change_look([by](ViewLook& look) {
        look.section_share = std::clamp(look.section_share + by, 0.0, 1.0);
      });
    });
  };
  move("section_forward", "Move &forward", "Ctrl+Up", kSectionStep);
  move("section_back", "Move &back", "Ctrl+Down", -kSectionStep);
  QMenu* overlays = menu->addMenu("&Overlays");
  overlays->setObjectName("overlays_menu");
  QAction* entry = actions_.add(nullptr, {"overlays", "Overlays", "layers", "", ""}, {});
  entry->setMenu(overlays);
  for (const std::string& layer : scene::layer_names()) {
    const std::string name = "layer_" + layer;
    const std::string title = utf8(layer_title(layer));
    actions_.add(overlays,
                 {name.c_str(), title.c_str(), "",
                  layer == "velocity_ellipsoids" ? "Ctrl+E"
                  : layer == "force_ellipsoids"  ? "Ctrl+Shift+E"
                                                 : "",
                  "", true},
                 [this, layer](bool on) {
                   change_look([&](ViewLook& look) {
                     std::erase(look.layers, layer);
                     if (on) look.layers.push_back(layer);
                   });
                 });
  }
  menu->addSeparator();
  add_toggle(menu, {"show_grid", "&Grid", "grid", "", "", true}, &ViewLook::has_grid);
  add_toggle(menu, {"show_axes", "World &axes", "frame", "", "", true}, &ViewLook::has_axes);
  add_toggle(menu, {"show_lights", "&Lights of the world", "sun", "", "", true},
             &ViewLook::has_lights);
  add_toggle(menu, {"show_edges", "Feature &edges", "edge", "", "", true}, &ViewLook::has_edges);
  // Of all views, also of those opened later: it depends on the machine, not on the record.
  actions_.add(menu, {"refine", "Fine picture &when still", "", "", "", true}, [this](bool on) {
    settings_.set_fine_pictures(on);
    for (ViewTab* view : views()) {
      ViewLook look = view->look();
      look.is_refined_at_rest = on;
      view->set_look(look);
    }
    show_tab_state();
  });
}

void MainWindow::make_view_menu() {
  QMenu* menu = add_menu(*menu_bar_, "&View", "view_menu");
  QMenu* spaces = menu->addMenu("&Workspace");
  spaces->setObjectName("workspace_menu");
  auto* group = new QActionGroup(this);
  for (std::size_t i = 0; i < 4; ++i) {
    const std::string name = std::string("workspace_") + kWorkspaceNames[i];
    std::string title = kWorkspaceNames[i];
    title[0] = static_cast<char>(title[0] - 'a' + 'A');
    const std::string keys = "Ctrl+" + std::to_string(i + 1);
    const std::string command =
        std::string("window.set{workspace = \"") + kWorkspaceNames[i] + "\"}";
    QAction* action =
        actions_.add(spaces, {name.c_str(), title.c_str(), "", keys.c_str(), command.c_str(), true},
                     [this, i](bool) { set_workspace(static_cast<Workspace>(i)); });
    action->setChecked(static_cast<std::size_t>(workspace_) == i);
    group->addAction(action);
  }
  QMenu* panels = menu->addMenu("&Panels");
  panels->setObjectName("panels_menu");
  panels->setToolTipsVisible(true);
  actions_.add(menu, {"view_reset_layout", "Reset &layout", "", "", ""},
               [this](bool) { reset_layout(); });
  menu->addSeparator();
  make_display_menu(menu);
  QMenu* tools = menu->addMenu("Tools of the pict&ure");
  tools->setObjectName("picture_tools_menu");
  tools->setToolTipsVisible(true);
  add_tool_actions(*this, actions_, *tools);
  menu->addSeparator();
  actions_.add(menu, {"zoom_in", "Zoom interface i&n", "plus", "Ctrl+=", "window.set{zoom = 1.1}"},
               [this](bool) { zoom_by(kZoomStep); });
  actions_.add(menu,
               {"zoom_out", "Zoom interface o&ut", "minus", "Ctrl+-", "window.set{zoom = 0.9}"},
               [this](bool) { zoom_by(1 / kZoomStep); });
  actions_.add(menu, {"zoom_reset", "Interface at 100 %", "", "Ctrl+0", "window.set{zoom = 1}"},
               [this](bool) { set_theme_and_zoom(theme().is_dark, 1); });
  actions_.add(menu, {"theme_dark", "&Dark", "dark", "", "window.set{theme = \"dark\"}", true},
               [this](bool) { set_theme_and_zoom(true, theme().zoom); });
  actions_.add(menu, {"theme_light", "Li&ght", "sun", "", "window.set{theme = \"light\"}", true},
               [this](bool) { set_theme_and_zoom(false, theme().zoom); });
  actions_.add(menu, {"strong_borders", "Strong &borders", "", "", "", true}, [this](bool on) {
    settings_.set_strong_borders(on);
    set_theme_and_zoom(theme().is_dark, theme().zoom);
  });
  connect(menu, &QMenu::aboutToShow, this, [this] {
    actions_.check("strong_borders", theme().has_strong_borders);
    actions_.check("theme_dark", theme().is_dark);
    actions_.check("theme_light", !theme().is_dark);
  });
}

void MainWindow::make_run_menu() {
  QMenu* menu = add_menu(*menu_bar_, "&Run", "run_menu");
  const auto player = [this]() -> Player* {
    ViewTab* view = current_view();
    return view ? &view->player() : nullptr;
  };
  // A live run is moved by commands, which have their lines.
  const auto add = [&](const ActionSpec& spec, void (*act)(Player&)) {
    ActionSpec silent = spec;
    silent.echoes = false;
    actions_.add(menu, silent, [this, player, act, line = trigger_line(spec.name)](bool) {
      Player* p = player();
      if (!p) return;
      act(*p);
      if (!p->is_run()) desk_.echo(line);
    });
  };
  add({"play", "&Play", "play", "Space", ""}, [](Player& p) { p.play(!p.is_playing()); });
  add({"to_start", "To the &start", "step_back", "Home", ""},
      [](Player& p) { p.set_time(p.from()); });
  add({"step_back", "Step &back", "chevron_left", "Ctrl+Left", ""}, [](Player& p) { p.step(-1); });
  add({"step_forward", "Step &forward", "chevron_right", "Ctrl+Right", ""},
      [](Player& p) { p.step(1); });
  actions_.add(menu, {"loop", "&Repeat", "loop", "", "", true}, [player](bool on) {
    if (Player* p = player()) p->set_loop(on);
  });
  actions_.add(menu, {"rest", "Back to the &document", "home", "", ""}, [this](bool) {
    if (ViewTab* view = current_view()) view->rest();
  });
  menu->addSeparator();
  actions_.add(menu,
               {"simulate", "Simulate the &motion", "run", "Ctrl+R",
                "world.inverse_kinematics{id = ..., robot = ..., trajectory = ...}"},
               [this](bool) { simulate(); });
  make_live_menu(menu);
  actions_.add(menu, {"run_script", "Run s&cript...", "program", "Ctrl+Shift+R", "dofile(file)"},
               [this](bool) { run_script(); });
  actions_.add(menu, {"cancel_jobs", "C&ancel all jobs", "stop", "Ctrl+.", "job.cancel(id)"},
               [this](bool) { jobs_->cancel_all(); });
}

void MainWindow::make_tools_menu() {
  QMenu* menu = add_menu(*menu_bar_, "&Tools", "tools_menu");
  actions_.add(menu, {"palette", "&Find a command...", "search", "Ctrl+Shift+P", "", false, false},
               [this](bool) { palette_->open(); });
  menu->addSeparator();
  actions_.add(menu, {"macro_record", "&Record a macro", "record_macro", "", "", true, false},
               [this](bool on) {
                 show_panel("console");
                 console_->set_recording(on);
               });
  actions_.add(menu, {"macro_save", "&Save the macro...", "save", "", "file.write{file = ...}"},
               [this](bool) { save_macro(); });
  actions_.enable("macro_save", false);
  console_->macro_changed.add(this, [this] {
    actions_.check("macro_record", console_->is_recording());
    actions_.enable("macro_save", console_->has_macro());
  });
  actions_.add(menu, {"console_clear", "&Clear the console", "", "", "", false, false},
               [this](bool) { console_->clear(); });
  menu->addSeparator();
  actions_.add(menu, {"check_document", "C&heck everything", "ok", "", "fault.list{}"},
               [this](bool) {
                 show_panel("messages");
                 desk_.start("fault.list", {}, [this](const Result<Value>& r) {
                   if (!r.ok()) return desk_.failed(r.error());
                   const List& faults = list_at(map_of(*r), "faults");
                   for (const Value& each : faults)
                     if (const auto fault = fault_from(each))
                       messages_->add(fault->severity, shown(sentence(*fault)),
                                      std::make_shared<const Fault>(*fault));
                   messages_->add(Severity::info, QString("Checked %1 records, %2 faults.")
                                                      .arg(whole_at(map_of(*r), "looked_at"))
                                                      .arg(faults.size()));
                 });
               });
  QMenu* help = add_menu(*menu_bar_, "&Help", "help_menu");
  actions_.add(help, {"help_here", "&Help on this", "info", "F1", "window.open{panel = \"help\"}"},
               [this](bool) { show_help_here(); });
  actions_.add(help,
               {"help_contents", "&Contents", "list", "Shift+F1",
                "window.open{panel = \"help\", page = \"contents\"}"},
               [this](bool) { show_page("contents"); });
  QMenu* told = help->addMenu("S&tories");
  told->setObjectName("stories_menu");
  told->setToolTipsVisible(true);
  for (const Story& story : stories()) {
    const std::string name = "story_" + utf8(story.id), title = utf8(story.title);
    actions_.add(told, {name.c_str(), title.c_str(), "", "", ""},
                 [this, &story](bool) { begin_story(story, true); });
  }
  actions_.add(
      help, {"help_shortcuts", "&Shortcuts", "keyboard", "", "window.open{panel = \"shortcuts\"}"},
      [this](bool) { show_panel("shortcuts"); });
  actions_.add(help, {"help_console", "Help in the c&onsole", "console", "", "help()"},
               [this](bool) {
                 show_panel("console");
                 console_->run("help()");
               });
  actions_.add(help, {"version", "&Version", "", "", "version()"}, [this](bool) {
    show_panel("console");
    console_->run("version()");
  });
}

// --- acts ------------------------------------------------------------------------------------

void MainWindow::new_record(const char* kind, Map fields) {
  desk_.ask("document.outline", {}, *this,
            [this, kind, fields = std::move(fields)](const Result<Value>& r) mutable {
              if (!r.ok()) return desk_.failed(r.error());
              const auto is_taken = [&](const std::string& name) {
                return std::any_of(list_of(*r).begin(), list_of(*r).end(), [&](const Value& row) {
                  return text_at(map_of(row), "kind") == kind &&
                         text_at(map_of(row), "name") == name;
                });
              };
              std::string name = std::string("new_") + kind;
              for (int i = 2; is_taken(name); ++i)
                name = std::string("new_") + kind + "_" + std::to_string(i);
              fields.set("name", name);
              desk_.act(std::string(kind) + ".create", std::move(fields),
                        [this](const Result<Value>& made) {
                          if (!made.ok()) return desk_.failed(made.error());
                          if (const Handle* h = made->as_handle()) open_handle(*h);
                        });
            });
}

void MainWindow::open_file() {
  auto* dialog = new QFileDialog(this, "Open", QString(), kFileFilter);
  dialog->setObjectName("open_dialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setFileMode(QFileDialog::ExistingFiles);
  connect(dialog, &QFileDialog::filesSelected, this, [this](const QStringList& files) {
    for (const QString& file : files) {
      static constexpr const char* kForeign[] = {"step", "stp", "iges", "igs", "stl", "ply", "glb",
                                                 "3mf",  "dxf", "urdf", "xml", "sdf", "obj"};
      const QString ending = QFileInfo(file).suffix().toLower();
      const bool is_foreign = std::any_of(std::begin(kForeign), std::end(kForeign),
                                          [&](const char* e) { return ending == e; });
      if (is_foreign) {
        desk_.start("import", {{"file", utf8(file)}}, [this](const Result<Value>& r) {
          if (!r.ok()) return desk_.failed(r.error());
          if (const Handle* h = r->as_handle()) open_handle(*h);
        });
        continue;
      }
      ioci::OpenRequest request;
      if (ending == "lua") request.script = utf8(file);
      else request.what = utf8(file);
      request.simulates = false;
      open(std::move(request), ending == "lua");
    }
  });
  dialog->open();
}

void MainWindow::fill_recent_menu(QMenu& menu) {
  menu.clear();
  for (const QString& file : settings_.recent_files()) {
    QAction* entry = menu.addAction(QFileInfo(file).fileName());
    entry->setToolTip(file + "\nfile.load(\"" + file + "\")");
    entry->setEnabled(QFileInfo::exists(file));
    connect(entry, &QAction::triggered, this, [this, file] {
      ioci::OpenRequest request;
      request.what = utf8(file);
      request.simulates = false;
      open(std::move(request), false);
    });
  }
  if (menu.isEmpty()) menu.addAction("No files yet")->setEnabled(false);
}

void MainWindow::reload_selected() {
  const auto record = record_to_save();
  if (!record) return;
  desk_.ask("document.outline", {}, *this, [this, record = *record](const Result<Value>& r) {
    if (!r.ok()) return desk_.failed(r.error());
    for (const Value& row : list_of(*r))
      if (handle_at(map_of(row), "id") == record) {
        const std::string file = text_at(map_of(row), "file");
        if (file.empty())
          return desk_.failed(
              error(ErrorCode::not_found, "the record has no file", "Save it first."));
        desk_.act("file.load", {{"file", file}, {"reload", true}});
      }
  });
}

void MainWindow::save_selected(bool as) {
  const auto wanted = record_to_save();
  if (!wanted) return;
  const Handle record = *wanted;
  desk_.ask("document.outline", {}, *this, [this, record, as](const Result<Value>& r) {
    if (!r.ok()) return desk_.failed(r.error());
    std::string file, name;
    for (const Value& row : list_of(*r))
      if (handle_at(map_of(row), "id") == record) {
        if (!flag_at(map_of(row), "is_library")) file = text_at(map_of(row), "file");
        name = text_at(map_of(row), "name");
      }
    const auto save = [this, record](const std::string& to) {
      desk_.act("record.save", {{"id", record}, {"file", to}},
                [this, to](const Result<Value>& done) {
                  if (!done.ok()) return desk_.failed(done.error());
                  settings_.add_recent_file(QFileInfo(shown(to)).absoluteFilePath());
                  statusBar()->showMessage("Saved " + shown(to), 5000);
                });
    };
    if (!as && !file.empty()) return save(file);
    desk_.ask("record.schema", {{"kind", record.kind}}, *this,
              [this, name, save](const Result<Value>& s) {
                const QString ending = s.ok() ? shown(text_at(map_of(*s), "extension")) : QString();
                auto* dialog = new QFileDialog(this, "Save as", shown(name) + ending,
                                               "Files (*" + ending + ")");
                dialog->setObjectName("save_dialog");
                dialog->setAttribute(Qt::WA_DeleteOnClose);
                dialog->setAcceptMode(QFileDialog::AcceptSave);
                dialog->setDefaultSuffix(QString(ending).remove('.'));
                connect(dialog, &QFileDialog::fileSelected, this,
                        [save](const QString& to) { save(utf8(to)); });
                dialog->open();
              });
  });
}

void MainWindow::with_recording(ViewTab& view, std::function<void(std::optional<Handle>)> then) {
  if (!view.run()) return then(view.recording());
  desk_.act("run.recording", {{"id", *view.run()}},
            [this, then = std::move(then)](const Result<Value>& r) {
              if (!r.ok()) return desk_.failed(r.error());
              const Handle* made = r->as_handle();
              then(made ? std::optional(*made) : std::nullopt);
            });
}

void MainWindow::save_picture() {
  ViewTab* view = current_view();
  if (!view)
    return desk_.failed(
        error(ErrorCode::not_found, "no view is shown", "Open a world or another record first."));
  Map args = view->render_arguments();
  args.set("id", utf8(view->name()));
  args.set("file", utf8(view->name()) + ".png");
  const double time = view->player().time();
  with_recording(*view, [this, args = std::move(args), time,
                         kind = view->what().kind](const std::optional<Handle>& recording) mutable {
    if (recording) {
      args.set("recording", *recording);
      args.set("at", time);
    }
    palette_->open_command(kind + ".render", args);
  });
}

void MainWindow::film() {
  ViewTab* view = current_view();
  if (!view || !(view->recording() || view->run()))
    return desk_.failed(error(ErrorCode::not_found,
                              "no recording or live run moves the current view",
                              "Open a recording, or simulate a motion first."));
  Map args = view->render_arguments();
  args.erase("frames");  // there the folder of the frames
  args.erase("layers");
  const std::vector<std::string>& layers = view->look().layers;
  if (std::any_of(layers.begin(), layers.end(),
                  [](const std::string& layer) { return !layer.starts_with("path"); }))
    statusBar()->showMessage("A film shows trajectories, but no other overlays.", 8000);
  args.set("file", utf8(view->name()) + ".mp4");
  args.set("from", view->player().from());
  args.set("to", view->player().to());
  // Videos have an even number of pixels.
  List size;
  for (const Value& side : list_at(args, "size"))
    size.emplace_back(static_cast<std::int64_t>(side.number()) / 2 * 2);
  args.set("size", std::move(size));
  if (view->what().kind == "world") args.set("world", utf8(view->name()));
  with_recording(*view,
                 [this, args = std::move(args)](const std::optional<Handle>& recording) mutable {
                   if (!recording) return;
                   args.set("id", *recording);
                   palette_->open_command("recording.video", args);
                 });
}

void MainWindow::save_macro() {
  auto* dialog = new QFileDialog(this, "Save the macro", "macro.lua", "Lua scripts (*.lua)");
  dialog->setObjectName("macro_dialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setAcceptMode(QFileDialog::AcceptSave);
  dialog->setDefaultSuffix("lua");
  connect(dialog, &QFileDialog::fileSelected, this, [this](const QString& to) {
    desk_.act("file.write", {{"file", utf8(to)}, {"base64", base64_of(console_->macro())}});
  });
  dialog->open();
}

void MainWindow::run_script() {
  auto* dialog = new QFileDialog(this, "Run script", QString(), "Lua scripts (*.lua)");
  dialog->setObjectName("script_dialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setFileMode(QFileDialog::ExistingFile);
  connect(dialog, &QFileDialog::fileSelected, this, [this](const QString& file) {
    show_panel("console");
    QString quoted = file;
    quoted.replace('\\', "\\\\").replace('"', "\\\"");
    console_->run("dofile(\"" + quoted + "\")");
  });
  dialog->open();
}

void MainWindow::remove_selected() {
  for (const Selected& s : desk_.selection()) {
    if (s.record.kind == "recording" || s.record.kind == "run") {
      desk_.act(s.record.kind + ".remove", {{"id", s.record}});
    } else if (s.path.empty()) {
      desk_.act(s.record.kind + ".remove", {{"id", s.record}},
                [this, record = s.record](const Result<Value>& r) {
                  if (r.ok()) return;
                  desk_.failed(r.error());
                  if (r.error().code == ErrorCode::conflict)
                    navigator_->show_users(record, r.error());
                });
    } else if (s.record.kind == "world") {
      const std::string name = s.path.substr(s.path.find('.') + 1);
      desk_.act("world.remove_member", {{"id", s.record}, {"member", name}});
    } else {
      desk_.failed(error(ErrorCode::unsupported, "this part cannot be deleted in the navigator",
                         "Use the commands of its " + s.record.kind + "."));
    }
  }
}

void MainWindow::duplicate_selected() {
  for (const Selected& s : desk_.selection())
    if (s.path.empty())
      desk_.act(s.record.kind + ".duplicate", {{"id", s.record}}, [this](const Result<Value>& r) {
        if (!r.ok()) return desk_.failed(r.error());
        if (const Handle* h = r->as_handle()) desk_.select({{*h, {}}});
      });
}

void MainWindow::fill_context_menu(QMenu& menu) {
  for (const char* name : {"open_selected", "", "rename", "duplicate", "delete", "", "save",
                           "save_as", "reload", "", "simulate", "run_live", "fly_to_selection",
                           "hide_selection", "isolate_selection", "transparency"}) {
    if (*name == 0) menu.addSeparator();
    else if (QAction* action = actions_.find(name); action && action->isEnabled())
      menu.addAction(action);
  }
}

void MainWindow::zoom_by(double factor) {
  set_theme_and_zoom(theme().is_dark, theme().zoom * factor);
}

void MainWindow::simulate() {
  if (desk_.selection().size() != 1 || desk_.selection().front().record.kind != "world") return;
  const Handle world = desk_.selection().front().record;
  desk_.ask("record.outline", {{"id", world}}, *this, [this, world](const Result<Value>& r) {
    if (!r.ok()) return desk_.failed(r.error());
    std::string robot, trajectory;
    for (const Value& value : list_of(*r)) {
      const Map& group = map_of(value);
      const List& rows = list_at(group, "rows");
      if (rows.empty()) continue;
      if (text_at(group, "group") == "robots") robot = text_at(map_of(rows.front()), "name");
      if (text_at(group, "group") == "trajectories")
        trajectory = text_at(map_of(rows.front()), "name");
    }
    if (robot.empty() || trajectory.empty())
      return desk_.failed(error(ErrorCode::not_found,
                                "the world has no robot with a trajectory to follow",
                                "Add both, or run a task with world.run_task."));
    desk_.start("world.inverse_kinematics",
                {{"id", world}, {"robot", robot}, {"trajectory", trajectory}},
                [this, world](const Result<Value>& made) {
                  if (!made.ok()) return desk_.failed(made.error());
                  open_handle(world);
                  if (const Handle* h = made->as_handle()) open_handle(*h);
                });
  });
}

}  // namespace robomosp::viewer
