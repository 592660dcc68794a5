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
  const auto round = round_corners(w.problem(), angle, 0.5, [](auto) { return true; });
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
  const auto free = [&](std::span<const double> points) { return is_free_along(w, points); };
  const auto round = round_corners(w.problem(), angle, 0.5, free);
  EXPECT_EQ(round.sharp, 0U);
  EXPECT_TRUE(free(round.points));
  w.boxes = {{{0.0, 1e-6}, {1 - 1e-6, 1.0}}};
  const auto sharp = round_corners(w.problem(), angle, 0.5, free);
  EXPECT_EQ(sharp.sharp, 1U);
  EXPECT_TRUE(free(sharp.points));
}

}  // namespace
}  // namespace robomosp::sim
