// SPDX-License-Identifier: Apache-2.0
// Ways made shorter and round, in the plane with walls.
#include "sim/joint_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include <robomosp/sdk/conformance/planner_suite.h>

namespace robomosp::sim {
namespace {

using conformance::BoxWorld;

bool is_free_along(const BoxWorld& w, std::span<const double> points) {
  for (std::size_t i = 1; i < points.size() / w.dof; ++i)
    if (!w.is_free(points.subspan((i - 1) * w.dof, w.dof), points.subspan(i * w.dof, w.dof)))
      return false;
  return true;
}

const std::vector<double> kHalfSpeed{0.5};  ///< of the motions beside the one corner

/// A detour through the door of the wall.
const std::vector<double> kDetour{0.1, 0.1, 0.1, 0.9, 0.3, 0.5, 0.7, 0.5, 0.9, 0.9, 0.9, 0.1};

TEST(JointPath, IsMadeAlmostAsShortAsCanBe) {
  const BoxWorld w = BoxWorld::door();
  const PlanProblem p = w.problem();
  NoProgress none;
  const double before = path_length(p, kDetour);
  EXPECT_NEAR(before, 0.8 + std::hypot(0.2, 0.4) + 0.4 + std::hypot(0.2, 0.4) + 0.8, 1e-12);
  const auto few = shorten(p, kDetour, 0, none), many = shorten(p, kDetour, 400, none);
  ASSERT_TRUE(few.ok() && many.ok());
  EXPECT_TRUE(is_free_along(w, *many));
  EXPECT_LT(path_length(p, *few), before);
  EXPECT_GE(path_length(p, *many), BoxWorld::door_length());
  EXPECT_LT(path_length(p, *many), 1.01 * BoxWorld::door_length());
  const auto again = shorten(p, kDetour, 400, none);
  EXPECT_EQ(*many, *again);
}

TEST(JointPath, LengthsAreThoseOfTheWeights) {
  BoxWorld w(2);
  w.weight = {3, 0.5};
  EXPECT_NEAR(path_length(w.problem(), std::vector{0.0, 0.0, 1.0, 8.0}), 5, 1e-12);
}

TEST(JointPath, ShorteningIsCancelled) {
  class Stopped final : public Progress {
    void report(double, std::string_view) override {}
    bool cancelled() const override { return true; }
  } stopped;
  const BoxWorld w = BoxWorld::door();
  const auto r = shorten(w.problem(), kDetour, 10, stopped);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled);
}

// A right angle with legs of 0.5, rounded over all of them: the middle of the curve is
// 3.5 / 32 (a + b) + 25 / 32 p of its ends and corner, by the middle weights 1, 5, 10 of 32.
TEST(JointPath, CornersAreRoundWithoutKinks) {
  BoxWorld w(2);
  const std::vector<double> angle{0, 0, 1, 0, 1, 1};
  const auto round = round_corners(w.problem(), angle, kHalfSpeed, [](auto, bool) { return true; });
  EXPECT_EQ(round.sharp, 0U);
  const auto& q = round.points;
  const std::size_t n = q.size() / 2;
  double nearest = 1, sharpest = 1;
  for (std::size_t i = 0; i < n; ++i) {
    nearest = std::min(nearest, std::hypot(q[2 * i] - 1, q[2 * i + 1]));
    if (i == 0 || i + 1 == n) continue;
    const double ax = q[2 * i] - q[2 * i - 2], ay = q[2 * i + 1] - q[2 * i - 1],
                 bx = q[2 * i + 2] - q[2 * i], by = q[2 * i + 3] - q[2 * i + 1];
    sharpest = std::min(sharpest, (ax * bx + ay * by) / (std::hypot(ax, ay) * std::hypot(bx, by)));
  }
  EXPECT_NEAR(nearest, 3.5 / 32 * std::sqrt(0.5), 1e-12);
  EXPECT_GT(sharpest, std::cos(0.25));
}

TEST(JointPath, CornersWithoutRoomAreRoundedLessOrStay) {
  BoxWorld w(2);
  w.boxes = {{{0.0, 0.02}, {0.98, 1.0}}};
  const std::vector<double> angle{0, 0, 1, 0, 1, 1};
  const auto free = [&](std::span<const double> points, bool is_reduced) {
    return !is_reduced && is_free_along(w, points);
  };
  const auto round = round_corners(w.problem(), angle, kHalfSpeed, free);
  EXPECT_EQ(round.sharp, 0U);
  EXPECT_TRUE(free(round.points, false));
  w.boxes = {{{0.0, 1e-6}, {1 - 1e-6, 1.0}}};
  const auto sharp = round_corners(w.problem(), angle, kHalfSpeed, free);
  EXPECT_EQ(sharp.sharp, 1U);
  EXPECT_TRUE(free(sharp.points, false));
}

// The corner (1, 1) of a box that the way goes round at 2 mm: curves with the full clearance have
// no room, such with three quarters of it have, and pass the corner at 3.5 / 32 |a + b - 2 p| of
// legs short enough for that.
TEST(JointPath, CornersWithoutRoomAreRoundedWithLessClearance) {
  BoxWorld w(2);
  constexpr double kClearance = 2e-3;
  const std::vector<double> angle{0, 1, 1, 1, 1, 0};
  const auto nearest = [](std::span<const double> rows) {
    double least = 1;
    for (std::size_t i = 0; i < rows.size(); i += 2)  // to the corner of [0, 1 - c] x [0, 1 - c]
      least = std::min(least, std::hypot(std::max(rows[i] - (1 - kClearance), 0.0),
                                         std::max(rows[i + 1] - (1 - kClearance), 0.0)));
    return least;
  };
  const auto free = [&](std::span<const double> rows, bool is_reduced) {
    return nearest(rows) >= (is_reduced ? 0.75 : 1) * kClearance;
  };
  const auto round = round_corners(w.problem(), angle, kHalfSpeed, free);
  EXPECT_EQ(round.sharp, 0U);
  EXPECT_GE(nearest(round.points), 0.75 * kClearance);
  EXPECT_LT(nearest(round.points), kClearance);
}

// Turning back by 175 degrees the curve turns in a small part of its parameter: its chords turn
// little all the same, as what times the way stops where they do not.
TEST(JointPath, ChordsOfNarrowCornersTurnLittle) {
  BoxWorld w(2);
  const double back = 175 * std::acos(-1) / 180;
  const std::vector<double> angle{0, 0, 1, 0, 1 + std::cos(back), std::sin(back)};
  const auto round = round_corners(w.problem(), angle, kHalfSpeed, [](auto, bool) { return true; });
  const auto& q = round.points;
  double most = 0;
  for (std::size_t i = 1; i + 1 < q.size() / 2; ++i) {
    const double ax = q[2 * i] - q[2 * i - 2], ay = q[2 * i + 1] - q[2 * i - 1],
                 bx = q[2 * i + 2] - q[2 * i], by = q[2 * i + 3] - q[2 * i + 1];
    most = std::max(most, std::fabs(std::atan2(ax * by - ay * bx, ax * bx + ay * by)));
  }
  EXPECT_LT(most, 0.25);
}

// A short motion between two corners leaves them no room to be rounded by. Neither of its ends can
// be left out, as (0, 0.901) to (0.95, 0.89) cuts the box at x = 0.9; its middle (0.92, 0.92) will
// do for both.
TEST(JointPath, ShortMotionsBetweenCornersAreJoined) {
  BoxWorld w(2);
  w.boxes = {{{0.0, 0.0}, {0.9, 0.9}}};
  NoProgress none;
  const std::vector<double> way{0.0, 0.901, 0.89, 0.95, 0.95, 0.89, 0.901, 0.0};
  ASSERT_TRUE(is_free_along(w, way));
  const auto joined = shorten(w.problem(), way, 0, none);
  ASSERT_TRUE(joined.ok());
  ASSERT_EQ(joined->size(), 6U);
  EXPECT_NEAR((*joined)[2], 0.92, 1e-12);
  EXPECT_NEAR((*joined)[3], 0.92, 1e-12);
  EXPECT_LT(path_length(w.problem(), *joined), path_length(w.problem(), way));
  EXPECT_TRUE(is_free_along(w, *joined));
}

TEST(JointPath, ShorteningEndsWhenItIsLate) {
  const BoxWorld w = BoxWorld::door();
  NoProgress none;
  std::size_t tried = 0;
  const auto way = shorten(
      w.problem(), kDetour, 400, none, [&] { return tried >= 7; }, &tried);
  ASSERT_TRUE(way.ok());
  EXPECT_EQ(tried, 7U);
  EXPECT_TRUE(is_free_along(w, *way));
}

}  // namespace
}  // namespace robomosp::sim
