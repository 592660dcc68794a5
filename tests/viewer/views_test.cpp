// SPDX-License-Identifier: GPL-3.0-or-later
// Four views and stereo pictures of a display; under Xvfb and without a display.
#include "viewer/window/views.h"

#include <cmath>
#include <memory>

#include <QApplication>
#include <QLabel>
#include <QTest>

#include <gtest/gtest.h>

#include "viewer/scene/linear.h"
#include "viewer/synthetic.h"
#include "viewer/window/display.h"

namespace robomosp::viewer {
namespace {

class ViewsTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = Display::create();
    ASSERT_TRUE(made.ok()) << made.error().sentence();
    display = std::move(*made);
    display->resize(800, 600);
    display->set_frame(synthetic::robot_cell());
    display->show();
    ASSERT_TRUE(QTest::qWaitFor([&] { return display->pictures_drawn() > 0; }, 60000));
    settle();
  }
  void settle() const {
    for (int before = -1; before != display->pictures_drawn();) {
      before = display->pictures_drawn();
      QTest::qWait(150);
    }
  }
  /// Mean difference of two pictures of one size [0..255].
  static double difference(const QImage& a, const QImage& b) {
    double sum = 0;
    int n = 0;
    for (int y = 0; y < a.height(); y += 2)
      for (int x = 0; x < a.width(); x += 2, ++n)
        sum += std::abs(qGray(a.pixel(x, y)) - qGray(b.pixel(x, y)));
    return sum / std::max(n, 1);
  }
  std::unique_ptr<Display> display;
};

TEST_F(ViewsTest, FourViewsShowTheSceneFromFourSidesEachWithItsCamera) {
  const OrbitCamera before = display->camera();
  display->set_four_view(true);
  settle();
  EXPECT_TRUE(display->has_four_view());
  EXPECT_EQ(display->active_pane(), 1U);
  const QImage shown = display->shown();
  const int w = shown.width() / 2, h = shown.height() / 2;
  for (const auto& [a, b] : {std::pair{QRect(0, 0, w, h), QRect(w, 0, w, h)},
                             {QRect(0, h, w, h), QRect(w, h, w, h)},
                             {QRect(0, 0, w, h), QRect(0, h, w, h)}})
    EXPECT_GT(difference(shown.copy(a), shown.copy(b)), 2);
  // From above, the up direction of the picture is not that of the world.
  display->activate_pane(0);
  EXPECT_GT(display->camera().backward()[2], 0.99);
  EXPECT_FALSE(display->camera().perspective());
  display->activate_pane(2);
  EXPECT_NEAR(display->camera().backward()[1], -1, 1e-6);
  display->set_four_view(false);
  settle();
  EXPECT_EQ(display->camera().width(), before.width());
}

TEST_F(ViewsTest, AClickPicksInTheViewThatItIsIn) {
  display->set_four_view(true);
  settle();
  for (std::size_t pane = 0; pane < 4; ++pane) {
    display->activate_pane(pane);
    const Vec3 on_table{0.92, -0.45, 0.34};
    const auto pixel = display->camera().project(on_table);
    ASSERT_TRUE(pixel);
    const double r = display->devicePixelRatioF();
    const QPointF at = display->pane_origin() + QPointF((*pixel)[0] / r, (*pixel)[1] / r);
    display->activate_pane((pane + 1) % 4);
    std::optional<Pick> picked;
    display->on_pick = [&](const std::optional<Pick>& hit) { picked = hit; };
    QTest::mouseClick(display.get(), Qt::LeftButton, {}, at.toPoint());
    EXPECT_EQ(display->active_pane(), pane);
    ASSERT_TRUE(picked) << pane;
  }
}

TEST_F(ViewsTest, EveryViewPicksWithItsCameraWhicheverIsActive) {
  display->set_four_view(true);
  settle();
  const auto views = display->views();
  ASSERT_EQ(views.size(), 4U);
  const double r = display->devicePixelRatioF();
  for (std::size_t i = 0; i < 4; ++i) {
    const auto pixel = views[i].camera.project({0.92, -0.45, 0.34});
    ASSERT_TRUE(pixel);
    const QPointF at = views[i].place.topLeft() + QPointF((*pixel)[0] / r, (*pixel)[1] / r);
    display->activate_pane(i);
    const auto as_active = display->pick(at);
    EXPECT_TRUE(display->active_view().place.contains(at)) << i;
    display->activate_pane((i + 2) % 4);
    const auto as_other = display->pick(at);
    EXPECT_FALSE(display->active_view().place.contains(at)) << i;
    ASSERT_TRUE(as_active && as_other) << i;
    EXPECT_EQ(as_active->id, as_other->id) << i;
    EXPECT_NEAR(norm(as_active->point - as_other->point), 0, 1e-9) << i;
    EXPECT_EQ(display->view_at(at).place, views[i].place) << i;
    EXPECT_TRUE(display->activate_at(at)) << i;
    EXPECT_FALSE(display->activate_at(at)) << i;
    EXPECT_EQ(display->active_pane(), i);
  }
}

TEST_F(ViewsTest, ADragMovesOnlyTheCameraOfItsView) {
  display->set_four_view(true);
  settle();
  display->activate_pane(0);
  const OrbitCamera top = display->camera();
  display->activate_pane(1);
  const OrbitCamera before = display->camera();
  QTest::mousePress(display.get(), Qt::MiddleButton, {}, QPoint(600, 100));
  const QPoint to(640, 130);
  QMouseEvent move(QEvent::MouseMove, to, display->mapToGlobal(to), Qt::NoButton, Qt::MiddleButton,
                   Qt::NoModifier);
  QApplication::sendEvent(display.get(), &move);
  QTest::mouseRelease(display.get(), Qt::MiddleButton, {}, to);
  EXPECT_GT(norm(display->camera().target() - before.target()), 1e-4);
  display->activate_pane(0);
  EXPECT_EQ(display->camera(), top);
}

TEST_F(ViewsTest, TheActiveViewIsFramedAndNamed) {
  display->set_four_view(true);
  settle();
  auto* title = display->findChild<QLabel*>("pane_front");
  ASSERT_TRUE(title);
  EXPECT_TRUE(title->isVisible());
  auto* line = display->findChild<QLabel*>("pane_line_2");
  ASSERT_TRUE(line);
  // The still at rest must not cover them.
  const QObjectList stack = display->children();
  EXPECT_GT(stack.indexOf(title), stack.indexOf(display->findChild<QWidget*>("display_overlay")));
  const int was = line->y();
  display->activate_pane(3);
  EXPECT_NE(line->y(), was);
  display->set_four_view(false);
  EXPECT_FALSE(display->findChild<QLabel*>("pane_front"));
}

TEST_F(ViewsTest, StereoPicturesDifferFromPlainOnesAndPickingStaysRight) {
  const QImage plain = display->shown();
  const Vec3 on_table{0.92, -0.45, 0.34};
  for (const Stereo mode : {Stereo::anaglyph, Stereo::side_by_side, Stereo::interlaced}) {
    StereoSettings settings;
    settings.mode = mode;
    settings.eye_distance = 0.2;
    display->set_stereo(settings);
    settle();
    EXPECT_GT(difference(display->shown(), plain), 0.3) << static_cast<int>(mode);
    const auto pixel = display->camera().project(on_table);
    ASSERT_TRUE(pixel);
    const double r = display->devicePixelRatioF();
    const auto hit = display->pick({(*pixel)[0] / r, (*pixel)[1] / r});
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->name, "table");
    if (mode == Stereo::side_by_side) {
      const auto other = display->pick({(*pixel)[0] / r + 400, (*pixel)[1] / r});
      ASSERT_TRUE(other);
      EXPECT_EQ(other->id, hit->id);
    }
  }
  display->set_stereo({});
  settle();
  EXPECT_LT(difference(display->shown(), plain), 0.5);
}

// Software OpenGL is copied and a graphics card is not: what is seen is the same.
TEST_F(ViewsTest, TheMethodOfDrawingDoesNotShow) {
  auto made = Display::create({}, DrawingMethod::window);
  ASSERT_TRUE(made.ok()) << made.error().sentence();
  const std::unique_ptr<Display> other = std::move(*made);
  if (other->drawing_method() != DrawingMethod::window)
    GTEST_SKIP() << "windows of this platform have no OpenGL";
  ASSERT_EQ(display->drawing_method(), DrawingMethod::copied);
  other->resize(display->size());
  other->set_frame(synthetic::robot_cell());
  other->show();
  ASSERT_TRUE(QTest::qWaitFor([&] { return other->pictures_drawn() > 0; }, 60000));
  const auto compare = [&](const char* what) {
    settle();
    QTest::qWait(200);  // for the other display
    const QImage a = display->shown(), b = other->shown();
    ASSERT_EQ(a.size(), b.size()) << what;
    EXPECT_LT(difference(a, b), 0.01) << what;
    // Names and lines lie over four views.
    if (!display->has_four_view()) {
      EXPECT_LT(difference(display->grab().toImage(), a), 0.01) << what;
    }
  };
  compare("one view");
  for (const Stereo mode : {Stereo::anaglyph, Stereo::side_by_side, Stereo::interlaced}) {
    StereoSettings settings;
    settings.mode = mode;
    settings.eye_distance = 0.2;
    for (Display* each : {display.get(), other.get()}) each->set_stereo(settings);
    compare("stereo");
  }
  for (Display* each : {display.get(), other.get()}) {
    each->set_stereo({});
    each->set_four_view(true);
  }
  compare("four views");
  for (Display* each : {display.get(), other.get()}) {
    each->set_four_view(false);
    each->resize(701, 433);
    each->set_dark(true);
  }
  compare("another size, dark");
}

TEST(StereoPair, EyesAreApartAndMeetAtTheConvergence) {
  OrbitCamera camera;
  camera.set_viewport(800, 600);
  StereoSettings settings;
  settings.mode = Stereo::interlaced;
  settings.eye_distance = 0.06;
  settings.convergence = 2;
  const auto pair = stereo_pair(camera, settings, {800, 600});
  ASSERT_EQ(pair.size(), 2U);
  EXPECT_NEAR(norm(pair[1].camera.eye() - pair[0].camera.eye()), 0.06, 1e-9);
  const auto x_of = [](const SceneShot& shot, const Vec3& p) {
    return (*shot.camera.project(p))[0] + shot.shift;
  };
  const Vec3 at = camera.eye() - 2 * camera.backward(),
             near = camera.eye() - 1.0 * camera.backward();
  EXPECT_NEAR(x_of(pair[0], at), x_of(pair[1], at), 1e-6);
  // What is nearer lies before the screen: the left eye sees it farther to the right.
  EXPECT_GT(x_of(pair[0], near), x_of(pair[1], near) + 1);
}

TEST(StereoPair, MixedPicturesHaveRowsOrColoursOfBothEyes) {
  QImage left(4, 4, QImage::Format_RGB32), right(4, 4, QImage::Format_RGB32);
  left.fill(Qt::white);
  right.fill(Qt::black);
  const std::vector<SceneShot> shots(2);
  const QImage rows = composed(shots, {left, right}, Stereo::interlaced, {4, 4});
  EXPECT_EQ(qGray(rows.pixel(1, 0)), 255);
  EXPECT_EQ(qGray(rows.pixel(1, 1)), 0);
  const QImage colours = composed(shots, {left, right}, Stereo::anaglyph, {4, 4});
  EXPECT_GT(qRed(colours.pixel(1, 1)), 250);
  EXPECT_LT(qBlue(colours.pixel(1, 1)), 5);
}

}  // namespace
}  // namespace robomosp::viewer
