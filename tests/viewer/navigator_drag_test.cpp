// SPDX-License-Identifier: GPL-3.0-or-later
// Dragging from the navigator, its kinds and menus, and the stories of the start page.
#include "viewer/window_test.h"

#include <algorithm>
#include <cmath>

#include <QCheckBox>
#include <QDockWidget>
#include <QDragEnterEvent>
#include <QDropEvent>
#include <QElapsedTimer>
#include <QLabel>
#include <QLineEdit>
#include <QMenu>
#include <QMimeData>
#include <QPersistentModelIndex>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QToolButton>

#include "viewer/desktop/dragging.h"
#include "viewer/desktop/start_page.h"
#include "viewer/desktop/stories.h"
#include "viewer/forms/command_palette.h"
#include "viewer/scene/linear.h"

namespace robomosp::viewer {
namespace {

class DragTest : public RoomsTest {
 protected:
  Handle cell() {
    const Handle world = made("world.create", {{"name", "cell"}});
    const Handle floor = made(
        "solid.create",
        {{"name", "plate"}, {"root", Map{{"kind", "box"}, {"x", 2.0}, {"y", 2.0}, {"z", 0.01}}}});
    called("world.add_object",
           {{"id", world}, {"what", floor}, {"name", "plate"}, {"position", List{5.0, 5.0, 0.0}}});
    EXPECT_NE(window_->open_view(world, "cell"), nullptr);
    settle();
    window_->current_view()->view_from(Camera::View::isometric);
    window_->current_view()->fit();
    settle();
    return world;
  }
  /// Sends the events of a drag from rows of the tree to a place of a widget.
  void drop(const QModelIndexList& rows, QWidget& target, QPoint at) {
    std::unique_ptr<QMimeData> data(tree().model()->mimeData(rows));
    ASSERT_NE(data, nullptr);
    QDragEnterEvent enter(at, Qt::CopyAction, data.get(), Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(&target, &enter);
    QDragMoveEvent move(at, Qt::CopyAction, data.get(), Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(&target, &move);
    photo("drag_preview");
    QDropEvent event(at, Qt::CopyAction, data.get(), Qt::LeftButton, Qt::NoModifier);
    QApplication::sendEvent(&target, &event);
    settle();
  }
  bool may_drop(const QModelIndex& row, const QModelIndex& parent, int at) {
    std::unique_ptr<QMimeData> data(tree().model()->mimeData({row}));
    return tree().model()->canDropMimeData(data.get(), Qt::CopyAction, at, at < 0 ? -1 : 0, parent);
  }
  void drop_on_row(const QModelIndex& row, const QModelIndex& parent, int at) {
    std::unique_ptr<QMimeData> data(tree().model()->mimeData({row}));
    EXPECT_TRUE(
        tree().model()->dropMimeData(data.get(), Qt::CopyAction, at, at < 0 ? -1 : 0, parent));
    settle();
  }
  std::string texts(const QModelIndex& parent) {
    std::string out;
    for (int i = 0; i < tree().model()->rowCount(parent); ++i)
      out += utf8(tree().model()->index(i, 0, parent).data().toString()) + ";";
    return out;
  }
};

TEST_F(DragTest, ARobotOfTheLibraryIsPlacedWhereTheRayMeetsTheFloor) {
  const Handle world = cell();
  ViewTab& view = *window_->current_view();
  const std::size_t before = list_at(map_of(called("document.history", {})), "undo").size();
  const QModelIndex puma = row({"Library", "Robots", "puma560"});
  ASSERT_TRUE(puma.isValid());
  EXPECT_TRUE(tree().model()->flags(puma).testFlag(Qt::ItemIsDragEnabled));
  // A pixel of the floor: its ray, cut with z = 0 by hand.
  const double ratio = view.devicePixelRatioF();
  const QPoint in_display(view.display().width() / 2, view.display().height() - 12);
  ASSERT_FALSE(view.display().pick(in_display));
  const Ray ray = view.display().camera().ray(in_display.x() * ratio, in_display.y() * ratio);
  const double s = -ray.origin[2] / ray.direction[2];
  drop({puma}, view, view.display().mapTo(&view, in_display));
  ASSERT_TRUE(until([&] { return !list_of(called("world.robots", {{"id", world}})).empty(); }));
  const Value robots = called("world.robots", {{"id", world}});
  const Map& placed = map_of(list_of(robots).front());
  EXPECT_EQ(text_at(placed, "name"), "puma560");
  const Value* placement = placed.find("placement");
  ASSERT_NE(placement, nullptr);
  const Value* position = map_of(*placement).find("position");
  ASSERT_NE(position, nullptr);
  const NumericArray* p = position->as_array();
  ASSERT_NE(p, nullptr);
  EXPECT_NEAR((*p)[0], ray.origin[0] + s * ray.direction[0], 6e-4);
  EXPECT_NEAR((*p)[1], ray.origin[1] + s * ray.direction[1], 6e-4);
  EXPECT_EQ((*p)[2], 0);
  // One step to undo, one line in the console.
  EXPECT_EQ(list_at(map_of(called("document.history", {})), "undo").size(), before + 1);
  EXPECT_TRUE(window_->console().text().contains("world.add_robot{"));
  called("document.undo", {});
  EXPECT_TRUE(list_of(called("world.robots", {{"id", world}})).empty());
}

TEST_F(DragTest, ADropOfSeveralRowsIsOneStepWithALineForEach) {
  const Handle world = cell();
  const std::size_t before = list_at(map_of(called("document.history", {})), "undo").size();
  std::vector<std::string> lines;
  desk_->acted.add(window_.get(), [&](const std::string& line) { lines.push_back(line); });
  ViewTab& view = *window_->current_view();
  const QModelIndexList rows{row({"Library", "Robots", "puma560"}),
                             row({"Library", "Objects", "table"}), row({"Solids", "plate"})};
  drop(rows, view,
       view.display().mapTo(&view,
                            QPoint(view.display().width() / 2, view.display().height() - 12)));
  const auto members = [&] {
    return list_of(called("world.robots", {{"id", world}})).size() +
           list_of(called("world.objects", {{"id", world}})).size();
  };
  ASSERT_TRUE(until([&] { return members() == 4; })) << members();
  settle();
  EXPECT_EQ(list_at(map_of(called("document.history", {})), "undo").size(), before + 1);
  EXPECT_EQ(desk_->selection().size(), 3U);
  EXPECT_EQ(std::count_if(lines.begin(), lines.end(),
                          [](const std::string& line) { return line.starts_with("world.add_"); }),
            3);
  called("document.undo", {});
  EXPECT_EQ(members(), 1U);
}

TEST_F(DragTest, ADropOnOneOfFourViewsMeetsTheFloorThere) {
  const Handle world = cell();
  ViewTab& view = *window_->current_view();
  ViewLook look = view.look();
  look.has_four_views = true;
  view.set_look(look);
  settle();
  Display& display = view.display();
  ASSERT_TRUE(display.has_four_view());
  display.activate_pane(1);  // the perspective one, at the upper right
  const double ratio = view.devicePixelRatioF();
  // A place near the border of the view from the top, at the upper left.
  const QPoint at(24, display.height() / 2 - 24);
  ASSERT_EQ(display.pane_at(at), 0U);
  drop({row({"Library", "Robots", "puma560"})}, view, display.mapTo(&view, at));
  EXPECT_EQ(display.active_pane(), 0U);
  ASSERT_TRUE(until([&] { return !list_of(called("world.robots", {{"id", world}})).empty(); }));
  const Value robots = called("world.robots", {{"id", world}});
  const auto p = vec_at(map_at(map_of(list_of(robots).front()), "placement"), "position");
  ASSERT_TRUE(p.has_value());
  // The ray of that view, which looks straight down, cut with z = 0 by hand.
  ASSERT_EQ(display.pane_origin(), QPointF());
  const Ray ray = display.camera().ray(at.x() * ratio, at.y() * ratio);
  EXPECT_NEAR(ray.direction[2], -1, 1e-6);
  EXPECT_NEAR((*p)[0], ray.origin[0], 6e-4);
  EXPECT_NEAR((*p)[1], ray.origin[1], 6e-4);
  EXPECT_EQ((*p)[2], 0);
}

TEST_F(DragTest, NoAnswerReachesAPanelThatIsGone) {
  auto panel = std::make_unique<QObject>();
  bool is_answered = false, has_answered = false;
  desk_->ask("world.list", {}, *panel, [&](const Result<Value>&) { is_answered = true; });
  desk_->ask("world.list", {}, *window_, [&](const Result<Value>&) { has_answered = true; });
  panel.reset();
  EXPECT_TRUE(until([&] { return has_answered; }));
  EXPECT_FALSE(is_answered);
}

TEST_F(DragTest, WhatHasNoPlaceIsRefusedInWords) {
  cell();
  ViewTab& view = *window_->current_view();
  const Handle brass = made("material.create", {{"name", "brass"}, {"density", 8500}});
  settle();
  drop({row({"Materials", "brass"})}, view, {200, 200});
  EXPECT_TRUE(called("world.describe", {{"id", view.what()}}).as_map() != nullptr);
  bool is_said = false;
  for (int i = 0; i < window_->messages().model().rowCount({}); ++i)
    is_said = is_said || window_->messages().model().index(i).data().toString().contains(
                             "material has no place in a world");
  EXPECT_TRUE(is_said);
  // A robot alone is no world.
  const Handle arm = made("robot.create", {{"name", "arm"}, {"links", List{Map{{"a", 0.3}}}}});
  ASSERT_NE(window_->open_view(arm, "arm"), nullptr);
  settle();
  drop({row({"Robots", "arm"})}, *window_->current_view(), {200, 200});
  EXPECT_TRUE(brass.number > 0);
}

TEST_F(DragTest, ARowOfTheLibraryBecomesAMemberOfAWorldRow) {
  const Handle world = cell();
  const QModelIndex table = row({"Library", "Objects", "table"});
  ASSERT_TRUE(table.isValid());
  EXPECT_TRUE(may_drop(table, row({"cell"}), -1));
  EXPECT_FALSE(may_drop(table, row({"Library"}), -1));
  EXPECT_FALSE(may_drop(row({"Library", "Materials", "brass"}), row({"cell"}), -1));
  drop_on_row(table, row({"cell"}), -1);
  drop_on_row(row({"Library", "Objects", "table"}), row({"cell"}), -1);
  ASSERT_TRUE(until([&] { return list_of(called("world.objects", {{"id", world}})).size() == 3; }));
}

TEST_F(DragTest, ARowIsLuaWhereItIsDropped) {
  const Handle world = cell();
  std::unique_ptr<QMimeData> whole(tree().model()->mimeData({row({"cell"})}));
  EXPECT_EQ(whole->text(), "world(\"cell\")");
  std::unique_ptr<QMimeData> shipped(
      tree().model()->mimeData({row({"Library", "Robots", "puma560"})}));
  EXPECT_EQ(shipped->text(), "robot.get(\"puma560\")");
  EXPECT_EQ(dragged_rows(shipped.get()).front().name, "puma560");
  EXPECT_TRUE(dragged_rows(shipped.get()).front().is_shipped());
  EXPECT_EQ(dragged_rows(whole.get()).front().record, world);
  EXPECT_EQ(lua_of({"world", "a \"b\"", world, ""}), "world(\"a \\\"b\\\"\")");
  EXPECT_EQ(lua_of({"object", "plate", world, "objects.plate"}), "\"plate\"");
  // The console takes it as text.
  QPlainTextEdit& input = window_->console().input();
  QDropEvent event(QPoint(5, 5), Qt::CopyAction, whole.get(), Qt::LeftButton, Qt::NoModifier);
  QDragEnterEvent enter(QPoint(5, 5), Qt::CopyAction, whole.get(), Qt::LeftButton, Qt::NoModifier);
  QApplication::sendEvent(input.viewport(), &enter);
  QApplication::sendEvent(input.viewport(), &event);
  EXPECT_TRUE(input.toPlainText().contains("world(\"cell\")"));
}

TEST_F(DragTest, StepsSegmentsAndNodesAreReordered) {
  const auto wait = [](double s) { return Map{{"step", "wait"}, {"time", s}}; };
  made("task.create",
       {{"name", "job"},
        {"steps",
         List{wait(1), Map{{"step", "repeat"}, {"count", 2}, {"steps", List{wait(2)}}}, wait(3)}}});
  settle();
  const QPersistentModelIndex task = row({"Tasks", "job"});
  ASSERT_TRUE(task.isValid());
  tree().expand(task);
  ASSERT_TRUE(until([&] { return tree().model()->rowCount(task) == 3; }));
  const auto times = [&] {
    std::string out;
    const Value steps = called("task.steps", {{"id", "job"}});
    for (const Value& v : list_of(steps))
      out += text_at(map_of(v), "step") + std::to_string(whole_at(map_of(v), "time")) + "/" +
             std::to_string(whole_at(map_of(v), "parent")) + ";";
    return out;
  };
  EXPECT_EQ(times(), "wait1/0;repeat0/0;wait2/2;wait3/0;");
  const auto step = [&](int i) { return tree().model()->index(i, 0, row({"Tasks", "job"})); };
  // The last one before the first; the first to the end; one into the block.
  drop_on_row(step(2), row({"Tasks", "job"}), 0);
  EXPECT_EQ(times(), "wait3/0;wait1/0;repeat0/0;wait2/3;");
  drop_on_row(step(0), row({"Tasks", "job"}), 3);
  EXPECT_EQ(times(), "wait1/0;repeat0/0;wait2/2;wait3/0;");
  drop_on_row(step(2), step(1), 1);
  EXPECT_EQ(times(), "wait1/0;repeat0/0;wait2/2;wait3/2;");
  called("document.undo", {});
  EXPECT_EQ(times(), "wait1/0;repeat0/0;wait2/2;wait3/0;");
  EXPECT_FALSE(may_drop(step(1), step(1), -1));

  made(
      "solid.create",
      {{"name", "body"},
       {"root", Map{{"kind", "difference"},
                    {"name", "cut"},
                    {"children",
                     List{Map{{"kind", "box"}, {"name", "one"}, {"x", 1}, {"y", 1}, {"z", 1}},
                          Map{{"kind", "box"}, {"name", "two"}, {"x", 1}, {"y", 1}, {"z", 2}}}}}}});
  settle();
  const QPersistentModelIndex cut = row({"Solids", "body", "cut"});
  ASSERT_TRUE(cut.isValid());
  ASSERT_TRUE(until([&] { return tree().model()->rowCount(cut) == 2; }));
  drop_on_row(tree().model()->index(1, 0, cut), cut, 0);
  ASSERT_TRUE(until([&] {
    return texts(row({"Solids", "body", "cut"})) == "two;one;";
  })) << texts(row({"Solids", "body", "cut"}));
}

TEST_F(DragTest, KindsAreFilteredByTheMenu) {
  cell();
  made("robot.create", {{"name", "arm"}, {"links", List{Map{{"a", 0.3}}}}});
  settle();
  auto* kinds = widget<QToolButton>("navigator_kinds");
  QAction* robots = nullptr;
  for (QAction* a : kinds->menu()->actions())
    if (a->objectName() == "kind_robot") robots = a;
  ASSERT_NE(robots, nullptr);
  robots->setChecked(true);
  settle();
  EXPECT_TRUE(until([&] { return !row({"Robots", "arm"}).data().isNull(); }));
  for (int i = 0; i < tree().model()->rowCount(); ++i)
    EXPECT_NE(tree().model()->index(i, 0).data().toString(), "Solids");
  EXPECT_TRUE(kinds->toolTip().contains("robot"));
  kinds->menu()->actions().front()->trigger();
  EXPECT_TRUE(row({"Solids", "plate"}).isValid());
  EXPECT_FALSE(robots->isChecked());
  // The way to the library leads there also while its rows are filtered out.
  auto* signal_kind = kinds->menu()->findChild<QAction*>("kind_signal");
  ASSERT_NE(signal_kind, nullptr);
  signal_kind->setChecked(true);
  settle();
  EXPECT_EQ(texts({}).find("Library"), std::string::npos) << texts({});
  window_->navigator().open_library();
  EXPECT_EQ(tree().currentIndex().data().toString(), "Library");
  EXPECT_FALSE(signal_kind->isChecked());
}

TEST_F(DragTest, ARefusedDeleteNamesTheUsersAndLeadsThere) {
  const Handle world = cell();
  const QModelIndex plate = row({"Solids", "plate"});
  ASSERT_TRUE(plate.isValid());
  tree().setCurrentIndex(plate);
  action("delete")->trigger();
  auto* users = widget<QLabel>("navigator_users");
  ASSERT_TRUE(until([&] { return users->isVisible() && users->text().contains("is used by"); }));
  EXPECT_TRUE(users->text().contains(">cell</a>"));
  photo("navigator_users");
  Q_EMIT users->linkActivated(QString("world#%1").arg(world.number));
  ASSERT_EQ(desk_->selection().size(), 1U);
  EXPECT_EQ(desk_->selection().front().record, world);
  Q_EMIT users->linkActivated("close");
  EXPECT_FALSE(users->isVisible());
}

/// Every kind of record, and the acts of the context menu on it.
TEST_F(DragTest, EveryKindIsRenamedDuplicatedSavedReloadedAndDeleted) {
  const Map solid{{"name", "one"}, {"root", Map{{"kind", "box"}, {"x", 1}, {"y", 1}, {"z", 1}}}};
  const std::pair<const char*, Map> kinds[] = {
      {"world", {{"name", "one"}}},
      {"robot", {{"name", "one"}, {"links", List{Map{{"a", 0.3}}}}}},
      {"solid", solid},
      {"object", {{"name", "one"}, {"parts", List{Map{{"what", "one"}}}}}},
      {"material", {{"name", "one"}, {"density", 1000}}},
      {"trajectory",
       {{"name", "one"},
        {"segments", List{Map{{"shape", "line"},
                              {"points", List{List{0.5, 0.0, 0.3, 0.0, 0.0, 0.0},
                                              List{0.5, 0.2, 0.3, 0.0, 0.0, 0.0}}}}}}}},
      {"task", {{"name", "one"}, {"steps", List{Map{{"step", "wait"}, {"time", 1}}}}}},
      {"program", {{"name", "one"}, {"source", "PROGRAM one;\nBEGIN\nENDPROGRAM;\n"}}}};
  for (const auto& [kind, fields] : kinds) {
    SCOPED_TRACE(kind);
    app().document.clear();
    settle();
    if (std::string(kind) == "object") made("solid.create", solid);
    const Handle id = made(std::string(kind) + ".create", fields);
    settle();
    desk_->select({{id, {}}});
    settle();
    for (const char* name :
         {"open_selected", "rename", "duplicate", "delete", "save", "save_as", "reload"})
      EXPECT_TRUE(action(name)->isEnabled()) << name;
    const QString ending =
        shown(text_at(map_of(called("record.schema", {{"kind", kind}})), "extension"));
    const QString file = folder_.filePath(QString(kind) + "_one" + ending);
    called("record.save", {{"id", id}, {"file", utf8(file)}});
    settle();
    const auto rows = window_->navigator().model().rows_of({id, {}});
    ASSERT_FALSE(rows.isEmpty());
    EXPECT_TRUE(window_->navigator().model().setData(rows.front(), "two", Qt::EditRole) == false);
    settle();
    EXPECT_TRUE(until([&] {
      return text_at(map_of(called("record.describe", {{"id", id}})), "name") == "two";
    }));
    action("save")->trigger();
    settle();
    EXPECT_TRUE(list_of(called("document.unsaved", {})).size() <= 1);
    action("reload")->trigger();
    settle();
    action("open_selected")->trigger();
    settle();
    desk_->select({{id, {}}});
    action("duplicate")->trigger();
    settle();
    EXPECT_TRUE(until([&] {
      return !desk_->selection().empty() && desk_->selection().front().record != id &&
             desk_->selection().front().record.kind == kind;
    }));
    action("delete")->trigger();
    settle();
    desk_->select({{id, {}}});
    action("delete")->trigger();
    settle();
    EXPECT_TRUE(list_of(called(std::string(kind) + ".list", {})).empty());
  }
}

// --- stories ---------------------------------------------------------------------------------

class StoryTest : public DragTest {
 protected:
  void begin(const char* story) {
    window_->resize(1920, 1000);  // a narrow start page has no room for stories
    window_->show_start();
    settle();
    click(QString("story_begin_") + story);
    ASSERT_TRUE(until([&] { return window_->story().story() != nullptr; }));
    settle();
    ASSERT_TRUE(widget<QDockWidget>("story_dock")->isVisible());
    EXPECT_EQ(window_->story().done(), 0U);
  }
  /// Does each step by its button, and sees its tick, and no other.
  void show_all(const char* photo_name) {
    const Story& story = *window_->story().story();
    for (std::size_t i = 0; i < story.steps.size(); ++i) {
      SCOPED_TRACE(story.steps[i].title.toStdString());
      EXPECT_FALSE(window_->story().is_done(i));
      EXPECT_EQ(window_->story().current(), i);
      QPushButton* show = nullptr;
      for (QPushButton* each :
           widget("story")->findChildren<QPushButton*>(QString("story_show_%1").arg(i + 1)))
        if (each->isVisible()) show = each;
      ASSERT_NE(show, nullptr);
      QTest::mouseClick(show, Qt::LeftButton);
      EXPECT_TRUE(until([&] { return window_->story().is_done(i); }))
          << window_->console().text().right(600).toStdString();
      settle();
      EXPECT_EQ(window_->story().done(), i + 1);
      if (i == 1) photo(photo_name);
    }
  }
};

TEST_F(StoryTest, ARobotMovesIsTickedByWhatIsDone) {
  begin("moves");
  show_all("story_moves");
  // The ticks are on the card of the start page, and kept.
  window_->show_start();
  settle();
  EXPECT_EQ(widget<QLabel>("story_card_count_moves")->text(), "4 of 4 steps");
  photo("start_stories");
}

TEST_F(StoryTest, FromASolidToATorqueIsTickedByWhatIsDone) {
  begin("solid");
  show_all("story_solid");
}

TEST_F(StoryTest, AProgramForTheControllerIsTickedByWhatIsDone) {
  begin("program");
  show_all("story_program");
}

TEST_F(StoryTest, NoStepIsTickedByItselfOrByWhatFailed) {
  made("solid.create", {{"name", "old"},
                        {"parameters", Map{{"bore", "50 mm"}}},
                        {"root", Map{{"kind", "box"}, {"x", 1}, {"y", 1}, {"z", 1}}}});
  begin("solid");
  QTest::qWait(500);
  EXPECT_EQ(window_->story().done(), 0U);
  window_->console().run("robot.gravity_torques{id = \"no_such_robot\", q = {}}");
  window_->console().run("document.undo()");
  settle();
  EXPECT_EQ(window_->story().done(), 0U);
  // The same by hand, without the buttons of the story.
  window_->console().run(
      "solid.create{name = \"mine\", parameters = {bore = \"30 mm\"}, root = {kind = \"box\", x = "
      "\"bore\", y = 1, z = 1}}");
  EXPECT_TRUE(until([&] { return window_->story().is_done(0); }));
  EXPECT_FALSE(window_->story().is_done(1));
  window_->console().run("solid.set_parameter{id = \"mine\", name = \"bore\", value = \"41 mm\"}");
  settle();
  EXPECT_FALSE(window_->story().is_done(1));
  window_->console().run("solid.set_parameter{id = \"mine\", name = \"bore\", value = \"42 mm\"}");
  EXPECT_TRUE(until([&] { return window_->story().is_done(1); }));
  click("story_leave");
  EXPECT_EQ(window_->story().story(), nullptr);
  EXPECT_FALSE(widget<QDockWidget>("story_dock")->isVisible());
  // It continues with its ticks.
  window_->show_start();
  settle();
  EXPECT_EQ(widget<QPushButton>("story_begin_solid")->text(), "Continue");
  click("story_begin_solid");
  EXPECT_TRUE(until([&] { return window_->story().done() == 2; }));
}

TEST_F(StoryTest, TheStartPageCountsWhatThereIsAndCanBeHidden) {
  window_->show_start();
  settle();
  EXPECT_EQ(widget<QLabel>("start_commands_count")->text(),
            QString("%1, each with an example").arg(app().commands.list().size()));
  click("start_examples");
  EXPECT_TRUE(widget<QDockWidget>("help_dock")->isVisible());
  window_->show_start();
  settle();
  widget<QCheckBox>("start_at_start")->setChecked(false);
  window_->close_now();
  window_.reset();
  show_window();
  EXPECT_EQ(window_->findChild<QWidget*>("start"), nullptr);
}

}  // namespace
}  // namespace robomosp::viewer
