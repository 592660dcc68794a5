// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/gizmo/tool_bar.h"

#include <cmath>
#include <numbers>

#include <QActionGroup>
#include <QMenu>
#include <QToolBar>
#include <QToolButton>

#include "viewer/desktop/actions.h"
#include "viewer/desktop/desk.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/values.h"
#include "viewer/gizmo/view_tools.h"
#include "viewer/theme/icons.h"

namespace robomosp::viewer {
namespace {

struct ToolEntry {
  const char *name, *text, *icon, *keys;
  Tool tool;
};
constexpr ToolEntry kTools[] = {
    {"tool_select", "&Select", "cursor", "Q", Tool::select},
    {"tool_move", "&Move", "move", "W", Tool::move},
    {"tool_turn", "&Turn", "rotate", "E", Tool::turn},
    {"tool_measure", "M&easure", "measure", "M", Tool::measure},
};

struct SnapEntry {
  const char *name, *text, *word;
  bool ToolSettings::*flag;
};
constexpr SnapEntry kSnaps[] = {
    {"snap_grid", "&Grid", "grid", &ToolSettings::snaps_grid},
    {"snap_vertex", "&Vertex", "vertex", &ToolSettings::snaps_vertex},
    {"snap_edge", "&Edge", "edge", &ToolSettings::snaps_edge},
    {"snap_face", "&Face", "face", &ToolSettings::snaps_face},
    {"snap_axis", "&Centre and axis", "centre", &ToolSettings::snaps_axis},
};
constexpr int kGridsMm[] = {1, 5, 10, 50, 100};
constexpr int kStepsDeg[] = {5, 15, 45};

QString snap_text(const ToolSettings& tools) {
  QStringList words;
  for (const SnapEntry& each : kSnaps)
    if (tools.*each.flag) words += each.word;
  QString text = words.isEmpty() ? QString("Angles only") : words.join(", ");
  text[0] = text[0].toUpper();
  return text;
}

QString axes_text(const ToolSettings& tools) {
  switch (tools.axes) {
    case ToolAxes::own: return "Own axes";
    case ToolAxes::parent: return "Parent axes";
    case ToolAxes::frame: return "Axes of " + shown(tools.frame);
    case ToolAxes::world: break;
  }
  return "World axes";
}

/// Transparency levels in the menu [%].
constexpr int kFadedBy[] = {0, 25, 50, 75, 90};

void add_fading(MainWindow& window, Actions& actions, QMenu& menu) {
  QMenu* fading = menu.addMenu("&Transparency of the selection");
  fading->setObjectName("transparency_menu");
  fading->setToolTipsVisible(true);
  actions
      .add(nullptr,
           {"transparency", "Transparency", "", "",
            "window.fade_member{record = ..., member = ..., opacity = 0.5}"},
           {})
      ->setMenu(fading);
  auto* group = new QActionGroup(&window);
  for (const int by : kFadedBy) {
    const std::string name = "transparency_" + std::to_string(by),
                      text = by == 0 ? std::string("&None") : std::to_string(by) + " %";
    group->addAction(actions.add(fading, {name.c_str(), text.c_str(), "", "", "", true, false},
                                 [&window, by](bool) {
                                   if (ViewTab* view = window.current_view())
                                     view->fade_selection(1 - by / 100.0);
                                 }));
  }
  QObject::connect(fading, &QMenu::aboutToShow, &window, [&window, &actions] {
    const ViewTab* view = window.current_view();
    const Selection& selection = window.desk().selection();
    const double now = view && !selection.empty() ? view->opacity_of(selection.front()) : 1;
    for (const int by : kFadedBy)
      actions.check("transparency_" + std::to_string(by), std::fabs(1 - by / 100.0 - now) < 1e-6);
  });
}

}  // namespace

void add_tool_actions(MainWindow& window, Actions& actions, QMenu& menu) {
  Desk* const desk = &window.desk();
  const auto change = [desk](auto set) {
    return [desk, set](bool on) {
      set(desk->tools, on);
      desk->tools.changed();
    };
  };
  auto* tools = new QActionGroup(&window);
  for (const ToolEntry& each : kTools)
    tools->addAction(actions.add(
        &menu, {each.name, each.text, each.icon, each.keys, trigger_line(each.name).c_str(), true},
        change([tool = each.tool](ToolSettings& t, bool) { t.tool = tool; })));
  menu.addSeparator();
  const auto begin = [&window](GizmoMode mode) {
    return [&window, mode](bool) {
      if (ViewTab* view = window.current_view()) view->tools().begin_by_key(mode);
    };
  };
  actions.add(&menu,
              {"move_selection", "Move the se&lection", "", "G",
               "record.set{id = ..., path = ..., value = ...}"},
              begin(GizmoMode::move));
  actions.add(&menu,
              {"turn_selection", "T&urn the selection", "", "R",
               "record.set{id = ..., path = ..., value = ...}"},
              begin(GizmoMode::turn));
  menu.addSeparator();
  const auto on_view = [&window](void (ViewTab::*act)()) {
    return [&window, act](bool) {
      if (ViewTab* view = window.current_view()) (view->*act)();
    };
  };
  actions.add(&menu, {"hide_selection", "&Hide the selection", "hidden", "H", "", false, false},
              on_view(&ViewTab::hide_selection));
  actions.add(&menu,
              {"isolate_selection", "Hide all &but the selection", "", "Shift+H", "", false, false},
              on_view(&ViewTab::isolate_selection));
  actions.add(&menu, {"show_all", "Sh&ow all", "eye", "", "", false, false},
              on_view(&ViewTab::show_all));
  add_fading(window, actions, menu);
  menu.addSeparator();
  actions.add(&menu, {"snap", "Ma&gnet", "snap", "S", trigger_line("snap").c_str(), true},
              change([](ToolSettings& t, bool on) { t.is_snapping = on; }));
  QMenu* snaps = menu.addMenu("Snap t&o");
  snaps->setObjectName("snap_menu");
  snaps->setToolTipsVisible(true);
  actions.add(nullptr, {"snap_kinds", "Snap to", "", "", trigger_line("snap_vertex").c_str()}, {})
      ->setMenu(snaps);
  for (const SnapEntry& each : kSnaps)
    actions.add(snaps, {each.name, each.text, "", "", trigger_line(each.name).c_str(), true},
                change([flag = each.flag](ToolSettings& t, bool on) { t.*flag = on; }));
  snaps->addSeparator();
  auto* grids = new QActionGroup(&window);
  for (const int mm : kGridsMm) {
    const std::string name = "grid_" + std::to_string(mm),
                      text = "Grid of " + std::to_string(mm) + " mm";
    grids->addAction(
        actions.add(snaps, {name.c_str(), text.c_str(), "", "", trigger_line(name).c_str(), true},
                    change([mm](ToolSettings& t, bool) { t.grid = mm / 1000.0; })));
  }
  snaps->addSeparator();
  auto* steps = new QActionGroup(&window);
  for (const int deg : kStepsDeg) {
    const std::string name = "angle_" + std::to_string(deg),
                      text = "Turn by " + std::to_string(deg) + " degrees";
    steps->addAction(actions.add(
        snaps, {name.c_str(), text.c_str(), "", "", trigger_line(name).c_str(), true},
        change([deg](ToolSettings& t, bool) { t.angle = deg * std::numbers::pi / 180; })));
  }
  QMenu* axes = menu.addMenu("A&xes");
  axes->setObjectName("axes_menu");
  axes->setToolTipsVisible(true);
  actions.add(nullptr, {"tool_axes", "Axes", "frame", "", trigger_line("axes_world").c_str()}, {})
      ->setMenu(axes);
  struct AxesEntry {
    const char *name, *text;
    ToolAxes axes;
  };
  auto* kinds = new QActionGroup(&window);
  for (const AxesEntry& each : {AxesEntry{"axes_world", "&World", ToolAxes::world},
                                AxesEntry{"axes_own", "&Own, of the selection", ToolAxes::own},
                                AxesEntry{"axes_parent", "&Parent's", ToolAxes::parent}})
    kinds->addAction(
        actions.add(axes, {each.name, each.text, "", "", trigger_line(each.name).c_str(), true},
                    change([a = each.axes](ToolSettings& t, bool) { t.axes = a; })));
  axes->addSeparator();
  // Frames of the world shown, as they are when the menu opens.
  QObject::connect(axes, &QMenu::aboutToShow, &window, [&window, axes, desk] {
    for (QAction* action : axes->actions())
      if (action->property("frame").isValid()) {
        axes->removeAction(action);
        action->deleteLater();
      }
    ViewTab* view = window.current_view();
    const auto picture = view ? view->live().picture() : nullptr;
    if (!picture || !picture->frame) return;
    for (const scene::MemberPtr& m : picture->frame->frames) {
      const QString name = shown(m->name);
      QAction* action = axes->addAction("Frame " + name);
      action->setProperty("frame", name);
      action->setCheckable(true);
      action->setChecked(desk->tools.axes == ToolAxes::frame && desk->tools.frame == m->name);
      action->setToolTip("Axes of the frame " + name);
      QObject::connect(action, &QAction::triggered, &window, [desk, name] {
        desk->tools.axes = ToolAxes::frame;
        desk->tools.frame = utf8(name);
        desk->tools.changed();
      });
    }
  });
  const auto show = [desk, &actions] {
    const ToolSettings& t = desk->tools;
    for (const ToolEntry& each : kTools) actions.check(each.name, t.tool == each.tool);
    for (const SnapEntry& each : kSnaps) actions.check(each.name, t.*each.flag);
    actions.check("snap", t.is_snapping);
    for (const int mm : kGridsMm)
      actions.check("grid_" + std::to_string(mm), std::fabs(t.grid - mm / 1000.0) < 1e-9);
    for (const int deg : kStepsDeg)
      actions.check("angle_" + std::to_string(deg),
                    std::fabs(t.angle - deg * std::numbers::pi / 180) < 1e-9);
    actions.check("axes_world", t.axes == ToolAxes::world);
    actions.check("axes_own", t.axes == ToolAxes::own);
    actions.check("axes_parent", t.axes == ToolAxes::parent);
  };
  desk->tools.changed.add(&window, show);
  show();
}

void add_tool_buttons(Desk& desk, const Actions& actions, QToolBar& bar) {
  const auto add = [&](const char* name) {
    QAction* action = actions.find(name);
    if (!action) return;
    bar.addAction(action);
    if (QWidget* button = bar.widgetForAction(action)) {
      button->setObjectName(QString("bar_") + name);
      button->setAccessibleName(action->text().remove('&'));
      button->setFocusPolicy(Qt::TabFocus);
    }
  };
  const auto add_menu_button = [&](const char* name, const char* accessible) -> QToolButton* {
    QAction* entry = actions.find(name);
    if (!entry) return nullptr;
    auto* button = new QToolButton;
    button->setObjectName(QString("bar_") + name);
    button->setAccessibleName(accessible);
    button->setToolTip(entry->toolTip());
    button->setToolButtonStyle(Qt::ToolButtonTextOnly);
    button->setPopupMode(QToolButton::InstantPopup);
    button->setMenu(entry->menu());
    button->setFocusPolicy(Qt::TabFocus);
    bar.addWidget(button);
    return button;
  };
  for (const char* name : {"tool_select", "tool_move", "tool_turn"}) add(name);
  bar.addSeparator();
  add("snap");
  QToolButton* kinds = add_menu_button("snap_kinds", "What the magnet snaps to");
  QToolButton* axes = add_menu_button("tool_axes", "Axes of the tools");
  bar.addSeparator();
  add("tool_measure");
  bar.addSeparator();
  const auto show = [&desk, kinds, axes] {
    if (kinds) kinds->setText(snap_text(desk.tools));
    if (axes) axes->setText(axes_text(desk.tools));
  };
  desk.tools.changed.add(&bar, show);
  show();
}

}  // namespace robomosp::viewer
