// SPDX-License-Identifier: GPL-3.0-or-later
// Drives the picture as a widget with mouse and wheel; under Xvfb and on Qt's platform without a
// display.
#include "viewer/window/display.h"

#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <QApplication>
#include <QTest>
#include <QWheelEvent>

#include <gtest/gtest.h>

#include "viewer/scene/linear.h"
#include "viewer/synthetic.h"
#include "viewer/theme/theme.h"
#include "viewer/window/check_display.h"
#include "viewer/window/pace.h"

namespace robomosp::viewer {
namespace {

const Vec3 kOnTable{0.92, -0.45, 0.34};  ///< the middle of the near upper side of the table [m]

/// With the method that suits this platform (`automatic`) and with that for graphics cards.
class DisplayTest : public testing::TestWithParam<DrawingMethod> {
 protected:
  void SetUp() override {
    auto made = Display::create({}, GetParam());
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    display = std::move(*made);
    if (GetParam() == DrawingMethod::window && display->drawing_method() != GetParam())
      GTEST_SKIP() << "windows of this platform have no OpenGL";
    display->resize(900, 600);
    display->set_frame(synthetic::robot_cell());
    display->show();
    ASSERT_TRUE(QTest::qWaitFor([&] { return display->pictures_drawn() > 0; }, 60000));
    settle();
  }
  /// Waits until nothing is repainted any more.
  void settle() const {
    for (int before = -1; before != display->pictures_drawn();) {
      before = display->pictures_drawn();
      QTest::qWait(150);
    }
  }
  void drag(Qt::MouseButton button, Qt::KeyboardModifiers keys, QPoint from, QPoint by) const {
    QTest::mousePress(display.get(), button, keys, from);
    for (int i = 1; i <= 8; ++i) {
      const QPoint at = from + by * i / 8.0;
      QMouseEvent move(QEvent::MouseMove, at, display->mapToGlobal(at), Qt::NoButton, button, keys);
      QApplication::sendEvent(display.get(), &move);
    }
    QTest::mouseRelease(display.get(), button, keys, from + by);
  }
  void wheel(QPointF at, int steps) const {
    QWheelEvent event(at, display->mapToGlobal(at), {}, {0, 120 * steps}, Qt::NoButton,
                      Qt::NoModifier, Qt::NoScrollPhase, false);
    QApplication::sendEvent(display.get(), &event);
  }
  [[nodiscard]] QPoint place_of(const Vec3& p) const {
    const auto pixel = *display->camera().project(p);
    const double r = display->devicePixelRatioF();
    return {static_cast<int>(pixel[0] / r), static_cast<int>(pixel[1] / r)};
  }
  static std::size_t colours(const QImage& image) {
    std::set<QRgb> found;
    for (int y = 0; y < image.height(); y += 3)
      for (int x = 0; x < image.width(); x += 3) found.insert(image.pixel(x, y));
    return found.size();
  }
  static double brightness(const QImage& image) {
    double sum = 0;
    for (int y = 0; y < image.height(); y += 5)
      for (int x = 0; x < image.width(); x += 5) sum += qGray(image.pixel(x, y));
    return sum;
  }
  std::unique_ptr<Display> display;
};

TEST_P(DisplayTest, ADragOfTheBackgroundCirclesTheTarget) {
  const OrbitCamera before = display->camera();
  ASSERT_FALSE(display->pick({6, 6}));
  drag(Qt::LeftButton, Qt::NoModifier, {6, 6}, {80, 30});
  EXPECT_GT(norm(display->camera().eye() - before.eye()), 0.1);
  EXPECT_NEAR(norm(display->camera().target() - before.target()), 0, 1e-12);
  EXPECT_NEAR(display->camera().distance(), before.distance(), 1e-12);
}

TEST_P(DisplayTest, ADragOfABodyCirclesThePointUnderTheCursor) {
  const QPoint at = place_of(kOnTable);
  const auto hit = display->pick(at);
  ASSERT_TRUE(hit);
  const Vec3 eye = display->camera().eye();
  drag(Qt::LeftButton, Qt::NoModifier, at, {80, -30});
  EXPECT_GT(norm(display->camera().eye() - eye), 0.1);
  EXPECT_LE((place_of(hit->point) - at).manhattanLength(), 3);
  EXPECT_TRUE(display->is_touched());
}

TEST_P(DisplayTest, ShiftDragAndMiddleButtonMoveTheTarget) {
  for (const auto& [button, keys] :
       {std::pair{Qt::LeftButton, Qt::ShiftModifier}, {Qt::MiddleButton, Qt::NoModifier}}) {
    const OrbitCamera before = display->camera();
    drag(button, keys, {300, 300}, {40, 16});
    const auto pixel = *display->camera().project(before.target());
    const double r = display->devicePixelRatioF();
    EXPECT_NEAR(pixel[0] - (*before.project(before.target()))[0], 40 * r, 1);
    EXPECT_NEAR(pixel[1] - (*before.project(before.target()))[1], 16 * r, 1);
    EXPECT_EQ(display->camera().backward(), before.backward());
  }
}

TEST_P(DisplayTest, TheWheelZoomsTowardsTheCursorAndFitReturns) {
  const OrbitCamera before = display->camera();
  wheel({200, 150}, 3);
  EXPECT_NEAR(display->camera().distance(), before.distance() / std::pow(1.15, 3), 1e-9);
  EXPECT_GT(norm(display->camera().target() - before.target()), 1e-3);
  display->fit();
  EXPECT_NEAR(display->camera().distance(), before.distance(), 1e-9);
}

TEST_P(DisplayTest, AClickPicksTheItemAndADragDoesNot) {
  std::vector<std::optional<Pick>> picks;
  display->on_pick = [&](const std::optional<Pick>& hit) { picks.push_back(hit); };
  QTest::mouseClick(display.get(), Qt::LeftButton, {}, place_of(kOnTable));
  ASSERT_EQ(picks.size(), 1U);
  ASSERT_TRUE(picks[0]);
  EXPECT_EQ(picks[0]->name, "table");
  EXPECT_NEAR(picks[0]->point[2], 0.34, 1e-3);
  QTest::mouseClick(display.get(), Qt::LeftButton, {}, QPoint(6, 6));
  ASSERT_EQ(picks.size(), 2U);
  EXPECT_FALSE(picks[1]);
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {60, 0});
  EXPECT_EQ(picks.size(), 2U);
}

TEST_P(DisplayTest, FlyingShowsItemsInTheMiddleAndKeepsTheDirection) {
  const auto hit = display->pick(place_of(kOnTable));
  ASSERT_TRUE(hit);
  const Vec3 backward = display->camera().backward();
  const double distance = display->camera().distance();
  display->fly_to({hit->id});
  EXPECT_TRUE(QTest::qWaitFor(
      [&] {
        if (display->camera().distance() >= 0.95 * distance) return false;
        const auto middle = display->pick({display->width() / 2.0, display->height() / 2.0});
        return middle && middle->name == "table";
      },
      60000));
  EXPECT_NEAR(norm(display->camera().backward() - backward), 0, 1e-9);
}

TEST_P(DisplayTest, TheDarkStudioIsDarker) {
  const QImage light = display->shown();
  display->set_dark(true);
  settle();
  EXPECT_LT(brightness(display->shown()), 0.6 * brightness(light));
  EXPECT_GT(colours(display->shown()), 200U);
}

TEST_P(DisplayTest, NothingIsRepaintedWhileNothingChanges) {
  const int drawn = display->pictures_drawn();
  QTest::qWait(400);
  EXPECT_EQ(display->pictures_drawn(), drawn);
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {30, 0});
  settle();
  EXPECT_GT(display->pictures_drawn(), drawn);
}

TEST_P(DisplayTest, APictureFollowsItsFrame) {
  const QImage with_grid = display->shown();
  EXPECT_GT(colours(with_grid), 200U);
  Frame frame = synthetic::robot_cell();
  frame.grid = false;
  display->set_frame(frame);
  settle();
  EXPECT_NE(display->shown(), with_grid);
}

TEST_P(DisplayTest, AStillIsDrawnBesideTheWindow) {
  const auto still = display->still(320, 200);
  ASSERT_TRUE(still.ok()) << still.error().sentence();
  EXPECT_EQ(still->width, 320);
  // The widget still works after it.
  const int drawn = display->pictures_drawn();
  wheel({200, 150}, 1);
  settle();
  EXPECT_GT(display->pictures_drawn(), drawn);
  EXPECT_GT(colours(display->shown()), 200U);
}

TEST_P(DisplayTest, AfterAMotionAllPixelsAreDrawn) {
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {60, 20});
  for (int i = 0; i < 5; ++i) {
    wheel({200, 150}, i % 2 == 0 ? 1 : -1);
    QApplication::processEvents();
  }
  settle();
  EXPECT_FALSE(display->is_coarse());
  const QImage at_rest = display->shown();
  const int drawn = display->pictures_drawn();
  display->set_refining(false);  // draws again
  settle();
  EXPECT_GT(display->pictures_drawn(), drawn);
  EXPECT_EQ(display->shown(), at_rest);
}

TEST_P(DisplayTest, APictureTakenWhileTheViewMovesHasAllPixels) {
  for (int i = 0; i < 6; ++i) {
    wheel({200, 150}, i % 2 == 0 ? 1 : -1);
    QApplication::processEvents();
  }
  const QImage moving = display->shown();
  EXPECT_FALSE(display->is_coarse());
  settle();
  EXPECT_EQ(display->shown(), moving);
}

INSTANTIATE_TEST_SUITE_P(By, DisplayTest,
                         testing::Values(DrawingMethod::automatic, DrawingMethod::window),
                         [](const auto& tested) {
                           return tested.param == DrawingMethod::window ? "Window" : "Automatic";
                         });

TEST(Pace, FewerPixelsWhereTheyTakeLongAndAllWhereTheyDoNot) {
  const auto after = [](Pace pace, double fixed, double per_picture) {
    double seconds = 0;
    for (int i = 0; i < 40; ++i) {
      const double share = pace.share();
      seconds = fixed + per_picture * share * share;
      pace.drawn(share, seconds);
    }
    return std::pair(pace, seconds);
  };
  Pace pace;
  EXPECT_EQ(pace.share(), 1);
  // 60 ms a picture: as many pixels as the aim allows.
  const auto [slow, seconds] = after(pace, 0.004, 0.056);
  EXPECT_LT(slow.share(), 0.7);
  EXPECT_GT(slow.share(), 0.35);
  EXPECT_LT(seconds, 1.2 * Pace::kAim);
  EXPECT_GT(seconds, 0.6 * Pace::kAim);
  // Never less than what shows shapes, and all of them again when the machine is free.
  EXPECT_EQ(after(slow, 0.2, 1).first.share(), Pace::kLeast);
  EXPECT_EQ(after(slow, 0.001, 0.006).first.share(), 1);
  // A fast machine never has fewer.
  Pace fast;
  for (int i = 0; i < 100; ++i) {
    fast.drawn(1, 0.004);
    EXPECT_EQ(fast.share(), 1);
  }
}

TEST_P(DisplayTest, AtRestThePictureIsReplacedByAStillUntilSomethingMoves) {
  const QImage quick = display->shown();
  display->set_refining(true);
  ASSERT_TRUE(QTest::qWaitFor([&] { return display->is_refined(); }, 60000));
  EXPECT_NE(display->shown(), quick);
  drag(Qt::LeftButton, Qt::NoModifier, {300, 300}, {40, 20});
  EXPECT_FALSE(display->is_refined());
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
    if (robomosp::viewer::check_display().ok()) return 1;
    if (!platform.isEmpty()) qputenv("QT_QPA_PLATFORM", platform);
    if (!x.isEmpty()) qputenv("DISPLAY", x);
    if (!wayland.isEmpty()) qputenv("WAYLAND_DISPLAY", wayland);
  }
  QApplication application(argc, argv);
  robomosp::viewer::set_theme(application, robomosp::viewer::make_theme(true));
  return RUN_ALL_TESTS();
}
