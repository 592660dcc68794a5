// SPDX-License-Identifier: GPL-3.0-or-later
// The sections of the properties, the palette in its dock, tables of results, and what keyboard and
// eyes need of the whole window. ROBOMOSP_PHOTOS=FOLDER keeps the pictures.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <QAbstractButton>
#include <QApplication>
#include <QClipboard>
#include <QDockWidget>
#include <QElapsedTimer>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QListView>
#include <QMouseEvent>
#include <QPushButton>
#include <QTableView>
#include <QTemporaryDir>
#include <QTest>
#include <QToolButton>
#include <QTreeView>

#include <gtest/gtest.h>

#include "docs/examples.h"
#include "lua/lua_state.h"
#include "viewer/desktop/desk.h"
#include "viewer/desktop/main_window.h"
#include "viewer/forms/command_form.h"
#include "viewer/forms/command_palette.h"
#include "viewer/forms/properties_panel.h"
#include "viewer/forms/record_sections.h"
#include "viewer/forms/result_view.h"
#include "viewer/forms/schema_form.h"
#include "viewer/theme/theme.h"
#include "viewer/widgets/gauge.h"
#include "viewer/widgets/number_fields.h"

namespace robomosp::viewer {
namespace {

ioci::Application& program() { return test::examples_app(); }

bool wait_for(const std::function<bool()>& done, int ms = 60000) {
  return QTest::qWaitFor([&] { return done(); }, ms);
}

void keep_picture(QWidget& w, const std::string& name) {
  const char* folder = std::getenv("ROBOMOSP_PHOTOS");
  if (folder) w.grab().save(QString("%1/%2.png").arg(folder, QString::fromStdString(name)));
}

class Window : public testing::Test {
 protected:
  void SetUp() override {
    program().document.clear();
    run_lua(
        "material.create{name = \"steel\", density = 7850, colour = \"#b0b4b8\"}\n"
        "solid.create{name = \"bush\", material = \"steel\", parameters = {bore = \"20 mm\"}, root "
        "= {kind = \"difference\", name = \"body\", children = {{kind = \"cylinder\", name = "
        "\"outer\", radius = 0.03, height = 0.03}, {kind = \"cylinder\", name = \"hole\", radius "
        "= 0.01, height = 0.04}}}}\n"
        "local arm = robot.create{name = \"arm\", links = {{name = \"a1\", a = 0.3, lower = -2, "
        "upper = 2, max_velocity = 2, mass = 2, com = {-0.15, 0, 0}, inertia = {0.01, 0.02, 0.02, "
        "0, 0, 0}, parts = {{what = \"bush\"}}}, {name = \"a2\", a = 0.2, lower = -2, upper = 2, "
        "mass = 1, com = {-0.1, 0, 0}, inertia = {0.01, 0.01, 0.01, 0, 0, 0}}}}\n"
        "trajectory.create{name = \"swing\", sample_time = 0.05, segments = {{shape = \"line\", "
        "points = {{0.5, 0, 0.3, 0, 0, 0}, {0.5, 0.2, 0.3, 0, 0, 0}}}}}\n"
        "world.create{name = \"cell\"}:add_robot{robot = arm, name = \"left\"}\n");
    auto desk = Desk::open(program(), {});
    ASSERT_TRUE(desk.ok()) << desk.error().sentence();
    desk_ = std::move(*desk);
    // Most tests need no stills, which take long on software OpenGL.
    Settings(folder_.filePath("desktop.ini")).set_fine_pictures(false);
    window_ = std::make_unique<MainWindow>(
        *desk_, MainWindow::Options{folder_.filePath("desktop.ini"), false});
    window_->resize(1600, 1000);
    window_->show();
    QApplication::setActiveWindow(window_.get());
    settle();
  }
  void TearDown() override {
    if (window_) window_->close_now();
    window_.reset();
    desk_.reset();
    program().document.clear();
  }
  void run_lua(const char* text) {
    lua::LuaState lua(program(), session_, {.print = [](std::string_view) {}, .module_path = {}});
    const auto done = lua.run_string(text, "scene");
    EXPECT_TRUE(done.ok()) << done.error().sentence();
  }
  Value call(const std::string& command, Map args) {
    auto r = program().dispatch(session_, command, args);
    EXPECT_TRUE(r.ok()) << command << ": " << (r.ok() ? "" : r.error().sentence());
    return r.ok() ? *r : Value();
  }
  Handle handle_of(const char* kind, const char* name) {
    const Value v = call(std::string(kind) + ".get", Map{{"name", name}});
    return v.as_handle() ? *v.as_handle() : Handle();
  }
  void settle() {
    int settled = 0;
    EXPECT_TRUE(wait_for([&] {
      settled = window_->is_settled() && !desk_->has_calls() ? settled + 1 : 0;
      return settled > 3;
    }));
  }
  PropertiesPanel& properties() { return window_->properties(); }
  void select(const Handle& h, const std::string& path) {
    desk_->select({{h, path}});
    ASSERT_TRUE(wait_for([&] {
      return properties().form() && !properties().form()->shown_names().empty() &&
             properties().form()->is_complete();
    }));
    settle();
  }
  QTemporaryDir folder_;
  ioci::Session session_{"test"};
  std::unique_ptr<Desk> desk_;
  std::unique_ptr<MainWindow> window_;
};

double mass_of_bush(double outer, double hole, double height) {
  return 7850 * std::acos(-1.0) * (outer * outer - hole * hole) * height;
}

// ---- sections ----

TEST_F(Window, TheMassOfASolidFollowsADragOfItsBore) {
  const Handle bush = handle_of("solid", "bush");
  select(bush, "nodes.hole");
  ASSERT_TRUE(wait_for([&] { return properties().mass() && properties().mass()->mass(); }));
  EXPECT_NEAR(*properties().mass()->mass(), mass_of_bush(0.03, 0.01, 0.03), 1e-9);
  auto* radius = dynamic_cast<NumberField*>(properties().form()->field("radius"));
  ASSERT_NE(radius, nullptr);
  const QPoint from(radius->width() / 2, radius->height() / 2);
  QTest::mousePress(radius, Qt::LeftButton, {}, from);
  double slowest = 0, sum = 0;
  constexpr int kMoves = 12;
  for (int i = 1; i <= kMoves; ++i) {
    const QPointF at = from + QPoint(4 * i, 0);
    QElapsedTimer clock;
    clock.start();
    QMouseEvent move(QEvent::MouseMove, at, radius->mapToGlobal(at), Qt::NoButton, Qt::LeftButton,
                     {});
    QApplication::sendEvent(radius, &move);
    const double wanted = mass_of_bush(0.03, *radius->number(), 0.03);
    ASSERT_TRUE(wait_for([&] { return std::fabs(*properties().mass()->mass() - wanted) < 1e-9; }))
        << i;
    const double ms = static_cast<double>(clock.nsecsElapsed()) / 1e6;
    slowest = std::max(slowest, ms);
    sum += ms;
  }
  auto* before = properties().findChild<QLabel*>("properties.mass.1.before");
  ASSERT_NE(before, nullptr);
  EXPECT_TRUE(before->text().contains("0.59")) << before->text().toStdString();
  keep_picture(*window_, "mass-drag");
  QTest::mouseRelease(radius, Qt::LeftButton, {}, from + QPoint(4 * kMoves, 0));
  settle();
  std::cout << "Note: the mass followed " << kMoves << " moves of the bore after " << sum / kMoves
            << " ms, at most " << slowest << " ms.\n";
  // One step, which brings the first mass back.
  const Value history = call("document.history", {});
  EXPECT_TRUE(history.as_map() && history.as_map()->find("undo"));
  desk_->act("document.undo");
  ASSERT_TRUE(wait_for([&] {
    return std::fabs(*properties().mass()->mass() - mass_of_bush(0.03, 0.01, 0.03)) < 1e-9;
  }));
}

TEST_F(Window, ARecordNamesWhoUsesItAndLeadsThere) {
  select(handle_of("material", "steel"), "");
  ASSERT_TRUE(wait_for([&] { return properties().users() && properties().users()->isVisible(); }));
  const auto user = [&] { return properties().findChild<QPushButton*>("properties.users.1"); };
  ASSERT_TRUE(wait_for([&] { return user() && user()->text() == "bush"; }));
  QTest::mouseClick(user(), Qt::LeftButton);
  EXPECT_EQ(desk_->selection().front().record, handle_of("solid", "bush"));
  ASSERT_TRUE(wait_for([&] { return properties().title() == "bush"; }));
  ASSERT_TRUE(wait_for([&] { return user() && user()->text() == "arm"; }));
}

TEST_F(Window, ASegmentShowsHowNearItsRecordingComesToLimits) {
  call("world.add_trajectory", Map{{"id", "cell"}, {"trajectory", "swing"}});
  const Handle swing = handle_of("trajectory", "swing");
  select(swing, "segments[1]");
  ASSERT_NE(properties().segment(), nullptr);
  auto* sentence = properties().findChild<QLabel*>("properties.segment.sentence");
  ASSERT_NE(sentence, nullptr);
  ASSERT_TRUE(wait_for([&] { return sentence->text().startsWith("No recording"); }))
      << sentence->text().toStdString();
  keep_picture(*window_, "segment");
}

// ---- recording.summary ----

TEST_F(Window, ASummaryOfAnIntervalHasTheShareOfTheLimit) {
  const Value run =
      call("recording.create",
           Map{{"title", "t"},
               {"columns",
                List{Map{{"name", "time"}, {"unit", "s"}, {"values", List{0.0, 1.0, 2.0, 3.0}}},
                     Map{{"name", "a"}, {"values", List{0.0, 5.0, -1.0, 2.0}}}}}});
  const Value all = call("recording.summary", Map{{"id", run}, {"from", 1.5}, {"to", 3.0}});
  ASSERT_TRUE(all.as_list());
  for (const Value& each : *all.as_list()) {
    const Map& m = *each.as_map();
    if (m.find("name")->text() != "a") continue;
    EXPECT_EQ(m.find("max")->number(), 2);
    EXPECT_EQ(m.find("min")->number(), -1);
    EXPECT_EQ(m.find("share"), nullptr);
  }
}

// ---- tables ----

TEST_F(Window, ATableOfAHundredThousandRowsIsSortedAndCopied) {
  ResultView view(desk_->client());
  view.resize(700, 400);
  view.show();
  constexpr std::size_t kRows = 100'000, kCols = 8;
  std::vector<double> numbers;
  for (std::size_t r = 0; r < kRows; ++r)
    for (std::size_t c = 0; c < kCols; ++c)
      numbers.push_back(c == 0 ? static_cast<double>((r * 7919) % kRows) : -0.5 * double(r));
  QElapsedTimer clock;
  clock.start();
  view.show_result(Value(NumericArray(std::move(numbers), kRows, kCols, "m")));
  view.show_mode("table");
  const double shown = static_cast<double>(clock.nsecsElapsed()) / 1e6;
  QAbstractItemModel* model = view.table()->model();
  ASSERT_EQ(model->rowCount(), static_cast<int>(kRows));
  clock.restart();
  view.table()->sortByColumn(0, Qt::DescendingOrder);
  const double sorted = static_cast<double>(clock.nsecsElapsed()) / 1e6;
  EXPECT_EQ(model->index(0, 0).data().toString(), "99999");
  EXPECT_EQ(model->index(99999, 0).data().toString(), "0");
  view.table()->selectRow(0);
  QTest::keyClick(view.table(), Qt::Key_C, Qt::ControlModifier);
  const QString line = QApplication::clipboard()->text();
  EXPECT_TRUE(line.startsWith("99999\t")) << line.toStdString();
  EXPECT_FALSE(line.contains(QChar(0x2212)));
  EXPECT_FALSE(line.contains('\n'));
  view.table()->selectAll();
  clock.restart();
  view.table()->sortByColumn(-1, Qt::AscendingOrder);
  EXPECT_EQ(model->index(1, 0).data().toString(), "7919");
  std::cout << "Note: a table of 100,000 x 8 is shown in " << shown << " ms and sorted in "
            << sorted << " ms.\n";
  // Texts after numbers, nothing last.
  ResultTable mixed;
  mixed.columns = {"v"};
  mixed.rows = {{Value("b")}, {Value()}, {Value(2.0)}, {Value("a")}, {Value(1.0)}};
  ResultModel small(mixed, nullptr);
  small.sort(0, Qt::AscendingOrder);
  QStringList order;
  for (int r = 0; r < 5; ++r) order << small.index(r, 0).data(Qt::DisplayRole).toString();
  EXPECT_EQ(order.join(",").toStdString(), "1,2,a,b,");
}

// ---- palette ----

TEST_F(Window, ThePaletteKeepsItsPlaceInADock) {
  CommandPalette& palette = window_->palette();
  palette.open("version");
  ASSERT_TRUE(wait_for([&] { return palette.command_count() > 100; }));
  EXPECT_FALSE(palette.is_docked());
  QTest::mouseClick(palette.findChild<QToolButton*>("palette.dock"), Qt::LeftButton);
  ASSERT_TRUE(palette.is_docked());
  auto* dock = window_->findChild<QDockWidget*>("palette_dock");
  ASSERT_NE(dock, nullptr);
  EXPECT_EQ(dock->widget(), &palette);
  ASSERT_TRUE(wait_for([&] { return palette.isVisible(); }));
  // Escape clears the line and goes back, but never closes it.
  palette.open_command("robot.fk", {{"id", "arm"}});
  ASSERT_TRUE(wait_for([&] { return palette.has_form(); }));
  keep_picture(*window_, "palette-docked");
  palette.form()->setFocus();
  for (int i = 0; i < 3; ++i) QTest::keyClick(&palette, Qt::Key_Escape);
  EXPECT_TRUE(palette.isVisible());
  EXPECT_FALSE(palette.has_form());
  // The form has one column where it is narrow.
  EXPECT_LT(palette.width(), 620);
  QTest::mouseClick(palette.findChild<QToolButton*>("palette.dock"), Qt::LeftButton);
  EXPECT_FALSE(palette.is_docked());
  EXPECT_TRUE(palette.isVisible());
  EXPECT_FALSE(dock->isVisible());
  QTest::keyClick(palette.line(), Qt::Key_Escape);
  EXPECT_FALSE(palette.isVisible());
  // Shown from the menu of panels, the dock has the palette again.
  window_->show_panel("palette");
  ASSERT_TRUE(wait_for([&] { return palette.is_docked() && palette.isVisible(); }));
}

TEST_F(Window, CommandsThatWereRunComeFirstAlsoAfterTheNextStart) {
  CommandPalette& palette = window_->palette();
  for (const char* command : {"session.list", "version"}) {
    bool has_run = false;
    palette.open_command(command);
    const auto before = palette.form()->on_run;
    ASSERT_TRUE(wait_for([&] { return palette.form()->command() == command; }));
    palette.form()->run();
    ASSERT_TRUE(wait_for([&] {
      has_run = !palette.recent().empty() && palette.recent().front() == command;
      return has_run;
    })) << command;
  }
  palette.open();
  EXPECT_EQ(palette.found()[0], "version");
  EXPECT_EQ(palette.found()[1], "session.list");
  window_->close_now();
  window_ = std::make_unique<MainWindow>(
      *desk_, MainWindow::Options{folder_.filePath("desktop.ini"), false});
  window_->show();
  window_->palette().open();
  ASSERT_TRUE(wait_for([&] { return window_->palette().command_count() > 100; }));
  EXPECT_EQ(window_->palette().found()[0], "version");
}

// ---- the whole window ----

TEST_F(Window, FocusIsVisibleOnEveryWidgetThatTakesIt) {
  select(handle_of("robot", "arm"), "links[1]");
  for (const bool is_dark : {true, false}) {
    set_theme(*qobject_cast<QApplication*>(QApplication::instance()), make_theme(is_dark));
    settle();
    std::set<QString> without;
    std::size_t tried = 0;
    for (QWidget* w : window_->findChildren<QWidget*>()) {
      if (!w->isVisible() || !w->isEnabled() || !(w->focusPolicy() & Qt::TabFocus) ||
          w->focusProxy() || w->objectName().isEmpty() || w->objectName().startsWith("qt_"))
        continue;
      // Views and pages that take keys as a whole show it by what is selected in them.
      static const std::set<QString> kWhole{"display", "start", "start_area", "time_ruler"};
      if (w->visibleRegion().isEmpty() || kWhole.contains(w->objectName())) continue;
      const auto look = [&] {
        QCoreApplication::sendPostedEvents();
        const QPoint at = w->mapTo(window_.get(), QPoint(0, 0));
        return window_->grab(QRect(at, w->size()).adjusted(-3, -3, 3, 3)).toImage();
      };
      if (QWidget* now = QApplication::focusWidget()) now->clearFocus();
      const QImage before = look();
      w->setFocus(Qt::TabFocusReason);
      if (QApplication::focusWidget() != w && !w->isAncestorOf(QApplication::focusWidget()))
        continue;
      ++tried;
      if (look() == before) without.insert(w->objectName());
    }
    EXPECT_GT(tried, 40U);
    QStringList names(without.begin(), without.end());
    EXPECT_EQ(names.join(", ").toStdString(), "") << (is_dark ? "dark" : "light");
  }
  set_theme(*qobject_cast<QApplication*>(QApplication::instance()), make_theme(true));
}

TEST_F(Window, TabFollowsTheOrderOfReadingInEveryForm) {
  for (const auto& [kind, name, path] :
       std::vector<std::tuple<const char*, const char*, const char*>>{
           {"robot", "arm", ""},
           {"robot", "arm", "links[1]"},
           {"solid", "bush", "nodes.hole"},
           {"material", "steel", ""}}) {
    select(handle_of(kind, name), path);
    SchemaForm* form = properties().form();
    const auto is_stop = [form](const QWidget* w) {
      return form->isAncestorOf(w) && w->isVisible() && (w->focusPolicy() & Qt::TabFocus) &&
             !w->focusProxy();
    };
    const auto place = [form](const QWidget* w) { return w->mapTo(form, QPoint(0, 0)); };
    QWidget* first = nullptr;
    for (QWidget* w : form->findChildren<QWidget*>())
      if (is_stop(w) && (!first || place(w).y() < place(first).y())) first = w;
    ASSERT_NE(first, nullptr);
    int count = 0, last = -1;
    for (QWidget* w = first; count == 0 || w != first; w = w->nextInFocusChain()) {
      if (!is_stop(w)) continue;
      // Buttons within a line are a little lower or higher than its field.
      constexpr int kSameLine = 12;
      EXPECT_GE(place(w).y(), last - kSameLine)
          << kind << " " << path << ": " << w->objectName().toStdString();
      last = place(w).y();
      ++count;
    }
    EXPECT_GT(count, 3) << kind;
  }
}

TEST_F(Window, StrongBordersAreASettingThatIsKept) {
  QAction* action = window_->actions().find("strong_borders");
  ASSERT_NE(action, nullptr);
  EXPECT_FALSE(theme().has_strong_borders);
  action->trigger();
  EXPECT_TRUE(theme().has_strong_borders);
  EXPECT_EQ(theme().field_line, theme().text_quiet);
  action->trigger();
  EXPECT_FALSE(theme().has_strong_borders);
}

TEST_F(Window, PropertiesFitTheirDockAtEveryZoom) {
  for (const double zoom : {1.0, 1.33, 1.5, 2.0}) {
    set_theme(*qobject_cast<QApplication*>(QApplication::instance()), make_theme(true, zoom));
    window_->resize(zoom > 1.2 ? 800 : 1600, 900);
    select(handle_of("robot", "arm"), "links[1]");
    QString cut;
    int fitted = 0;  // times in a row
    EXPECT_TRUE(wait_for([&] {
      cut.clear();
      for (const QWidget* w : properties().findChildren<QWidget*>())
        if (w->isVisible() && dynamic_cast<const Field*>(w) &&
            w->mapTo(&properties(), QPoint(w->width(), 0)).x() > properties().width())
          cut += " " + w->objectName();
      fitted = cut.isEmpty() ? fitted + 1 : 0;
      return fitted > 3;
    })) << cut.toStdString()
        << " at zoom " << zoom;
    keep_picture(*window_, "zoom-" + std::to_string(zoom));
  }
  set_theme(*qobject_cast<QApplication*>(QApplication::instance()), make_theme(true));
}

}  // namespace
}  // namespace robomosp::viewer

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  qputenv("ROBOMOSP_NO_THUMBNAILS", "1");
  QApplication app(argc, argv);
  robomosp::viewer::set_theme(app, robomosp::viewer::make_theme(true));
  const int result = RUN_ALL_TESTS();
  robomosp::test::examples_holder().reset();
  return result;
}
