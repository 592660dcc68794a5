// SPDX-License-Identifier: GPL-3.0-or-later
// Drives the real window with mouse and keys; under Xvfb and on Qt's platform without a display.
#include "viewer/window/window.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <set>

#include <QAction>
#include <QApplication>
#include <QLabel>
#include <QSlider>
#include <QStatusBar>
#include <QTest>
#include <QTreeWidget>
#include <QWheelEvent>

#include <gtest/gtest.h>

#include "viewer/scene/linear.h"
#include "viewer/synthetic.h"
#include "viewer/window/theme.h"
#include "viewer/window/viewer_window.h"

namespace robomosp::viewer {
namespace {

/// The arm of the cell bends for two seconds.
Playback bending() {
  const Frame first = synthetic::robot_cell();
  Playback p;
  for (const Item& item : first.items) p.ids.push_back(item.id);
  p.ids.push_back(2001);
  for (int i = 0; i <= 20; ++i) {
    p.times.push_back(0.1 * i);
    const Frame at = synthetic::robot_cell(0.1 * i);
    for (const Item& item : at.items) p.poses.push_back(item.pose);
    p.poses.push_back(at.triads[0].pose);
  }
  return p;
}

class Window : public testing::Test {
 protected:
  void SetUp() override {
    auto display = Display::create({}, false);
    ASSERT_TRUE(display.ok()) << display.error().sentence();
    window = std::make_unique<ViewerWindow>(std::move(display).value());
    window->resize(1100, 720);
    window->set_frame(synthetic::robot_cell());
    window->set_playback(bending());
    window->show();
    ASSERT_TRUE(QTest::qWaitFor([&] { return view().pictures_drawn() > 0; }, 20000));
    // Without a window manager nobody else makes the window active, which shortcuts need.
    QApplication::setActiveWindow(window.get());
    settle();
  }
  [[nodiscard]] Display& view() const { return window->display(); }
  /// Waits until nothing is repainted any more.
  void settle() const {
    for (int before = -1; before != view().pictures_drawn();) {
      before = view().pictures_drawn();
      QTest::qWait(150);
    }
  }
  void drag(Qt::MouseButton button, Qt::KeyboardModifiers keys, QPoint from, QPoint by) const {
    QTest::mousePress(&view(), button, keys, from);
    for (int i = 1; i <= 8; ++i) {
      const QPointF at = from + by * i / 8.0;
      QMouseEvent move(QEvent::MouseMove, at, view().mapToGlobal(at), Qt::NoButton, button, keys);
      QApplication::sendEvent(&view(), &move);
    }
    QTest::mouseRelease(&view(), button, keys, from + by);
  }
  void wheel(QPointF at, int steps) const {
    QWheelEvent event(at, view().mapToGlobal(at), {}, {0, 120 * steps}, Qt::NoButton,
                      Qt::NoModifier, Qt::NoScrollPhase, false);
    QApplication::sendEvent(&view(), &event);
  }
  [[nodiscard]] QPoint place_of(const Vec3& p) const {
    const auto pixel = *view().camera().project(p);
    const double r = view().devicePixelRatioF();
    return QPoint(static_cast<int>(pixel[0] / r), static_cast<int>(pixel[1] / r));
  }
  static std::size_t colours(const QImage& image) {
    std::set<QRgb> found;
    for (int y = 0; y < image.height(); y += 3)
      for (int x = 0; x < image.width(); x += 3) found.insert(image.pixel(x, y));
    return found.size();
  }
  std::unique_ptr<ViewerWindow> window;
};

TEST_F(Window, DraggingOrbitsAboutTheTarget) {
  const OrbitCamera before = view().camera();
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {80, -30});
  EXPECT_GT(norm(view().camera().eye() - before.eye()), 0.1);
  EXPECT_NEAR(norm(view().camera().target() - before.target()), 0, 1e-12);
  EXPECT_NEAR(view().camera().distance(), before.distance(), 1e-12);
}

TEST_F(Window, ShiftDragAndMiddleButtonMoveTheTarget) {
  for (const auto& [button, keys] :
       {std::pair{Qt::LeftButton, Qt::ShiftModifier}, {Qt::MiddleButton, Qt::NoModifier}}) {
    const OrbitCamera before = view().camera();
    drag(button, keys, {300, 300}, {40, 16});
    const auto pixel = *view().camera().project(before.target());
    const double r = view().devicePixelRatioF();
    EXPECT_NEAR(pixel[0] - (*before.project(before.target()))[0], 40 * r, 1);
    EXPECT_NEAR(pixel[1] - (*before.project(before.target()))[1], 16 * r, 1);
    EXPECT_EQ(view().camera().backward(), before.backward());
  }
}

TEST_F(Window, TheWheelZoomsTowardsTheCursorAndFitReturns) {
  const OrbitCamera before = view().camera();
  wheel({200, 150}, 3);
  EXPECT_NEAR(view().camera().distance(), before.distance() / std::pow(1.15, 3), 1e-9);
  EXPECT_GT(norm(view().camera().target() - before.target()), 1e-3);
  QTest::keyClick(window.get(), Qt::Key_F);
  EXPECT_NEAR(view().camera().distance(), before.distance(), 1e-9);
}

TEST_F(Window, NumberKeysChooseViewsAndPTheProjection) {
  QTest::keyClick(window.get(), Qt::Key_6);
  EXPECT_NEAR(view().camera().backward()[2], 1, 1e-12);
  QTest::keyClick(window.get(), Qt::Key_2);
  EXPECT_NEAR(view().camera().backward()[1], -1, 1e-12);
  EXPECT_TRUE(view().camera().perspective());
  QTest::keyClick(window.get(), Qt::Key_P);
  EXPECT_FALSE(view().camera().perspective());
}

TEST_F(Window, AClickSelectsTheItemAndNamesIt) {
  std::optional<Pick> told;
  window->on_pick = [&](const std::optional<Pick>& hit) { told = hit; };
  // The middle of the near upper side of the table.
  const QPoint at = place_of({0.92, -0.45, 0.34});
  QTest::mouseClick(&view(), Qt::LeftButton, {}, at);
  ASSERT_TRUE(told);
  EXPECT_EQ(told->name, "table");
  EXPECT_NEAR(told->point[2], 0.34, 1e-3);
  EXPECT_EQ(window->selected_name(), "table");
  EXPECT_TRUE(window->statusBar()->currentMessage().startsWith("table"));
  QTest::mouseClick(&view(), Qt::LeftButton, {}, QPoint(5, 5));
  EXPECT_FALSE(told);
  EXPECT_EQ(window->selected_name(), "");
}

TEST_F(Window, ADragIsNotAClick) {
  int clicks = 0;
  window->on_pick = [&](const std::optional<Pick>&) { ++clicks; };
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {60, 0});
  EXPECT_EQ(clicks, 0);
}

TEST_F(Window, SpacePlaysAndPauses) {
  EXPECT_FALSE(window->is_playing());
  QTest::keyClick(window.get(), Qt::Key_Space);
  EXPECT_TRUE(window->is_playing());
  ASSERT_TRUE(QTest::qWaitFor([&] { return window->time() > 0.2; }, 20000));
  QTest::keyClick(window.get(), Qt::Key_Space);
  EXPECT_FALSE(window->is_playing());
  const double stopped = window->time();
  QTest::qWait(100);
  EXPECT_EQ(window->time(), stopped);
}

TEST_F(Window, WithoutRepeatItStopsAtTheEnd) {
  window->findChild<QAction*>("loop")->setChecked(false);
  window->set_speed(4);
  window->play(true);
  ASSERT_TRUE(QTest::qWaitFor([&] { return !window->is_playing(); }, 20000));
  EXPECT_DOUBLE_EQ(window->time(), 2.0);
  // Playing again starts over.
  window->play(true);
  EXPECT_LT(window->time(), 1.0);
}

TEST_F(Window, TheTimelineMovesTheRobot) {
  const QImage before = view().shown();
  window->findChild<QSlider*>("timeline")->setValue(5000);
  EXPECT_NEAR(window->time(), 1.0, 1e-9);
  EXPECT_EQ(window->findChild<QLabel*>("time")->text(), "1.00 s / 2.00 s");
  // The tool is where the motion puts it.
  const Vec3 gripper = synthetic::robot_cell(1.0).items[15].pose.p;
  const auto hit = view().pick(place_of(gripper));
  ASSERT_TRUE(hit);
  EXPECT_LT(norm(hit->point - gripper), 0.12);
  settle();
  EXPECT_NE(view().shown(), before);
}

TEST_F(Window, NothingIsRepaintedWhileNothingChanges) {
  const int drawn = view().pictures_drawn();
  QTest::qWait(400);
  EXPECT_EQ(view().pictures_drawn(), drawn);
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {30, 0});
  settle();
  EXPECT_GT(view().pictures_drawn(), drawn);
}

TEST_F(Window, ThePictureIsNotBlankAndFollowsASwitch) {
  const QImage with_grid = view().shown();
  EXPECT_GT(colours(with_grid), 200U);
  window->findChild<QAction*>("show_grid")->trigger();
  settle();
  EXPECT_NE(view().shown(), with_grid);
}

TEST_F(Window, TheMenuTurnsLayersOnAndOff) {
  auto* velocity = window->findChild<QAction*>("show_velocity_ellipsoid");
  auto* force = window->findChild<QAction*>("show_force_ellipsoid");
  ASSERT_TRUE(velocity && force);
  EXPECT_FALSE(velocity->isEnabled()) << "no scene has layers here";
  std::vector<std::pair<std::string, bool>> asked;
  window->set_layers(
      [&](const std::string& layer, bool is_shown) { asked.emplace_back(layer, is_shown); });
  EXPECT_TRUE(velocity->isEnabled() && force->isEnabled());
  EXPECT_TRUE(asked.empty()) << "nobody wants to see them yet";
  velocity->trigger();
  window->check_layer("force_ellipsoids");
  velocity->trigger();
  EXPECT_EQ(asked, (std::vector<std::pair<std::string, bool>>{{"velocity_ellipsoids", true},
                                                              {"force_ellipsoids", true},
                                                              {"velocity_ellipsoids", false}}));
  window->set_layers({});
  EXPECT_FALSE(force->isEnabled());
}

TEST_F(Window, ALiveSceneMovesAndChangesAndKeepsWhatTheUserChose) {
  // A timeline without poses: whoever hears the time moves the scene.
  Playback timeline;
  timeline.times = {0, 2};
  window->set_playback(timeline);
  std::vector<double> times;
  window->on_time = [&](double time) {
    times.push_back(time);
    window->update_scene(synthetic::robot_cell(time), true);
  };
  QTest::mouseClick(&view(), Qt::LeftButton, {}, place_of({0.92, -0.45, 0.34}));
  ASSERT_EQ(window->selected_name(), "table");
  window->findChild<QAction*>("style_flat")->trigger();
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {40, 20});
  window->update_scene(synthetic::robot_cell(), true);
  settle();
  const OrbitCamera camera = view().camera();
  const QImage before = view().shown();
  window->findChild<QSlider*>("timeline")->setValue(5000);
  ASSERT_EQ(times.size(), 1U);
  EXPECT_NEAR(times[0], 1, 1e-9);
  settle();
  EXPECT_NE(view().shown(), before);
  EXPECT_EQ(window->selected_name(), "table");
  EXPECT_TRUE(window->findChild<QAction*>("style_flat")->isChecked());
  EXPECT_NEAR(norm(view().camera().eye() - camera.eye()), 0, 1e-12);
  window->set_time(0);
  settle();
  EXPECT_EQ(view().shown(), before);
  window->play(true);
  ASSERT_TRUE(QTest::qWaitFor([&] { return times.back() > 0.2; }, 20000));
  window->play(false);
  // An item that is removed leaves the list of objects.
  const auto* list = window->findChild<QTreeWidget*>("objects");
  const int count = list->topLevelItemCount();
  Frame less = synthetic::robot_cell();
  less.items.pop_back();
  window->update_scene(less, false);
  EXPECT_EQ(list->topLevelItemCount(), count - 1);
}

TEST_F(Window, TheMenuChoosesTheDrawingStyle) {
  const auto action = [&](const char* name) { return window->findChild<QAction*>(name); };
  const auto save = [&](const char* name) {
    const auto file = std::filesystem::path(ROBOMOSP_BUILD_DIR) / name;
    EXPECT_TRUE(window->grab().save(QString::fromStdString(file.string())));
  };
  EXPECT_TRUE(action("style_smooth")->isChecked());
  std::set<std::string> pictures;
  for (const char* style : {"style_smooth", "style_flat", "style_wireframe", "style_hidden_line"}) {
    action(style)->trigger();
    settle();
    EXPECT_TRUE(action(style)->isChecked());
    EXPECT_EQ(action("show_hidden_edges")->isEnabled(), style == std::string("style_hidden_line"));
    const QImage image = view().shown();
    EXPECT_GT(colours(image), 2U) << style;
    EXPECT_TRUE(pictures
                    .insert(std::string(reinterpret_cast<const char*>(image.constBits()),
                                        static_cast<std::size_t>(image.sizeInBytes())))
                    .second)
        << style << " looks like another one";
    save((std::string("viewer_") + style + ".png").c_str());
  }
  // Something new to show is drawn in the chosen style.
  window->set_frame(synthetic::robot_cell(0.5));
  EXPECT_TRUE(action("style_hidden_line")->isChecked());
}

TEST_F(Window, TheMenuCutsWithAPlaneThatMovesAndTurns) {
  const auto action = [&](const char* name) { return window->findChild<QAction*>(name); };
  const QImage whole = view().shown();
  EXPECT_FALSE(action("section_forward")->isEnabled());
  action("section_y")->trigger();
  settle();
  EXPECT_TRUE(window->statusBar()->currentMessage().startsWith("Section at y = "));
  const QImage half = view().shown();
  EXPECT_NE(half, whole);
  window->grab().save(QString::fromStdString(
      (std::filesystem::path(ROBOMOSP_BUILD_DIR) / "viewer_section.png").string()));
  action("section_back")->trigger();
  settle();
  const QImage less = view().shown();
  EXPECT_NE(less, half);
  action("section_forward")->trigger();
  action("section_turn")->trigger();
  settle();
  EXPECT_NE(view().shown(), half);
  action("section_turn")->trigger();
  action("section_none")->trigger();
  settle();
  EXPECT_EQ(view().shown(), whole);
  EXPECT_FALSE(action("section_turn")->isEnabled());
}

TEST_F(Window, TheShadowIsOnTheFloor) {
  // Seen from above, without lines that could be mistaken for a shadow.
  window->set_frame([] {
    Frame f;
    f.grid = f.world_axes = false;
    f.items.push_back({77,
                       "cube",
                       synthetic::box(0.2, 0.2, 0.2),
                       {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0.2}},
                       {},
                       false});
    f.camera = {Camera::View::top, true, {}, {}, 0.25};
    return f;
  }());
  settle();
  const QImage image = view().shown();
  const double r = view().devicePixelRatioF();
  const QColor dark = image.pixelColor(place_of({0.03, 0.22, 0}) * r);
  const QColor bright = image.pixelColor(place_of({0.03, -0.35, 0}) * r);
  EXPECT_LT(dark.value(), bright.value() - 25);
}

TEST_F(Window, EveryWidgetThatWeMadeHasAName) {
  for (const char* name : {"display", "display_surface", "objects_dock", "objects", "main_bar",
                           "timeline", "time", "speed", "status", "menu_bar", "renderer"})
    EXPECT_NE(window->findChild<QWidget*>(name), nullptr) << name;
}

TEST_F(Window, AStillOfBestQualityShowsTheSameView) {
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {40, 20});
  const auto still = view().still(320, 200);
  ASSERT_TRUE(still.ok()) << still.error().sentence();
  EXPECT_EQ(still->width, 320);
  // The window still works after it.
  const int drawn = view().pictures_drawn();
  wheel({200, 150}, 1);
  settle();
  EXPECT_GT(view().pictures_drawn(), drawn);
  EXPECT_GT(colours(view().shown()), 200U);
}

TEST_F(Window, AtRestThePictureIsReplacedByAStillUntilSomethingMoves) {
  const QImage quick = view().shown();
  view().set_refining(true);
  ASSERT_TRUE(QTest::qWaitFor([&] { return view().is_refined(); }, 60000));
  EXPECT_NE(view().shown(), quick);
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {40, 20});
  EXPECT_FALSE(view().is_refined());
}

TEST_F(Window, AnUnusablePlaybackIsToldAndRefused) {
  Playback bad = bending();
  bad.times[3] = bad.times[2];
  window->set_playback(bad);
  EXPECT_TRUE(window->statusBar()->currentMessage().contains("time number 4"));
  EXPECT_FALSE(window->findChild<QAction*>("play")->isEnabled());
}

TEST(RunWindow, TakesAScreenshotAndEnds) {
  // This program runs on an X server and without one at the same time.
  const auto path = std::filesystem::path(ROBOMOSP_BUILD_DIR) /
                    ("viewer_window_" + QGuiApplication::platformName().toStdString() + ".png");
  std::filesystem::remove(path);
  WindowOptions options;
  options.title = "Test";
  options.screenshot = path.string();
  options.screenshot_after = 0.3;
  options.refine = false;
  bool was_shown = false;
  options.on_shown = [&](QWidget& w) { was_shown = w.isVisible(); };
  Frame frame = synthetic::robot_cell();
  frame.items[7].selected = true;
  EXPECT_EQ(run_window(frame, bending(), options), 0);
  EXPECT_TRUE(was_shown);
  EXPECT_FALSE(QImage(QString::fromStdString(path.string())).isNull());
}

TEST(RunWindow, AScreenshotThatCannotBeWrittenEndsWithOne) {
  WindowOptions options;
  options.screenshot = "/no/such/folder/w.png";
  options.screenshot_after = 0;
  options.refine = false;
  EXPECT_EQ(run_window(Frame{}, Playback{}, options), 1);
}

}  // namespace
}  // namespace robomosp::viewer

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  // Before there is a QApplication: refusal instead of Qt's abort.
  {
    const QByteArray platform = qgetenv("QT_QPA_PLATFORM"), x = qgetenv("DISPLAY"),
                     wayland = qgetenv("WAYLAND_DISPLAY");
    for (const char* name : {"QT_QPA_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY"}) qunsetenv(name);
    if (robomosp::viewer::run_window({}, {}, {}) != 1) return 1;
    if (!platform.isEmpty()) qputenv("QT_QPA_PLATFORM", platform);
    if (!x.isEmpty()) qputenv("DISPLAY", x);
    if (!wayland.isEmpty()) qputenv("WAYLAND_DISPLAY", wayland);
  }
  QApplication application(argc, argv);
  robomosp::viewer::apply_dark_theme(application);
  return RUN_ALL_TESTS();
}
