// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/orbit_camera.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "viewer/scene/linear.h"

namespace robomosp::viewer {
namespace {

using View = Camera::View;

OrbitCamera camera_of(View view, bool perspective = true) {
  OrbitCamera c;
  c.set_viewport(1280, 800);
  c.set_perspective(perspective);
  c.look(view);
  return c;
}

/// Pixel at which matrices, not `project`, put a point.
std::array<double, 2> by_matrices(const OrbitCamera& c, const Vec3& p) {
  const auto apply = [](const Matrix4& m, const std::array<double, 4>& v) {
    std::array<double, 4> r{};
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j) r[i] += m[4 * i + j] * v[j];
    return r;
  };
  const auto clip = apply(c.projection(0.01, 100), apply(c.view(), {p[0], p[1], p[2], 1}));
  return {0.5 * c.width() * (1 + clip[0] / clip[3]), 0.5 * c.height() * (1 - clip[1] / clip[3])};
}

TEST(OrbitCamera, NamedViewsLookAlongTheirAxis) {
  const auto expect = [](View view, const Vec3& backward, const Vec3& up) {
    const OrbitCamera c = camera_of(view);
    EXPECT_NEAR(norm(c.backward() - backward), 0, 1e-12);
    EXPECT_NEAR(norm(c.up() - up), 0, 1e-12);
  };
  expect(View::front, {0, -1, 0}, {0, 0, 1});
  expect(View::back, {0, 1, 0}, {0, 0, 1});
  expect(View::left, {-1, 0, 0}, {0, 0, 1});
  expect(View::right, {1, 0, 0}, {0, 0, 1});
  expect(View::top, {0, 0, 1}, {0, 1, 0});
  expect(View::bottom, {0, 0, -1}, {0, -1, 0});
}

TEST(OrbitCamera, ProjectAgreesWithTheMatricesThatDraw) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1, 1);
  for (const bool perspective : {true, false}) {
    OrbitCamera c = camera_of(View::isometric, perspective);
    for (int i = 0; i < 50; ++i) {
      c.orbit(200 * place(random), 100 * place(random));
      const Vec3 p{place(random), place(random), place(random)};
      const auto pixel = c.project(p);
      ASSERT_TRUE(pixel);
      const auto expected = by_matrices(c, p);
      EXPECT_NEAR((*pixel)[0], expected[0], 1e-6);
      EXPECT_NEAR((*pixel)[1], expected[1], 1e-6);
    }
  }
}

TEST(OrbitCamera, TheRayOfAPixelMeetsThePointShownThere) {
  for (const bool perspective : {true, false}) {
    const OrbitCamera c = camera_of(View::isometric, perspective);
    const Vec3 p{0.3, -0.2, 0.7};
    const auto pixel = c.project(p);
    ASSERT_TRUE(pixel);
    const Ray ray = c.ray((*pixel)[0], (*pixel)[1]);
    EXPECT_NEAR(norm(ray.direction), 1, 1e-12);
    EXPECT_NEAR(norm(cross(p - ray.origin, ray.direction)), 0, 1e-9);
  }
}

TEST(OrbitCamera, FitBringsEveryPointInsideAndTouchesTheMargin) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> place(-3, 5);
  for (const bool perspective : {true, false}) {
    for (const View view : {View::isometric, View::top, View::front}) {
      OrbitCamera c = camera_of(view, perspective);
      std::vector<Vec3> points(40);
      for (Vec3& p : points) p = {place(random), place(random), 0.3 * place(random)};
      c.fit(points, 0.1);
      double nearest = 1e9;  // distance to the margin, in parts of the picture
      for (const Vec3& p : points) {
        const auto pixel = c.project(p);
        ASSERT_TRUE(pixel);
        const double x = (*pixel)[0] / c.width(), y = (*pixel)[1] / c.height();
        for (const double gap : {x - 0.1, 0.9 - x, y - 0.1, 0.9 - y}) {
          EXPECT_GT(gap, -1e-9);
          nearest = std::min(nearest, gap);
        }
      }
      EXPECT_NEAR(nearest, 0, 1e-9);
    }
  }
}

TEST(OrbitCamera, ZoomKeepsWhatIsUnderTheCursor) {
  for (const bool perspective : {true, false}) {
    OrbitCamera c = camera_of(View::isometric, perspective);
    // A point in the plane through the target.
    const Vec3 p = c.target() + 0.4 * c.right() + (-0.3) * c.up();
    const auto before = c.project(p);
    ASSERT_TRUE(before);
    c.zoom_at((*before)[0], (*before)[1], 1.7);
    const auto after = c.project(p);
    ASSERT_TRUE(after);
    EXPECT_NEAR((*after)[0], (*before)[0], 1e-9);
    EXPECT_NEAR((*after)[1], (*before)[1], 1e-9);
  }
}

TEST(OrbitCamera, PanMovesTheTargetWithTheMouse) {
  OrbitCamera c = camera_of(View::isometric);
  const Vec3 held = c.target();
  c.pan(50, -20);
  const auto pixel = c.project(held);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR((*pixel)[0], 640 + 50, 1e-9);
  EXPECT_NEAR((*pixel)[1], 400 - 20, 1e-9);
}

TEST(OrbitCamera, OrbitKeepsTargetAndDistanceAndStopsAtThePole) {
  OrbitCamera c = camera_of(View::isometric);
  const Vec3 target = c.target();
  const double distance = c.distance();
  c.orbit(300, 5000);
  EXPECT_EQ(c.target(), target);
  EXPECT_EQ(c.distance(), distance);
  EXPECT_NEAR(c.backward()[2], 1, 1e-12);
}

TEST(OrbitCamera, ChangingTheProjectionKeepsTheSizeAtTheTarget) {
  OrbitCamera c = camera_of(View::front);
  const Vec3 p = c.target() + 0.5 * c.up();
  const auto before = c.project(p);
  c.set_perspective(false);
  EXPECT_NEAR((*c.project(p))[1], (*before)[1], 1e-9);
}

TEST(OrbitCamera, UnusableInputChangesNothing) {
  OrbitCamera c = camera_of(View::front);
  const OrbitCamera was = c;
  c.look_from({1, 1, 1}, {1, 1, 1});
  c.look_from({NAN, 1, 1}, {0, 0, 0});
  c.zoom_at(0, 0, -1);
  c.zoom_at(0, 0, INFINITY);
  c.fit({});
  EXPECT_EQ(c, was);
}

}  // namespace
}  // namespace robomosp::viewer
