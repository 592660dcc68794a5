// SPDX-License-Identifier: GPL-3.0-or-later
// Entries of the menu Run that open the form of a live run, filled in for what is selected or
// shown.
#include <algorithm>
#include <utility>

#include <QMenu>

#include "viewer/desktop/main_window.h"
#include "viewer/desktop/values.h"
#include "viewer/forms/command_palette.h"

namespace robomosp::viewer {
namespace {

constexpr double kDuration = 5;  ///< of physics and dynamics, unless the form gets another [s]

/// The member of a world that refers to a task or program; "" = none.
std::string member_of(const Value& outline, const Handle& record) {
  for (const Value& group : list_of(outline))
    if (text_at(map_of(group), "group") == record.kind + "s")
      for (const Value& row : list_at(map_of(group), "rows"))
        if (handle_at(map_of(row), "refers") == record) return text_at(map_of(row), "name");
  return {};
}

}  // namespace

void MainWindow::make_live_menu(QMenu* menu) {
  QMenu* live = menu->addMenu("Run li&ve");
  live->setObjectName("run_live_menu");
  live->setToolTipsVisible(true);
  actions_
      .add(nullptr, {"run_live", "Run live", "", "", "world.start_run{id = ..., of = ...}"}, {})
      ->setMenu(live);
  actions_.add(live,
               {"run_live_tasks", "&Tasks and programs...", "task", "",
                "world.start_run{id = ..., of = \"tasks\"}"},
               [this](bool) { run_tasks_live(); });
  actions_.add(live,
               {"run_live_physics", "&Physics...", "world", "",
                "world.start_run{id = ..., of = \"physics\"}"},
               [this](bool) {
                 if (const auto world = live_subject(); world && world->kind == "world")
                   open_live_form(*world, "physics", {{"duration", kDuration}});
               });
  actions_.add(live,
               {"run_live_dynamics", "&Dynamics of a robot...", "robot", "",
                "world.start_run{id = ..., of = \"dynamics\"}"},
               [this](bool) {
                 const auto subject = live_subject();
                 if (!subject) return;
                 Map with{{"duration", kDuration}};
                 for (const Selected& s : desk_.selection())
                   if (s.record == *subject && s.path.starts_with("robots."))
                     with.set("robot", s.path.substr(s.path.find('.') + 1));
                 open_live_form(*subject, "dynamics", std::move(with));
               });
}

std::optional<Handle> MainWindow::live_subject() const {
  for (const Selected& s : desk_.selection())
    if (s.record.kind == "world" || s.record.kind == "robot") return s.record;
  const ViewTab* view = current_view();
  if (view && (view->what().kind == "world" || view->what().kind == "robot")) return view->what();
  return std::nullopt;
}

void MainWindow::enable_live() {
  const auto subject = live_subject();
  const bool is_world = subject && subject->kind == "world";
  const Selection& selection = desk_.selection();
  const bool has_task = std::any_of(selection.begin(), selection.end(), [](const Selected& s) {
    return s.record.kind == "task" || s.record.kind == "program";
  });
  actions_.enable("run_live", subject || has_task);
  actions_.enable("run_live_tasks", is_world || has_task);
  actions_.enable("run_live_physics", is_world);
  actions_.enable("run_live_dynamics", subject.has_value());
}

void MainWindow::open_live_form(const Handle& subject, const char* of, Map with) {
  palette_->open_command(subject.kind + ".start_run",
                         {{"id", subject}, {"of", of}, {"with", std::move(with)}});
}

void MainWindow::run_tasks_live() {
  // Members of the world that are selected, and records that are placed in one.
  Map with;
  std::optional<Handle> record;
  for (const Selected& s : desk_.selection()) {
    for (const char* kind : {"task", "program"})
      if (s.record.kind == "world" && s.path.starts_with(kind + std::string("s.")))
        with.set(kind, s.path.substr(s.path.find('.') + 1));
    if (s.record.kind == "task" || s.record.kind == "program") record = s.record;
  }
  if (!record) {
    if (const auto world = live_subject(); world && world->kind == "world")
      open_live_form(*world, "tasks", std::move(with));
    return;
  }
  desk_.ask("document.outline", {}, *this, [this, record = *record](const Result<Value>& r) {
    if (!r.ok()) return desk_.failed(r.error());
    std::vector<Handle> worlds;
    for (const Value& row : list_of(*r))
      if (const auto id = handle_at(map_of(row), "id"); id && id->kind == "world")
        worlds.push_back(*id);
    // The world shown comes first.
    if (const ViewTab* view = current_view())
      if (const auto at = std::find(worlds.begin(), worlds.end(), view->what()); at != worlds.end())
        std::rotate(worlds.begin(), at, at + 1);
    run_in_a_world(record, std::move(worlds));
  });
}

void MainWindow::run_in_a_world(const Handle& record, std::vector<Handle> worlds) {
  if (worlds.empty())
    return desk_.failed(error(ErrorCode::not_found,
                              "no open world has the " + record.kind + " as a member",
                              "Add it to a world with world.add_" + record.kind + " first."));
  const Handle world = worlds.front();
  worlds.erase(worlds.begin());
  desk_.ask("record.outline", {{"id", world}}, *this,
            [this, record, world, worlds = std::move(worlds)](const Result<Value>& r) mutable {
              const std::string member = r.ok() ? member_of(*r, record) : std::string();
              if (member.empty()) return run_in_a_world(record, std::move(worlds));
              open_live_form(world, "tasks", {{record.kind, member}});
            });
}

}  // namespace robomosp::viewer
