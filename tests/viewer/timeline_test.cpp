// SPDX-License-Identifier: GPL-3.0-or-later
// Drives the timeline of the window with mouse and keys, under Xvfb and without a display: bands,
// plots, variables, comparison, export, recordings that are out of date, live runs.
#include "viewer/timeline/timeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <QAction>
#include <QApplication>
#include <QElapsedTimer>
#include <QFile>
#include <QFileDialog>
#include <QImage>
#include <QLabel>
#include <QLineEdit>
#include <QListWidget>
#include <QMenu>
#include <QMouseEvent>
#include <QPushButton>
#include <QScrollArea>
#include <QTemporaryDir>
#include <QTest>
#include <QThread>
#include <QToolButton>
#include <QWheelEvent>

#include <gtest/gtest.h>

#include "viewer/desktop/console.h"
#include "viewer/desktop/main_window.h"
#include "viewer/desktop/messages.h"
#include "viewer/desktop/settings.h"
#include "viewer/desktop/values.h"
#include "viewer/desktop/view_tab.h"
#include "viewer/forms/command_form.h"
#include "viewer/forms/command_palette.h"
#include "viewer/forms/properties_panel.h"
#include "viewer/forms/schema_form.h"
#include "viewer/scene/linear.h"
#include "viewer/theme/theme.h"
#include "viewer/timeline/variables.h"
#include "viewer/widgets/number_field.h"
#include "viewer/window_test.h"

namespace robomosp::viewer {
namespace {

/// Processor time of this thread [ms]: other programs must not count.
double spent_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

TEST(Series, IsDrawnWithAFewPointsForEachPixel) {
  constexpr std::size_t kCount = 1'000'000;
  auto times = std::make_shared<Numbers64>(kCount);
  Numbers64 values(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    (*times)[i] = 1e-3 * static_cast<double>(i);
    values[i] = std::sin(0.01 * static_cast<double>(i));
  }
  values[654'321] = 7;
  values[123'456] = std::nan("");
  const double start = spent_ms();
  const Series series(times, values);
  const double build_ms = spent_ms() - start;
  const double line_start = spent_ms();
  const Series::Line line = series.line(0, 1000, 1000);
  const double line_ms = spent_ms() - line_start;
  RecordProperty("build_ms", std::to_string(build_ms));
  RecordProperty("line_ms", std::to_string(line_ms));
  std::printf("a million samples: blocks take %.1f ms, a line %.2f ms\n", build_ms, line_ms);
  EXPECT_LE(line.x.size(), 2100u);
  // The one sample that stands out is drawn, where it is.
  const auto peak = std::max_element(line.y.begin(), line.y.end());
  ASSERT_NE(peak, line.y.end());
  EXPECT_DOUBLE_EQ(*peak, 7);
  EXPECT_NEAR(line.x[static_cast<std::size_t>(peak - line.y.begin())], 654.321, 1);
  EXPECT_DOUBLE_EQ(series.extremes()->second, 7);
  EXPECT_FALSE(series.at(123.456).has_value());
  EXPECT_FALSE(series.at(-1).has_value());
  EXPECT_NEAR(*series.at(0.0005), std::sin(0.01) / 2, 1e-12);
  // A short range is drawn sample by sample.
  const Series::Line part = series.line(10, 10.5, 1000);
  EXPECT_EQ(part.x.size(), 503u);
}

TEST(Series, GrowsAndIsCutAsIfItWereMadeAnew) {
  auto times = std::make_shared<Numbers64>();
  Series grown(times, {});
  Numbers64 all;
  unsigned seed = 7;
  for (int step = 0; step < 200; ++step) {
    const std::size_t count = seed % 37;
    Numbers64 more;
    for (std::size_t i = 0; i < count; ++i) {
      seed = seed * 1103515245u + 12345u;
      more.push_back(static_cast<double>(seed % 1000) - 500);
      times->push_back(static_cast<double>(times->size()));
    }
    grown.append(more.data(), more.size());
    all.insert(all.end(), more.begin(), more.end());
    seed = seed * 1103515245u + 12345u;
    if (step % 11 == 10) {
      const std::size_t rows = all.size() - std::min<std::size_t>(all.size(), seed % 60);
      all.resize(rows);
      times->resize(rows);
      grown.cut(rows);
    }
    const Series fresh(std::make_shared<const Numbers64>(*times), all);
    ASSERT_EQ(grown.size(), fresh.size());
    ASSERT_EQ(grown.extremes(), fresh.extremes()) << "step " << step;
    if (all.size() < 2) continue;
    const auto a = grown.line(0, times->back(), 20), b = fresh.line(0, times->back(), 20);
    ASSERT_EQ(a.y, b.y) << "step " << step;
  }
}

TEST(TimeAxis, StaysWithinItsRange) {
  TimeAxis axis;
  axis.set_place(100, 1100, 0);
  axis.set_range(0, 10);
  axis.zoom(0.5, 2);
  EXPECT_DOUBLE_EQ(axis.high() - axis.low(), 5);
  EXPECT_DOUBLE_EQ(axis.x_of(axis.time_at(600)), 600);
  axis.pan(-100);
  EXPECT_DOUBLE_EQ(axis.low(), 0);
  axis.pan(1e9);
  EXPECT_DOUBLE_EQ(axis.high(), 10);
  axis.zoom(1e-30, 9);
  EXPECT_GT(axis.high(), axis.low());
  axis.zoom(std::nan(""), 9);
  axis.set_range(0, 0);
  EXPECT_TRUE(axis.is_empty());
  axis.set_range(0, std::nan(""));
  EXPECT_TRUE(axis.is_empty());
}

class TimelineTest : public WindowTest {
 protected:
  TimelineTest() : WindowTest({1600, 1000}) {}
  void SetUp() override {
    WindowTest::SetUp();
    window_->set_workspace(Workspace::motion);
    settle();
  }
  /// The PA-10 on its circle with torques, shown and at rest.
  Handle shown_run() {
    ioci::OpenRequest request;
    request.what = "pa10_circle";
    window_->open(std::move(request), false);
    EXPECT_TRUE(until([&] { return window_->current_view() != nullptr; }));
    settle();
    world_ = window_->current_view()->what();
    const Handle run =
        made("world.inverse_dynamics",
             {{"id", world_}, {"robot", "pa10"}, {"trajectory", "circle"}, {"sample_time", 0.1}});
    show(run);
    return run;
  }
  void show(const Handle& recording) {
    window_->timeline().on_open(recording);
    EXPECT_TRUE(until([&] {
      RecordingData* data = window_->timeline().data();
      return data && data->source() == recording && data->range() && !lanes().lanes().empty() &&
             !lanes().lanes()[0].curves.empty() && lanes().lanes()[0].curves[0].series;
    }));
    settle();
  }
  std::size_t band(const std::string& name) {
    const auto& all = bands().bands();
    for (std::size_t i = 0; i < all.size(); ++i)
      if (all[i].name == name) return i;
    ADD_FAILURE() << "no band " << name;
    return 0;
  }
  void photograph(const char* name) {
    if (const char* folder = std::getenv("ROBOMOSP_PHOTOS"))
      window_->grab().save(QString(folder) + "/" + name + ".png");
  }
  /// Texts of all labels of the form, for what went wrong.
  std::string faults_of_form() {
    std::string out;
    for (const QLabel* each : window_->palette().form()->findChildren<QLabel*>())
      if (each->isVisibleTo(&window_->palette())) out += "\n" + utf8(each->text());
    return out;
  }
  Timeline& timeline() { return window_->timeline(); }
  PlotLanes& lanes() { return timeline().lanes(); }
  BandsView& bands() { return timeline().bands(); }
  Player& player() { return window_->current_view()->player(); }
  Handle world_;
};

TEST_F(TimelineTest, ARecordingOrRunOpensTheTabOfWhatItMoves) {
  const Handle box = made(
      "solid.create",
      {{"name", "box"},
       {"material", *called("material.create", {{"name", "wood"}, {"density", 600.0}}).as_handle()},
       {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
  std::array<Handle, 2> worlds, falls;
  for (std::size_t i = 0; i < 2; ++i) {
    worlds[i] = made("world.create", {{"name", i == 0 ? "cell" : "hall"}});
    called("world.add_object",
           {{"id", worlds[i]}, {"what", box}, {"position", List{0.0, 0.0, 0.5}}});
    falls[i] = made("world.simulate_physics", {{"id", worlds[i]}, {"duration", 0.2}});
  }
  const auto& [cell, hall] = worlds;
  ASSERT_NE(window_->open_view(cell, "cell"), nullptr);
  ASSERT_NE(window_->open_view(hall, "hall"), nullptr);
  settle();
  const auto is_moved = [&](const Handle& what, const Handle& by) {
    return until([&] {
      const ViewTab* view = window_->current_view();
      return view && view->what() == what && (view->recording() == by || view->run() == by);
    });
  };
  timeline().on_open(falls[0]);
  EXPECT_TRUE(is_moved(cell, falls[0])) << "the recording of the cell, with the hall in front";
  EXPECT_FALSE(window_->views().back()->recording()) << "it moves the hall";
  timeline().on_open(falls[1]);
  EXPECT_TRUE(is_moved(hall, falls[1]));
  // A tab that was closed opens again.
  window_->actions().find("close_tab")->trigger();
  EXPECT_EQ(window_->views().size(), 1U);
  const Handle run =
      made("world.start_run", {{"id", hall}, {"of", "physics"}, {"with", Map{{"duration", 1.0}}}});
  timeline().on_open(run);
  EXPECT_TRUE(is_moved(hall, run)) << "the run of the hall, with the cell in front";
  EXPECT_EQ(window_->current_view()->name(), "hall");
  // Of a robot without a world, which it moves.
  made("robot.create", {{"name", "arm"}, {"links", List{Map{{"a", 0.3}}, Map{{"a", 0.2}}}}});
  const Handle arm = *called("robot.get", {{"name", "arm"}}).as_handle();
  const Handle swing =
      made("recording.create",
           {{"title", "swing"},
            {"robot", "arm"},
            {"columns", List{Map{{"name", "time"}, {"unit", "s"}, {"values", List{0.0, 1.0}}},
                             Map{{"name", "q"},
                                 {"unit", "rad"},
                                 {"values", List{List{0.0, 0.0}, List{1.0, 0.0}}}}}}});
  timeline().on_open(swing);
  ASSERT_TRUE(is_moved(arm, swing));
  settle();
  const auto heading = [&] {
    const auto& member = window_->current_view()->picture()->frame->robots.front();
    return member->bodies.back().p;
  };
  const Vec3 before = heading();
  player().set_time(1);
  settle();
  EXPECT_GT(norm(heading() - before), 0.05) << "the robot does not move";
  // What cannot be shown is said.
  const auto said = [&](const QString& text) {
    return until([&] {
      const auto& model = window_->messages().model();
      const int rows = model.rowCount({});
      return rows > 0 && model.index(rows - 1).data().toString().contains(text);
    });
  };
  called("world.remove", {{"id", cell}});
  timeline().on_open(falls[0]);
  EXPECT_TRUE(said("the world that the recording"));
  called("robot.remove", {{"id", arm}});
  timeline().on_open(swing);
  EXPECT_TRUE(said("the robot \"arm\" that the recording"));
  EXPECT_EQ(window_->current_view()->what(), arm) << "another tab was taken";
}

TEST_F(TimelineTest, PlotsTorquesAndSpeedsWithTheirValuesUnderTheCursor) {
  const Handle run = shown_run();
  ASSERT_EQ(lanes().lanes().size(), 2u);
  EXPECT_EQ(lanes().lanes()[0].title, "Torque [N m]");
  EXPECT_EQ(lanes().lanes()[1].title, "Velocity [°/s]");
  ASSERT_EQ(lanes().lanes()[0].curves.size(), 7u);
  const Value torques = called("recording.values", {{"id", run}, {"columns", "tau2"}});
  const Value times = called("recording.values", {{"id", run}, {"columns", "time"}});
  const double t = (*times.as_array())[17], tau = (*torques.as_array())[17];
  player().set_time(t);
  EXPECT_EQ(lanes().value_text(0, 1), fixed_number(tau, 1));
  EXPECT_LT(tau, 0);
  EXPECT_TRUE(lanes().value_text(0, 1).startsWith(QChar(0x2212)));
  photograph("timeline_plots");

  // A click on a plot moves the time; the wheel zooms all lanes about the cursor.
  const double middle = 0.5 * (player().from() + player().to());
  const QPoint at(static_cast<int>(timeline().axis().x_of(middle)), lanes().height() / 4);
  QTest::mouseClick(&lanes(), Qt::LeftButton, {}, at);
  EXPECT_NEAR(player().time(), middle, 0.01 * player().to());
  QWheelEvent turn(QPointF(at), QPointF(lanes().mapToGlobal(at)), {}, QPoint(0, 480), Qt::NoButton,
                   Qt::NoModifier, Qt::NoScrollPhase, false);
  QApplication::sendEvent(&lanes(), &turn);
  EXPECT_TRUE(timeline().axis().is_zoomed());
  EXPECT_NEAR(timeline().axis().x_of(middle), at.x(), 1.5);
  settle();
  const double low = timeline().axis().low();
  QTest::mousePress(&lanes(), Qt::LeftButton, {}, at);
  QTest::mouseMove(&lanes(), at + QPoint(20, 0));
  QTest::mouseMove(&lanes(), at + QPoint(60, 0));
  QTest::mouseRelease(&lanes(), Qt::LeftButton, {}, at + QPoint(60, 0));
  EXPECT_LT(timeline().axis().low(), low);
  QTest::keyClick(&lanes(), Qt::Key_Home);
  EXPECT_FALSE(timeline().axis().is_zoomed());
}

TEST_F(TimelineTest, AClickOnASegmentSelectsIt) {
  shown_run();
  const std::size_t segments = band("segments");
  ASSERT_EQ(bands().bands()[segments].spans.size(), 1u);
  QTest::mouseClick(&bands(), Qt::LeftButton, {}, bands().span_rect(segments, 0).center());
  ASSERT_EQ(desk_->selection().size(), 1u);
  EXPECT_EQ(desk_->selection()[0].record.kind, "trajectory");
  EXPECT_EQ(desk_->selection()[0].path, "segments.1");
}

TEST_F(TimelineTest, WhatWasNotLookedAtIsSaidAndTheClearanceIsComputedByAClick) {
  const Handle run = shown_run();
  const std::size_t clearance = band("clearance");
  EXPECT_FALSE(bands().bands()[clearance].is_known);
  EXPECT_EQ(bands().bands()[clearance].why, "no clearance was recorded");
  EXPECT_FALSE(bands().bands()[band("torque")].is_known);
  EXPECT_TRUE(bands().bands()[band("faults")].note.contains("Clearance"));
  photograph("timeline_unknown");
  QTest::mouseClick(&bands(), Qt::LeftButton, {},
                    bands().band_rect(clearance).center() + QPoint(20, 0));
  ASSERT_TRUE(until([&] {
    return band("clearance") < bands().bands().size() &&
           bands().bands()[band("clearance")].is_known;
  }));
  settle();
  EXPECT_EQ(called("recording.values", {{"id", run}, {"columns", "clearance"}}).as_array()->size(),
            called("recording.values", {{"id", run}, {"columns", "time"}}).as_array()->size());
}

TEST_F(TimelineTest, LimitsThatAreExceededAreFaultsThatLeadToTheirRobot) {
  const Handle run = shown_run();
  (void)run;
  // Slow down joint 2 until the motion is too fast for it.
  const Handle robot = *called("robot.get", {{"name", "pa10"}}).as_handle();
  called("robot.set_link", {{"id", robot}, {"link", 2}, {"max_velocity", 0.01}});
  const Handle slow =
      made("world.inverse_dynamics",
           {{"id", world_}, {"robot", "pa10"}, {"trajectory", "circle"}, {"sample_time", 0.1}});
  show(slow);
  const std::size_t faults = band("faults");
  ASSERT_FALSE(bands().bands()[faults].spans.empty());
  const BandSpan first = bands().bands()[faults].spans[0];
  EXPECT_EQ(first.level, "fault");
  EXPECT_TRUE(first.text.startsWith("qd2 uses ")) << first.text.toStdString();
  photograph("timeline_faults");
  QTest::mouseClick(&bands(), Qt::LeftButton, {}, bands().span_rect(faults, 0).center());
  EXPECT_DOUBLE_EQ(player().time(), first.at);
  ASSERT_TRUE(until([&] { return desk_->selection().size() == 1; }));
  ASSERT_TRUE(until([&] { return desk_->selection()[0].path == "robots.pa10"; }));
}

TEST_F(TimelineTest, VariablesAreSearchedPlottedComputedAndKept) {
  shown_run();
  QTest::mouseClick(widget<QToolButton>("timeline_variable"), Qt::LeftButton);
  VariablePicker& picker = timeline().picker();
  ASSERT_TRUE(picker.isVisible());
  QTest::keyClicks(&picker.search(), "tool position world");
  ASSERT_EQ(picker.list().count(), 3);
  QTest::keyClick(&picker.search(), Qt::Key_Return);
  ASSERT_TRUE(until([&] { return lanes().lanes().size() == 3; }));
  settle();
  EXPECT_EQ(lanes().lanes()[2].title, "x [mm]");

  QTest::mouseClick(widget<QToolButton>("timeline_variable"), Qt::LeftButton);
  auto* expression = picker.findChild<QLineEdit*>("variable_expression");
  QTest::keyClicks(expression, "tau1*nothing");
  QTest::keyClick(expression, Qt::Key_Return);
  auto* fault = picker.findChild<QLabel*>("variable_fault");
  ASSERT_TRUE(until([&] { return !fault->text().isEmpty(); }));
  EXPECT_TRUE(picker.isVisible());
  expression->clear();
  QTest::keyClicks(expression, "tau1*qd1");
  QTest::keyClicks(picker.findChild<QLineEdit*>("variable_name"), "power1");
  QTest::keyClicks(picker.findChild<QLineEdit*>("variable_unit"), "W");
  QTest::keyClick(expression, Qt::Key_Return);
  ASSERT_TRUE(until([&] {
    return lanes().lanes().size() == 4 && lanes().lanes()[3].title == "power1 [W]" &&
           lanes().lanes()[3].curves.size() == 1 && lanes().lanes()[3].curves[0].series;
  }));
  settle();
  const double t = timeline().data()->series("tau1")->times()->at(188);
  player().set_time(t);
  const auto tau = timeline().data()->series("tau1")->at(t),
             qd = timeline().data()->series("qd1")->at(t);
  const auto power = lanes().lanes()[3].curves[0].series->at(t);
  ASSERT_TRUE(tau && qd && power);
  EXPECT_NEAR(*power, *tau * *qd, 1e-9);
  photograph("timeline_variables");

  // Lanes are moved, split and removed by keys, and kept for the next recording of this kind.
  lanes().setFocus();
  QTest::keyClick(&lanes(), Qt::Key_Up);
  while (lanes().current_lane() > 0) QTest::keyClick(&lanes(), Qt::Key_Up);
  QTest::keyClick(&lanes(), Qt::Key_Down, Qt::ControlModifier);
  ASSERT_TRUE(until([&] { return lanes().lanes()[1].title == "Torque [N m]"; }));
  QTest::keyClick(&lanes(), Qt::Key_Up);
  QTest::keyClick(&lanes(), Qt::Key_Delete);
  ASSERT_TRUE(until([&] { return lanes().lanes().size() == 3; }));
  EXPECT_EQ(lanes().lanes()[0].title, "Torque [N m]");
  timeline().split_lane(0);
  ASSERT_TRUE(until([&] { return lanes().lanes().size() == 9; }));
  const Handle again =
      made("world.inverse_dynamics",
           {{"id", world_}, {"robot", "pa10"}, {"trajectory", "circle"}, {"sample_time", 0.2}});
  show(again);
  EXPECT_EQ(lanes().lanes().size(), 8u) << "all but the computed column";
}

TEST_F(TimelineTest, RecordingsOfOtherLengthsAndRatesAreCompared) {
  const Handle run = shown_run();
  const Handle robot = *called("robot.get", {{"name", "pa10"}}).as_handle();
  called("robot.set_payload", {{"id", robot}, {"mass", 2.0}});
  const Handle other =
      made("world.inverse_dynamics",
           {{"id", world_}, {"robot", "pa10"}, {"trajectory", "circle"}, {"sample_time", 0.37}});
  const Handle part = made("recording.part", {{"id", other}, {"from", 0.0}, {"to", 30.0}});
  timeline().compare(part, true);
  ASSERT_TRUE(until([&] {
    return lanes().lanes()[0].curves.size() == 14 && lanes().lanes()[0].curves[13].series;
  }));
  settle();
  player().set_time(10);
  const auto mine = lanes().lanes()[0].curves[1].series->at(10),
             theirs = lanes().lanes()[0].curves[8].series->at(10);
  ASSERT_TRUE(mine && theirs);
  EXPECT_GT(std::fabs(*theirs - *mine), 1);
  const auto [low, high] = *lanes().lanes()[0].curves[8].series->extremes();
  const int decimals = decimals_for(std::max(std::fabs(low), std::fabs(high)));
  EXPECT_TRUE(lanes().value_text(0, 8).endsWith(fixed_number(*theirs - *mine, decimals)))
      << lanes().value_text(0, 8).toStdString();
  photograph("timeline_compare");
  player().set_time(45);
  EXPECT_EQ(lanes().value_text(0, 8), "–") << "the other recording has ended";
  called("recording.remove", {{"id", part}});
  settle();
  timeline().compare(part, false);
  ASSERT_TRUE(until([&] { return lanes().lanes()[0].curves.size() == 7; }));
  EXPECT_EQ(timeline().data()->source(), run);
}

TEST_F(TimelineTest, WhatIsShownIsWrittenByACommand) {
  shown_run();
  std::vector<std::string> lines;
  desk_->acted.add(window_.get(), [&](const std::string& line) { lines.push_back(line); });
  const QString table = folder_.filePath("shown.csv"), drawing = folder_.filePath("shown.svg");
  timeline().write_file(table);
  timeline().write_file(drawing);
  ASSERT_TRUE(until([&] { return QFile::exists(table) && QFile::exists(drawing); }));
  settle();
  QFile file(table);
  ASSERT_TRUE(file.open(QIODevice::ReadOnly));
  const QString head = QString::fromUtf8(file.readLine());
  EXPECT_TRUE(head.startsWith("time [s],tau1 [N m]")) << head.toStdString();
  EXPECT_EQ(head.count(','), 14);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_NE((lines[0] + lines[1]).find("recording.csv{"), std::string::npos);
  EXPECT_NE((lines[0] + lines[1]).find("recording.plot{"), std::string::npos);
  // From the menu, by a dialog that does not hold up the window.
  auto* menu = timeline().findChild<QMenu*>("timeline_menu");
  ASSERT_NE(menu, nullptr);
  QMetaObject::invokeMethod(menu, "aboutToShow");
  auto* entry = menu->findChild<QAction*>("export_png");
  ASSERT_NE(entry, nullptr);
  entry->trigger();
  auto* dialog = window_->findChild<QFileDialog*>("export_dialog");
  ASSERT_NE(dialog, nullptr);
  const QString picture = folder_.filePath("shown.png");
  dialog->selectFile(picture);
  QMetaObject::invokeMethod(dialog, "accept");
  EXPECT_TRUE(until([&] { return QFile::exists(picture); }));
}

TEST_F(TimelineTest, ARecordingThatIsOutOfDateSaysSoAndRunsAgainByAClick) {
  const Handle run = shown_run();
  EXPECT_FALSE(widget("timeline_notice")->isVisible());
  const NumericArray before =
      *called("recording.values", {{"id", run}, {"columns", "tau"}}).as_array();
  const Handle robot = *called("robot.get", {{"name", "pa10"}}).as_handle();
  called("robot.set_payload", {{"id", robot}, {"mass", 3.0}});
  ASSERT_TRUE(until([&] { return widget("timeline_notice")->isVisible(); }));
  EXPECT_TRUE(lanes().is_dimmed());
  EXPECT_TRUE(widget<QLabel>("timeline_notice_text")->text().startsWith("Out of date: "));
  photograph("timeline_stale");
  QTest::mouseClick(widget<QPushButton>("timeline_refresh"), Qt::LeftButton);
  ASSERT_TRUE(until([&] { return !widget("timeline_notice")->isVisible(); }));
  settle();
  EXPECT_FALSE(lanes().is_dimmed());
  const NumericArray after =
      *called("recording.values", {{"id", run}, {"columns", "tau"}}).as_array();
  EXPECT_FALSE(before == after);
  player().set_time(20);
  const auto shown = lanes().lanes()[0].curves[1].series->at(20);
  ASSERT_TRUE(shown);
  EXPECT_NEAR(*shown, after.at(200, 1), 1e-6 + 0.01 * std::fabs(*shown));
  called("document.undo", {});
  ASSERT_TRUE(until([&] { return widget("timeline_notice")->isVisible(); }));
  timeline().refresh_recording();
  ASSERT_TRUE(until([&] { return !widget("timeline_notice")->isVisible(); }));
  settle();
  EXPECT_TRUE(before == *called("recording.values", {{"id", run}, {"columns", "tau"}}).as_array());
}

TEST_F(TimelineTest, ARecordingThatIsRemovedSaysSo) {
  const Handle run = shown_run();
  called("recording.remove", {{"id", run}});
  ASSERT_TRUE(until([&] { return widget("timeline_notice")->isVisible(); }));
  EXPECT_EQ(widget<QLabel>("timeline_notice_text")->text(), "The recording was removed.");
  player().set_time(5);
  settle();
}

TEST_F(TimelineTest, ALiveRunPlaysGrowsAndIsScrubbedBackwards) {
  const Handle wood = made("material.create", {{"name", "wood"}, {"density", 600}});
  (void)wood;
  const Handle floor =
      made("solid.create",
           {{"name", "floor"}, {"root", Map{{"kind", "box"}, {"x", 2}, {"y", 2}, {"z", 0.1}}}});
  const Handle box =
      made("solid.create", {{"name", "box"},
                            {"material", "wood"},
                            {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
  world_ = made("world.create", {{"name", "cell"}});
  called("world.add_object", {{"id", world_}, {"what", floor}, {"position", List{0.0, 0.0, -0.1}}});
  called("world.add_object", {{"id", world_}, {"what", box}, {"position", List{0.0, 0.0, 0.5}}});
  ASSERT_NE(window_->open_view(world_, "cell"), nullptr);
  settle();
  const Value started = called(
      "world.start_run", {{"id", world_}, {"of", "physics"}, {"with", Map{{"duration", 3.0}}}});
  ASSERT_NE(started.as_handle(), nullptr);
  const Handle run = *started.as_handle();
  timeline().on_open(run);
  ASSERT_TRUE(until([&] { return player().is_run() && !lanes().lanes().empty(); }));
  window_->actions().find("play")->trigger();
  ASSERT_TRUE(until([&] { return player().is_playing(); }));
  ASSERT_TRUE(until([&] { return player().to() > 0.3; }));
  ASSERT_TRUE(until([&] {
    const auto& lane = lanes().lanes()[0];
    return !lane.curves.empty() && lane.curves[0].series && lane.curves[0].series->size() > 20;
  }));
  window_->actions().find("play")->trigger();
  ASSERT_TRUE(until([&] { return !player().is_playing(); }));
  settle();
  photograph("timeline_run");
  EXPECT_TRUE(until([&] {
    return number_at(map_of(called("run.state", {{"id", run}})), "time") == player().time();
  }));
  // Back to an earlier row: the scene and the state go there.
  player().set_time(0.1);
  ASSERT_TRUE(until([&] {
    return std::fabs(number_at(map_of(called("run.state", {{"id", run}})), "time") - 0.1) < 1e-9;
  }));
  window_->actions().find("step_forward")->trigger();
  ASSERT_TRUE(until([&] { return player().time() > 0.1; }));
  EXPECT_LT(player().time(), 0.2);  // no state of the time before comes late
  // While the step runs, the entry would pause it; its last state may come late on a busy machine.
  const auto run_rests = [&] {
    return *map_of(called("run.state", {{"id", run}})).find("is_playing") == Value(false);
  };
  ASSERT_TRUE(until([&] { return run_rests() && !player().is_playing(); }));
  settle();
  player().set_speed(-1);
  const auto is_at_start = [&] { return player().time() <= 1e-9; };
  window_->actions().find("play")->trigger();
  if (!QTest::qWaitFor(is_at_start, 10'000)) window_->actions().find("play")->trigger();
  ASSERT_TRUE(until(is_at_start));
  QTest::mouseClick(widget<QToolButton>("timeline_stop"), Qt::LeftButton);
  settle();
  called("run.remove", {{"id", run}});
  settle();
}

TEST_F(TimelineTest, AFilmOfWhatMovesTheViewIsWrittenByItsForm) {
  const Handle run = shown_run();
  player().set_time(1);
  window_->actions().find("film")->trigger();
  CommandForm& form = *window_->palette().form();
  ASSERT_TRUE(until([&] { return form.command() == "recording.video" && form.form(); }));
  settle();
  photograph("film_form");
  Map values = form.values();
  EXPECT_EQ(handle_at(values, "id"), run);
  EXPECT_EQ(text_at(values, "world"), "pa10_circle");
  EXPECT_EQ(text_at(values, "file"), "pa10_circle.mp4");
  EXPECT_DOUBLE_EQ(number_at(values, "to"), player().to());
  const Vec3 eye = window_->current_view()->display().camera().eye();
  const Value* given = values.find("eye");
  ASSERT_NE(given, nullptr);
  EXPECT_NE(given->text().find(Value(eye[0]).text().substr(0, 4)), std::string::npos)
      << given->text();
  const std::string file = folder_.filePath("film.gif").toStdString();
  values.set("file", file);
  values.set("size", List{96, 64});
  values.set("fps", 5);
  values.set("from", 0.5);
  values.set("to", 1.5);
  form.fill(values);
  form.run(true);
  ASSERT_TRUE(until([&] { return !form.is_running(); }));
  EXPECT_TRUE(QFile::exists(shown(file))) << form.outcome().toStdString() << faults_of_form();
  QFile film(shown(file));
  ASSERT_TRUE(film.open(QFile::ReadOnly));
  EXPECT_EQ(film.read(6), "GIF89a");
}

TEST_F(TimelineTest, AFilmOfNothingSaysSo) {
  std::vector<std::string> failures;
  QObject listener;
  desk_->failed.add(&listener, [&](const Error& e) { failures.push_back(e.sentence()); });
  window_->actions().find("film")->trigger();
  ASSERT_EQ(failures.size(), 1u);
  EXPECT_NE(failures[0].find("no recording or live run moves the current view"), std::string::npos);
}

TEST_F(TimelineTest, AFilmAndAPictureOfALiveRunAreOfItsRowsSoFar) {
  shown_run();
  const Handle run =
      made("world.start_run", {{"id", world_},
                               {"of", "inverse_kinematics"},
                               {"with", Map{{"robot", "pa10"}, {"trajectory", "circle"}}}});
  timeline().on_open(run);
  ASSERT_TRUE(until([&] { return player().is_run(); }));
  called("run.seek", {{"id", run}, {"time", 1.0}});
  ASSERT_TRUE(until([&] { return player().time() == 1.0; }));
  window_->actions().find("film")->trigger();
  CommandForm& form = *window_->palette().form();
  ASSERT_TRUE(until([&] { return form.command() == "recording.video" && form.form(); }));
  const auto filmed = handle_at(form.values(), "id");
  ASSERT_TRUE(filmed && filmed->kind == "recording");
  EXPECT_NEAR(number_at(form.values(), "to"), 1.0, 1e-9);
  window_->actions().find("save_picture")->trigger();
  ASSERT_TRUE(until([&] { return form.command() == "world.render" && form.form(); }));
  settle();
  photograph("picture_form");
  Map values = form.values();
  EXPECT_DOUBLE_EQ(number_at(values, "at"), 1.0);
  ASSERT_TRUE(handle_at(values, "recording"));
  const std::string file = folder_.filePath("picture.png").toStdString();
  values.set("file", file);
  values.set("size", List{160, 120});
  values.set("quality", "draft");
  form.fill(values);
  form.run();
  ASSERT_TRUE(until([&] { return !form.is_running(); }));
  const QImage image(shown(file));
  EXPECT_EQ(image.size(), QSize(160, 120)) << form.outcome().toStdString() << faults_of_form();
  // The next picture is of the document: nothing of the recording is left in the form.
  window_->current_view()->rest();
  settle();
  window_->actions().find("save_picture")->trigger();
  ASSERT_TRUE(until([&] {
    const Value* recording = form.values().find("recording");
    return !recording || recording->is_nil();
  }));
  called("run.remove", {{"id", run}});
  settle();
}

TEST_F(TimelineTest, ASavedPictureShowsWhatTheViewShows) {
  shown_run();
  ViewTab& view = *window_->current_view();
  const auto saved = [&] {
    settle();
    window_->actions().find("save_picture")->trigger();
    CommandForm& form = *window_->palette().form();
    EXPECT_TRUE(until([&] { return form.command() == "world.render" && form.form(); }));
    settle();
    return form.values();
  };
  const auto is_given = [](const Map& values, const char* name) {
    const Value* v = values.find(name);
    return v && !v->is_nil() && !(v->as_list() && v->as_list()->empty());
  };
  const Map plain = saved();
  for (const char* name : {"without", "fade", "layers", "section"})
    EXPECT_FALSE(is_given(plain, name)) << name;
  ViewLook look = view.look();
  look.layers = {"labels"};
  look.section_axis = 2;
  look.section_share = 0.75;
  view.set_look(look);
  ASSERT_TRUE(view.fade({{view.what(), "robots.pa10"}}, 0.4));
  const Map faded = saved();
  ASSERT_TRUE(is_given(faded, "fade"));
  const Map& first = map_of(list_at(faded, "fade").front());
  EXPECT_EQ(text_at(first, "path"), "robots.pa10");
  EXPECT_DOUBLE_EQ(number_at(first, "opacity"), 0.4);
  EXPECT_EQ(list_at(faded, "layers").front().text(), "labels");
  ASSERT_TRUE(view.drawn().section);
  EXPECT_DOUBLE_EQ(number_at(map_of(*faded.find("section")), "offset"),
                   view.drawn().section->point[2]);
  view.show_member("robots.pa10", false);
  Map hidden = saved();
  EXPECT_EQ(list_at(hidden, "without").front().text(), "robots.pa10");
  CommandForm& form = *window_->palette().form();
  const auto drawn = [&](Map values, const QString& name) {
    values.set("file", folder_.filePath(name).toStdString());
    values.set("size", List{160, 120});
    values.set("quality", "draft");
    form.fill(values);
    form.run();
    EXPECT_TRUE(until([&] { return !form.is_running(); }));
    const QImage image(folder_.filePath(name));
    EXPECT_EQ(image.size(), QSize(160, 120)) << form.outcome().toStdString();
    return image;
  };
  const QImage without = drawn(hidden, "hidden.png");
  hidden.set("without", Value());
  EXPECT_NE(drawn(hidden, "shown.png"), without);
  // A film has them, too, but no overlays.
  window_->actions().find("film")->trigger();
  ASSERT_TRUE(until([&] { return form.command() == "recording.video" && form.form(); }));
  settle();
  EXPECT_EQ(list_at(form.values(), "without").front().text(), "robots.pa10");
  // Trajectories that the view does not show are not in its pictures and films either.
  ASSERT_TRUE(view.live().show_layer("paths", false).ok());
  EXPECT_EQ(text_at(saved(), "paths"), "none");
  window_->actions().find("film")->trigger();
  ASSERT_TRUE(until([&] { return form.command() == "recording.video" && form.form(); }));
  settle();
  EXPECT_EQ(text_at(form.values(), "paths"), "none");
  view.show_all();
}

/// An event may be delivered before the answer to an earlier question, which is then out of date.
TEST_F(TimelineTest, AnAnswerThatAnEventOvertookDoesNotMoveTheTimeBack) {
  shown_run();
  const Handle run =
      made("world.start_run", {{"id", world_},
                               {"of", "inverse_kinematics"},
                               {"with", Map{{"robot", "pa10"}, {"trajectory", "circle"}}}});
  window_->current_view()->show_run(run);
  ASSERT_TRUE(player().is_run());  // it has asked for the state
  const auto answer = desk_->ask("run.seek", {{"id", run}, {"time", 1.0}}, {});
  QElapsedTimer clock;
  clock.start();
  while (!answer.result() && clock.elapsed() < kPatienceMs) QThread::msleep(1);  // no delivery
  ASSERT_TRUE(answer.result() && answer.result()->ok());
  settle();
  EXPECT_EQ(player().time(), 1.0);
  called("run.remove", {{"id", run}});
  settle();
}

TEST_F(TimelineTest, ALiveRunContinuesFromTheTimeShownAndRestartsByTheMenu) {
  made("material.create", {{"name", "wood"}, {"density", 600}});
  const Handle box =
      made("solid.create", {{"name", "box"},
                            {"material", "wood"},
                            {"root", Map{{"kind", "box"}, {"x", 0.1}, {"y", 0.1}, {"z", 0.1}}}});
  world_ = made("world.create", {{"name", "cell"}});
  called("world.add_object", {{"id", world_}, {"what", box}, {"position", List{0.0, 0.0, 0.5}}});
  ASSERT_NE(window_->open_view(world_, "cell"), nullptr);
  settle();
  const Handle run = made("world.start_run",
                          {{"id", world_}, {"of", "physics"}, {"with", Map{{"duration", 3.0}}}});
  timeline().on_open(run);
  ASSERT_TRUE(until([&] { return player().is_run(); }));
  called("run.seek", {{"id", run}, {"time", 0.5}});
  called("run.seek", {{"id", run}, {"time", 0.2}});
  const auto rows = [&] { return whole_at(map_of(called("run.state", {{"id", run}})), "rows"); };
  ASSERT_EQ(rows(), 51);
  const auto choose = [&](const char* name) {
    QMenu* menu = widget<QMenu>("timeline_menu");
    Q_EMIT menu->aboutToShow();
    QAction* entry = menu->findChild<QAction*>(name);
    ASSERT_NE(entry, nullptr) << name;
    entry->trigger();
  };
  choose("run_refresh");
  EXPECT_TRUE(until([&] { return rows() == 21; }));
  choose("run_reset");
  EXPECT_TRUE(until([&] { return rows() == 1; }));
  called("run.remove", {{"id", run}});
  settle();
}

TEST_F(TimelineTest, DraggingABoreMovesTheTorquesAndUndoTakesThemBackBitForBit) {
  const Handle steel = made("material.create", {{"name", "heavy"}, {"density", 7850}});
  const Handle plate =
      made("solid.create",
           {{"name", "plate"},
            {"material", steel},
            {"root",
             Map{{"kind", "difference"},
                 {"name", "body"},
                 {"children",
                  List{Map{{"kind", "box"}, {"name", "block"}, {"x", 0.2}, {"y", 0.2}, {"z", 0.05}},
                       Map{{"kind", "cylinder"},
                           {"name", "bore"},
                           {"radius", 0.02},
                           {"height", 0.06},
                           {"position", List{0.0, 0.0, -0.005}}}}}}}});
  const Handle arm =
      made("robot.create", {{"name", "pendulum"},
                            {"convention", "dh"},
                            {"mass_source", "designed"},
                            {"base", List{0.0, 0.0, 0.0, 1.5707963267948966, 0.0, 0.0}},
                            {"links", List{Map{{"name", "swing"},
                                               {"joint", "revolute"},
                                               {"a", 0.5},
                                               {"parts", List{Map{{"what", plate}}}}}}}});
  const Handle path =
      made("trajectory.create",
           {{"name", "turn"},
            {"sample_time", 0.01},
            {"segments", List{Map{{"shape", "ptp"}, {"joints", List{List{0.0}, List{1.0}}}}}}});
  world_ = made("world.create", {{"name", "cell"}});
  called("world.add_robot", {{"id", world_}, {"robot", arm}});
  called("world.add_trajectory", {{"id", world_}, {"trajectory", path}});
  ASSERT_NE(window_->open_view(world_, "cell"), nullptr);
  settle();
  const Handle run = made("world.inverse_dynamics",
                          {{"id", world_}, {"robot", "pendulum"}, {"trajectory", "turn"}});
  show(run);
  timeline().set_following(true);
  const auto torques = [&] {
    return *called("recording.values", {{"id", run}, {"columns", "tau1"}}).as_array();
  };
  const NumericArray before = torques();
  const double mass_before = number_at(map_of(called("solid.mass", {{"id", plate}})), "mass");

  desk_->select({{plate, "nodes.bore"}});
  NumberField* radius = nullptr;
  ASSERT_TRUE(until([&] {
    SchemaForm* form = window_->properties().form();
    radius = form ? dynamic_cast<NumberField*>(form->field("radius")) : nullptr;
    return radius != nullptr;
  }));
  settle();
  const auto curve = [&] { return lanes().lanes()[0].curves[0].series; };
  const auto was = curve();
  const QPoint start(60, radius->height() / 2);
  QTest::mousePress(radius, Qt::LeftButton, {}, start);
  const auto move = [&](int by) {
    const QPointF at = start + QPoint(by, 0);
    QMouseEvent event(QEvent::MouseMove, at, radius->mapToGlobal(at), Qt::NoButton, Qt::LeftButton,
                      {});
    QApplication::sendEvent(radius, &event);
  };
  move(6);
  move(20);
  // The plot follows before the mouse is released.
  ASSERT_TRUE(until([&] { return curve() != was; }));
  double slowest = 0;
  for (int i = 2; i < 8; ++i) {
    const auto last = curve();
    QElapsedTimer clock;
    clock.start();
    move(20 * i);
    ASSERT_TRUE(until([&] { return curve() != last; }));
    slowest = std::max(slowest, static_cast<double>(clock.nsecsElapsed()) * 1e-6);
  }
  std::printf("a dragged bore: torques of 100 samples after at most %.0f ms\n", slowest);
  RecordProperty("slowest_torque_ms", std::to_string(slowest));
  QTest::mouseRelease(radius, Qt::LeftButton, {}, start + QPoint(140, 0));
  // Behind the last edit and the end of the gesture; then the torques of both are current.
  called("document.history", {{"at_most", 1}});
  ASSERT_TRUE(until([&] {
    return !flag_at(map_of(called("recording.is_stale", {{"id", run}})), "stale");
  }));
  settle();
  const NumericArray after = torques();
  ASSERT_EQ(after.size(), before.size());
  const double mass_after = number_at(map_of(called("solid.mass", {{"id", plate}})), "mass");
  EXPECT_LT(mass_after, mass_before);
  EXPECT_LT(after[0], before[0]);
  ASSERT_TRUE(until([&] { return !lanes().is_dimmed(); }));
  EXPECT_DOUBLE_EQ(curve()->values()[0], after[0]);
  photograph("timeline_bore");

  window_->actions().find("undo")->trigger();
  ASSERT_TRUE(until([&] { return torques() == before; }));
  settle();
  EXPECT_EQ(number_at(map_of(called("solid.mass", {{"id", plate}})), "mass"), mass_before);
  ASSERT_TRUE(until([&] { return curve()->values()[0] == before[0]; }));
  EXPECT_TRUE(std::equal(curve()->values().begin(), curve()->values().end(), before.data().begin(),
                         before.data().end()));
  timeline().set_following(false);
}

TEST_F(TimelineTest, AMillionPointsStayPleasant) {
  shown_run();
  constexpr std::size_t kRows = 1'000'000;
  std::vector<double> time(kRows), wave(kRows);
  for (std::size_t i = 0; i < kRows; ++i) {
    time[i] = 1e-4 * static_cast<double>(i);
    wave[i] = std::sin(1e-3 * static_cast<double>(i)) + 1e-3 * static_cast<double>(i % 7);
  }
  const Handle big = made(
      "recording.create",
      {{"title", "big"},
       {"columns",
        List{Map{{"name", "time"}, {"unit", "s"}, {"values", NumericArray(std::move(time))}},
             Map{{"name", "wave"}, {"unit", "N m"}, {"values", NumericArray(std::move(wave))}}}}});
  show(big);
  EXPECT_LE(lanes().drawn_points(), 3u * 1600u);
  // The median: pictures of the view are drawn on this thread, too.
  std::vector<double> spent;
  for (int i = 0; i < 21; ++i) {
    const double before = spent_ms();
    timeline().axis().zoom(0.8, 37);
    QApplication::processEvents();
    spent.push_back(spent_ms() - before);
    EXPECT_LE(lanes().drawn_points(), 3u * 1600u);
  }
  std::sort(spent.begin(), spent.end());
  RecordProperty("slowest_draw_ms", std::to_string(spent.back()));
  std::printf("a million points: a redraw takes %.2f ms of the processor, the slowest %.2f ms\n",
              spent[10], spent.back());
}

TEST_F(TimelineTest, EveryWidgetHasItsNamesInBothThemesAndZoomed) {
  shown_run();
  player().set_time(25);
  for (const QWidget* w : timeline().findChildren<QWidget*>()) {
    // Parts of Qt's own widgets.
    if (w->objectName().startsWith("qt_") || !w->parentWidget() ||
        QString(w->metaObject()->className()).startsWith("QScrollBar") ||
        qobject_cast<const QMenu*>(w) || w->inherits("QAbstractItemView") ||
        w->inherits("QComboBoxPrivateContainer") || w->objectName().isEmpty())
      continue;
    EXPECT_FALSE(w->accessibleName().isEmpty()) << w->objectName().toStdString();
    EXPECT_FALSE(w->toolTip().isEmpty()) << w->objectName().toStdString();
  }
  window_->set_theme_and_zoom(false, 1);
  settle();
  photograph("timeline_light");
  window_->set_theme_and_zoom(true, 1.5);
  settle();
  photograph("timeline_dark_150");
  EXPECT_LE(lanes().lane_rect(0).bottom(), lanes().height());
  window_->set_theme_and_zoom(true, 1);
  settle();
}

TEST_F(TimelineTest, AProgramIsRunLiveFromTheMenuAndPausedSteppedAndStopped) {
  const Handle arm = made("robot.create", {{"name", "arm"}, {"links", List{Map{{"a", 0.3}}}}});
  const Handle count = made("program.create", {{"name", "count"},
                                               {"source",
                                                "PROGRAM count;\nVAR INT: i;\nBEGIN\n"
                                                "  FOR i := 1 TO 100\n    WAIT 0.1 SEC;\n"
                                                "  ENDFOR;\nENDPROGRAM;\n"}});
  world_ = made("world.create", {{"name", "cell"}});
  const Handle hall = made("world.create", {{"name", "hall"}});
  called("world.add_robot", {{"id", world_}, {"robot", arm}});
  called("world.add_program", {{"id", world_}, {"program", count}, {"name", "counter"}});
  ASSERT_NE(window_->open_view(hall, "hall"), nullptr);
  settle();
  // The record is a member of the other world.
  desk_->select({{count, ""}});
  QAction* live = window_->actions().find("run_live_tasks");
  ASSERT_NE(live, nullptr);
  EXPECT_TRUE(live->isEnabled());
  EXPECT_FALSE(window_->actions().find("run_live_physics")->menu());
  live->trigger();
  CommandPalette& palette = window_->palette();
  ASSERT_TRUE(until([&] { return palette.isVisible() && palette.has_form(); }));
  ASSERT_EQ(palette.form()->command(), "world.start_run");
  const Map filled = palette.form()->values();
  EXPECT_TRUE(handle_at(filled, "id") == world_ || text_at(filled, "id") == "cell");
  EXPECT_EQ(text_at(filled, "of"), "tasks");
  EXPECT_EQ(text_at(map_at(filled, "with"), "program"), "counter");
  QTest::keyClick(palette.form(), Qt::Key_Return, Qt::ControlModifier);
  auto* show = widget<QPushButton>("command_form.show_result");
  ASSERT_TRUE(until([&] { return show->isVisible(); })) << faults_of_form();
  EXPECT_TRUE(until([&] { return window_->console().text().contains("world.start_run{"); }));
  QTest::mouseClick(show, Qt::LeftButton);
  ASSERT_TRUE(until([&] {
    const ViewTab* view = window_->current_view();
    return view && view->what() == world_ && view->run();
  }));
  palette.hide();
  settle();
  const Handle run = *window_->current_view()->run();
  const auto state = [&](const char* field) {
    return number_at(map_of(called("run.state", {{"id", run}})), field);
  };
  QAction* play = window_->actions().find("play");
  ASSERT_TRUE(until([&] { return play->isEnabled(); }));
  play->trigger();
  ASSERT_TRUE(until([&] { return player().is_playing() && player().time() > 0.1; }));
  play->trigger();
  ASSERT_TRUE(until([&] { return !player().is_playing(); }));
  settle();
  EXPECT_FALSE(window_->console().text().contains("window.trigger{action = \"play\"}"))
      << "a live run has the lines of run.play and run.pause";
  const double row = state("row");
  window_->actions().find("step_forward")->trigger();
  EXPECT_TRUE(until([&] { return state("row") == row + 1; }));
  click("timeline_stop");
  EXPECT_TRUE(until([&] { return window_->console().text().contains("run.stop{"); }) ||
              window_->console().text().contains(":stop("));
  settle();
  EXPECT_LT(state("time"), 9);
}

TEST_F(TimelineTest, PlotsAreVisibleBesideTheBandsInUsualSizes) {
  shown_run();
  show(made("world.inverse_dynamics", {{"id", world_},
                                       {"robot", "pa10"},
                                       {"trajectory", "circle"},
                                       {"sample_time", 0.5},
                                       {"clearance", true}}));
  player().set_time(25);
  for (const QSize size : {QSize(1920, 1200), QSize(1440, 900)})
    for (const bool is_dark : {true, false}) {
      window_->resize(size);
      window_->set_theme_and_zoom(is_dark, 1);
      window_->reset_layout();
      settle();
      photograph(
          ("timeline_" + std::to_string(size.width()) + (is_dark ? "_dark" : "_light")).c_str());
      ASSERT_EQ(window_->size(), size);
      const QWidget* port = widget<QScrollArea>("timeline_scroll")->viewport();
      const QRect seen =
          QRect(lanes().mapTo(port, QPoint(0, 0)), lanes().size()).intersected(port->rect());
      ASSERT_EQ(lanes().lanes().size(), 2u);
      EXPECT_GE(seen.height(), lanes().lane_rect(0).height() * 3 / 2) << size.width();
      EXPECT_GE(seen.height(), theme().px(100)) << size.width();
    }
  window_->set_theme_and_zoom(true, 1);
  settle();
}

}  // namespace
}  // namespace robomosp::viewer
