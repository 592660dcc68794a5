// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.planner/1 (layer: contract helper for tests, GoogleTest,
// header-only): paths through walls with a known shortest length, judged by its own checks.
// Include it in one file of a test program and instantiate PlannerConformance with PlannerCase
// values.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/planner.h>

namespace robomosp::conformance {

struct PlannerCase {
  std::string file, provider;
  /// Greatest length of a path over the shortest one; infinity = it only looks for some path.
  double length = std::numeric_limits<double>::infinity();
};
inline void PrintTo(const PlannerCase& c, std::ostream* os) { *os << c.provider; }

/// Points of the unit cube (of dof dimensions) among boxes that must not be touched; a box bounds
/// the first dimensions only.
struct BoxWorld {
  struct Box {
    std::vector<double> lower, upper;
  };
  std::size_t dof = 2;
  std::vector<Box> boxes;
  std::vector<double> start, goals, lower, upper, weight;
  double seconds = 120;  // for loaded machines; all are done in less than one
  std::uint64_t seed = 7;

  explicit BoxWorld(std::size_t joints) : dof(joints) {
    lower.assign(dof, 0), upper.assign(dof, 1), weight.assign(dof, 1);
  }
  /// Whether the straight path from a to b meets no box: it is cut by one dimension after the
  /// other.
  [[nodiscard]] bool is_free(std::span<const double> a, std::span<const double> b) const {
    return std::none_of(boxes.begin(), boxes.end(), [&](const Box& box) {
      double from = 0, to = 1;
      for (std::size_t k = 0; k < box.lower.size(); ++k) {
        const double d = b[k] - a[k];
        if (d == 0) {
          if (a[k] < box.lower[k] || a[k] > box.upper[k]) return false;
          continue;
        }
        const double t0 = (box.lower[k] - a[k]) / d, t1 = (box.upper[k] - a[k]) / d;
        from = std::max(from, std::min(t0, t1));
        to = std::min(to, std::max(t0, t1));
      }
      return from <= to;
    });
  }
  [[nodiscard]] PlanProblem problem() const {
    PlanProblem p;
    p.dof = dof;
    p.lower = lower, p.upper = upper, p.weight = weight, p.start = start, p.goals = goals;
    p.seconds = seconds, p.seed = seed;
    p.is_free = [this](std::span<const double> q) { return is_free(q, q); };
    p.is_free_between = [this](std::span<const double> a, std::span<const double> b) {
      return is_free(a, b);
    };
    return p;
  }
  /// A wall across the square with a gap 0.04 high in its middle; the start and the goal lie on
  /// either side.
  static BoxWorld door() {
    BoxWorld w(2);
    w.boxes = {{{0.45, -1}, {0.55, 0.48}}, {{0.45, 0.52}, {0.55, 2}}};
    w.start = {0.1, 0.1};
    w.goals = {0.9, 0.1};
    return w;
  }
  /// The shortest path through the gap bends around both of its lower corners.
  static double door_length() { return 2 * std::hypot(0.35, 0.38) + 0.1; }
};

class PlannerConformance : public testing::TestWithParam<PlannerCase> {
 protected:
  void SetUp() override {
    auto found = find_provider<Planner>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    planner_ = create<Planner>(**found);
    ASSERT_TRUE(planner_);
    params_ = TableParams(**found);
  }
  Result<Plan> plan(const BoxWorld& w) {
    NoProgress none;
    return planner_->plan(w.problem(), params_, none);
  }
  /// The length of a plan that keeps its contract, in the metric of the weights.
  static double checked_length(const BoxWorld& w, const Plan& plan) {
    const std::size_t n = w.dof;
    EXPECT_EQ(plan.points.size() % n, 0U);
    EXPECT_GE(plan.points.size(), n);
    EXPECT_LT(plan.goal, w.goals.size() / n);
    if (testing::Test::HasFailure()) return 0;
    double length = 0;
    for (std::size_t j = 0; j < n; ++j) {
      EXPECT_EQ(plan.points[j], w.start[j]);
      EXPECT_EQ(plan.points[plan.points.size() - n + j], w.goals[plan.goal * n + j]);
    }
    for (std::size_t k = 0; k < plan.points.size() / n; ++k) {
      const std::span<const double> to(&plan.points[k * n], n),
          from(&plan.points[(k - !!k) * n], n);
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j) {
        EXPECT_GE(to[j], w.lower[j]);
        EXPECT_LE(to[j], w.upper[j]);
        sum += std::pow(w.weight[j] * (to[j] - from[j]), 2);
      }
      length += std::sqrt(sum);
      EXPECT_TRUE(w.is_free(from, to)) << "motion " << k;
    }
    return length;
  }
  std::string refusal(const BoxWorld& w) {
    const auto r = plan(w);
    EXPECT_FALSE(r.ok());
    return r.ok() ? "" : r.error().sentence();
  }
  std::unique_ptr<Planner> planner_;
  TableParams params_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(PlannerConformance);

TEST_P(PlannerConformance, NarrowDoorsAreFound) {
  const BoxWorld w = BoxWorld::door();
  const auto found = plan(w);
  ASSERT_TRUE(found.ok()) << found.error().sentence();
  const double length = checked_length(w, *found);
  EXPECT_GE(length, BoxWorld::door_length() * (1 - 1e-12));
  EXPECT_LE(length, BoxWorld::door_length() * GetParam().length);
}

TEST_P(PlannerConformance, NothingInTheWay) {
  for (const std::size_t dof : {1U, 3U, 7U}) {
    BoxWorld w(dof);
    w.start.assign(dof, 0.25);
    w.goals.assign(dof, 0.75);
    const auto found = plan(w);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    const double length = checked_length(w, *found), straight = 0.5 * std::sqrt(double(dof));
    EXPECT_GE(length, straight * (1 - 1e-12));
    EXPECT_LE(length, straight * GetParam().length);
  }
}

// A wall with a window in six dimensions, joints of different ranges and weights.
TEST_P(PlannerConformance, SixJointsThroughAWindow) {
  BoxWorld w(6);
  w.lower = {-1, -2, -1, -3, -3, -3};
  w.upper = {1, 2, 1, 3, 3, 3};
  w.weight = {3, 1, 2, 0.5, 0.5, 0.25};
  w.boxes = {{{-0.1, -9}, {0.1, 0.5}}, {{-0.1, 1.1}, {0.1, 9}}};
  w.start = {-0.8, -1, 0, 0, 1, -1};
  w.goals = {0.8, -1, 0.4, -1, 0, 2};
  const auto found = plan(w);
  ASSERT_TRUE(found.ok()) << found.error().sentence();
  EXPECT_GT(checked_length(w, *found), 3 * 1.6);
}

// Of three goals the first is within a box, the second in a closed space.
TEST_P(PlannerConformance, AnyOfTheGoalsWillDo) {
  BoxWorld w = BoxWorld::door();
  w.boxes.push_back({{0.7, 0.6}, {0.72, 0.9}});
  w.boxes.push_back({{0.88, 0.6}, {0.9, 0.9}});
  w.boxes.push_back({{0.7, 0.6}, {0.9, 0.62}});
  w.boxes.push_back({{0.7, 0.88}, {0.9, 0.9}});
  w.goals = {0.5, 0.9, 0.8, 0.75, 0.9, 0.1};
  const auto found = plan(w);
  ASSERT_TRUE(found.ok()) << found.error().sentence();
  EXPECT_EQ(found->goal, 2U);
  checked_length(w, *found);
}

TEST_P(PlannerConformance, TheStartMayBeTheGoal) {
  BoxWorld w = BoxWorld::door();
  w.goals = w.start;
  const auto found = plan(w);
  ASSERT_TRUE(found.ok()) << found.error().sentence();
  EXPECT_EQ(checked_length(w, *found), 0);
}

TEST_P(PlannerConformance, EqualSeedsGiveEqualPlans) {
  BoxWorld w = BoxWorld::door();
  const auto first = plan(w);
  ASSERT_TRUE(first.ok()) << first.error().sentence();
  w.seed = 8;
  const auto other = plan(w);
  ASSERT_TRUE(other.ok()) << other.error().sentence();
  w.seed = 7;
  const auto again = plan(w);
  ASSERT_TRUE(again.ok()) << again.error().sentence();
  EXPECT_EQ(first->points, again->points);
  EXPECT_NE(first->points, other->points);
}

TEST_P(PlannerConformance, SeveralThreadsGetTheSamePlansAtOnce) {
  const BoxWorld w = BoxWorld::door();
  const auto alone = plan(w);
  ASSERT_TRUE(alone.ok()) << alone.error().sentence();
  std::array<std::vector<double>, 3> together;
  at_once(together.size(), [&](std::size_t thread) {
    const auto found = plan(w);
    EXPECT_TRUE(found.ok()) << (found.ok() ? "" : found.error().sentence());
    if (found.ok()) together[thread] = found->points;
  });
  for (const auto& points : together) EXPECT_EQ(points, alone->points);
}

TEST_P(PlannerConformance, StartsAndGoalsInCollisionAreTold) {
  BoxWorld w = BoxWorld::door();
  w.start = {0.5, 0.1};
  EXPECT_NE(refusal(w).find("start"), std::string::npos);
  w = BoxWorld::door();
  w.goals = {0.5, 0.1};
  EXPECT_NE(refusal(w).find("goal"), std::string::npos);
  w.goals = {0.5, 0.1, 0.5, 0.9};
  EXPECT_NE(refusal(w).find("goal"), std::string::npos);
}

TEST_P(PlannerConformance, NoWayEndsWithTheTime) {
  BoxWorld w = BoxWorld::door();
  w.boxes.push_back({{0.4, -1}, {0.44, 2}});
  w.seconds = 0.1;
  const auto r = plan(w);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::unreachable) << r.error().sentence();
}

TEST_P(PlannerConformance, CancelledInTheMidst) {
  class Cancels final : public Progress {
   public:
    void report(double fraction, std::string_view) override {
      EXPECT_GE(fraction, 0);
      EXPECT_LE(fraction, 1);
    }
    bool cancelled() const override { return ++asked_ > 100; }

   private:
    mutable int asked_ = 0;
  };
  BoxWorld w = BoxWorld::door();
  w.boxes.push_back({{0.4, -1}, {0.44, 2}});  // or it could be done before
  w.seconds = 600;
  Cancels progress;
  const auto r = planner_->plan(w.problem(), params_, progress);
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().code, ErrorCode::cancelled) << r.error().sentence();
}

// The function that tests a configuration may be cancelled at any moment, too, and then
// returns false for everything, including the start.
TEST_P(PlannerConformance, CancelledWhileAnyCheckIsMade) {
  class Stopped final : public Progress {
   public:
    void report(double, std::string_view) override {}
    bool cancelled() const override { return is_stopped; }
    bool is_stopped = false;
  };
  for (int after = 0; after < 40; ++after) {
    BoxWorld w = BoxWorld::door();
    w.boxes.push_back({{0.4, -1}, {0.44, 2}});
    w.seconds = 20;
    Stopped progress;
    int asked = 0;
    PlanProblem p = w.problem();
    const auto stopped = [&] {
      return progress.is_stopped = progress.is_stopped || asked++ >= after;
    };
    p.is_free = [&](std::span<const double> q) { return !stopped() && w.is_free(q, q); };
    p.is_free_between = [&](std::span<const double> a, std::span<const double> b) {
      return !stopped() && w.is_free(a, b);
    };
    const auto began = std::chrono::steady_clock::now();
    const auto r = planner_->plan(p, params_, progress);
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    EXPECT_FALSE(r.ok()) << "stopped at check " << after;
    EXPECT_LT(took.count(), 10) << "stopped at check " << after;
  }
}

TEST_P(PlannerConformance, BrokenInputIsRefusedInASentence) {
  const auto refused = [&](auto&& change) {
    BoxWorld w = BoxWorld::door();
    change(w);
    return !refusal(w).empty();
  };
  EXPECT_TRUE(refused([](BoxWorld& w) { w.goals.clear(); })) << "no goal";
  EXPECT_TRUE(refused([](BoxWorld& w) { w.goals.pop_back(); })) << "half a goal";
  EXPECT_TRUE(refused([](BoxWorld& w) { w.start.pop_back(); })) << "half a start";
  EXPECT_TRUE(refused([](BoxWorld& w) { w.start[0] = std::nan(""); })) << "not a number";
  EXPECT_TRUE(refused([](BoxWorld& w) { w.start[0] = -0.5; })) << "outside the limits";
  EXPECT_TRUE(refused([](BoxWorld& w) { w.goals[1] = 1.5; })) << "goal outside the limits";
  EXPECT_TRUE(refused([](BoxWorld& w) { std::swap(w.lower, w.upper); })) << "limits swapped";
  EXPECT_TRUE(refused([](BoxWorld& w) { w.upper[0] = std::numeric_limits<double>::infinity(); }))
      << "no limit";
  EXPECT_TRUE(refused([](BoxWorld& w) { w.weight[1] = 0; })) << "no weight";
  EXPECT_TRUE(refused([](BoxWorld& w) { w.seconds = 0; })) << "no time";
}

}  // namespace robomosp::conformance
