// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/playback.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "viewer/synthetic.h"

namespace robomosp::viewer {
namespace {

using synthetic::turned;

Playback half_turn() {
  // 0 to 170 degrees about z while moving 2 m along x, in one second.
  const double end = 170.0 / 180.0 * std::numbers::pi;
  return {{1.0, 2.0}, {42}, {turned({0, 0, 1}, 0), turned({0, 0, 1}, end, {2, 0, 0})}};
}

TEST(Playback, BetweenSamplesItTurnsAtConstantRate) {
  const Playback p = half_turn();
  for (const double u : {0.0, 0.1, 0.25, 0.5, 0.9, 1.0}) {
    const auto poses = poses_at(p, 1 + u);
    ASSERT_EQ(poses.size(), 1U);
    const Pose expected = turned({0, 0, 1}, u * 170.0 / 180.0 * std::numbers::pi, {2 * u, 0, 0});
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(poses[0].R[i], expected.R[i], 1e-12);
    EXPECT_NEAR(poses[0].p[0], expected.p[0], 1e-12);
  }
}

TEST(Playback, HalfTurnsAboutEveryAxisInterpolateToRotations) {
  for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{0.6, 0, 0.8}}) {
    const Playback p{{0, 1}, {1}, {turned(axis, 0), turned(axis, std::numbers::pi)}};
    const auto at = poses_at(p, 0.5);
    const Pose square = synthetic::chained({at[0].R, {}}, {at[0].R, {}});
    const Pose whole = turned(axis, std::numbers::pi);
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(square.R[i], whole.R[i], 1e-12);
  }
}

TEST(Playback, OutsideItsTimesItStandsStill) {
  const Playback p = half_turn();
  EXPECT_EQ(poses_at(p, -5)[0].p, p.poses.front().p);
  EXPECT_EQ(poses_at(p, 99)[0].p, p.poses.back().p);
  EXPECT_DOUBLE_EQ(duration(p), 1.0);
}

TEST(Playback, AnUnusableOneIsToldInASentence) {
  Playback p = half_turn();
  EXPECT_TRUE(check(p).ok());
  p.times = {2.0, 1.0};
  EXPECT_EQ(check(p).error().sentence(),
            "time number 2 of the playback is not larger than the previous one. Give finite, "
            "strictly increasing times in seconds.");
  p = half_turn();
  p.poses.pop_back();
  EXPECT_EQ(check(p).error().message,
            "the playback has 1 poses, but 2 times and 1 moving items need 2");
  EXPECT_TRUE(poses_at(p, 1.5).empty());
  p = half_turn();
  p.poses[1].p[0] = NAN;
  EXPECT_EQ(check(p).error().message, "pose number 2 of the playback is not finite");
}

}  // namespace
}  // namespace robomosp::viewer
