// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.ik/1 for providers that take any mechanism, several goals, parts of
// poses and objectives (layer: contract helper for tests, GoogleTest, header-only). Instantiate it:
//   INSTANTIATE_TEST_SUITE_P(MyIk, IkGoals, testing::Values(IkGoalsCase{"my_ik.so", "my_ik"}));
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/arms.h>
#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/ik.h>

namespace robomosp::conformance {

struct IkGoalsCase {
  std::string file, provider;
};
inline void PrintTo(const IkGoalsCase& c, std::ostream* os) { *os << c.provider; }

class IkGoals : public testing::TestWithParam<IkGoalsCase> {
 protected:
  void prepare(const RobotModel& m) {
    auto found = find_provider<IkSolver>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    model_ = m;
    solver_ = create<IkSolver>(**found);
    const auto prepared = solver_->prepare(model_, TableParams(**found));
    ASSERT_TRUE(prepared.ok()) << prepared.error().sentence();
  }
  std::vector<IkResult> solve(const IkBatch& batch) {
    std::vector<IkResult> results(batch.samples());
    NoProgress none;
    const auto done = solver_->solve(batch, results, none);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    return results;
  }
  void expect_within_limits(const std::vector<double>& q) const {
    ASSERT_EQ(q.size(), model_.coordinate_count());
    for (const JointModel& j : model_.joints) {
      if (coordinate_count(j.type) != 1) continue;
      const double own = q[static_cast<std::size_t>(j.q_index)];
      const double x = j.is_coupled() ? j.coupling.ratio * own + j.coupling.offset : own;
      EXPECT_GE(x, j.lower - 1e-12) << j.name;
      EXPECT_LE(x, j.upper + 1e-12) << j.name;
    }
  }
  [[nodiscard]] Vec3 axis_z(const Pose& t) const { return {t.R[2], t.R[5], t.R[8]}; }

  RobotModel model_;
  std::unique_ptr<IkSolver> solver_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(IkGoals);

TEST_P(IkGoals, SeveralTipsAreBroughtToTheirTargetsAtOnce) {
  for (const RobotModel& m : {tree(), floating_manipulator()}) {
    SCOPED_TRACE(m.name);
    prepare(m);
    Random random(31);
    const IkGoal goals[] = {{0, kIkPose, 1}, {1, kIkPosition, 1}};
    std::vector<Pose> targets;
    for (int i = 0; i < 30; ++i) {
      const auto q = random.configuration(m);
      targets.push_back(tip_pose(m, q.data(), 0));
      targets.push_back(tip_pose(m, q.data(), 1));
    }
    IkBatch batch;
    batch.goals = goals;
    batch.targets = targets;
    const auto results = solve(batch);
    for (std::size_t i = 0; i < results.size(); ++i) {
      SCOPED_TRACE(i);
      ASSERT_EQ(results[i].status, IkStatus::solved) << results[i].detail;
      expect_within_limits(results[i].q);
      const double* q = results[i].q.data();
      EXPECT_LE(position_gap(tip_pose(m, q, 0), targets[2 * i]), 1e-9);
      EXPECT_LE(rotation_gap(tip_pose(m, q, 0), targets[2 * i]), 1e-9);
      EXPECT_LE(position_gap(tip_pose(m, q, 1), targets[2 * i + 1]), 1e-9);
    }
  }
}

TEST_P(IkGoals, PartsOfATargetLeaveTheRestFree) {
  const RobotModel m = panda();
  prepare(m);
  Random random(32);
  for (int i = 0; i < 30; ++i) {
    const Pose target = tip_pose(m, random.configuration(m).data());
    IkBatch batch;
    batch.targets = {&target, 1};
    const auto at = [&](std::uint32_t parts) {
      const IkGoal goal{0, parts, 1};
      batch.goals = {&goal, 1};
      const auto r = solve(batch)[0];
      EXPECT_EQ(r.status, IkStatus::solved) << r.detail;
      expect_within_limits(r.q);
      return tip_pose(m, r.q.data());
    };
    EXPECT_LE(position_gap(at(kIkPosition), target), 1e-9);
    EXPECT_LE(rotation_gap(at(kIkRotation), target), 1e-9);
    const auto between = [&](const Pose& t) {
      const Vec3 a = axis_z(t), b = axis_z(target);
      return std::sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                       (a[2] - b[2]) * (a[2] - b[2]));
    };
    EXPECT_LE(between(at(kIkAxis)), 1e-9);
    const Pose both = at(kIkPosition | kIkAxis);
    EXPECT_LE(between(both), 1e-9);
    EXPECT_LE(position_gap(both, target), 1e-9);
    // The height alone, in the target's own axes.
    const Pose level = at(kIkZ);
    double along = 0;
    for (std::size_t k = 0; k < 3; ++k) along += axis_z(target)[k] * (level.p[k] - target.p[k]);
    EXPECT_NEAR(along, 0, 1e-9);
  }
}

// Two rods, the second angle half the first: a mechanism of one coordinate.
TEST_P(IkGoals, FollowersMoveAlongAndKeepTheirOwnLimits) {
  RobotModel m = planar_rods();
  m.joints[1].coupling = {0, 0.5, 0.1};
  m.joints[1].lower = -0.4, m.joints[1].upper = 0.6;
  m.number_coordinates();
  prepare(m);
  const IkGoal place{0, kIkPosition, 1};
  IkBatch batch;
  batch.goals = {&place, 1};
  const double q = 0.83;
  Pose target = tip_pose(m, &q);
  batch.targets = {&target, 1};
  const auto r = solve(batch)[0];
  ASSERT_EQ(r.status, IkStatus::solved) << r.detail;
  ASSERT_EQ(r.q.size(), 1U);
  EXPECT_NEAR(r.q[0], q, 1e-9);
  // 1.2 would turn the follower to 0.7, beyond its 0.6.
  const double beyond = 1.2;
  target = tip_pose(m, &beyond);
  const auto no = solve(batch)[0];
  EXPECT_EQ(no.status, IkStatus::joint_limit) << no.detail;
  expect_within_limits(no.q);
}

// The closed four-bar from the intersection of two circles.
TEST_P(IkGoals, ClosedLoopsStayClosed) {
  const double ground = 0.4, crank = 0.15, coupler = 0.35, rocker = 0.3;
  const RobotModel m = four_bar(ground, crank, coupler, rocker);
  prepare(m);
  for (const double angle : {0.4, 1.3, 2.5}) {
    SCOPED_TRACE(angle);
    const double x = crank * std::cos(angle), y = crank * std::sin(angle);
    const double dx = ground - x, dy = -y, d = std::hypot(dx, dy);
    const double a = (d * d + coupler * coupler - rocker * rocker) / (2 * d);
    const double h = std::sqrt(coupler * coupler - a * a);
    Pose target;
    target.p = {x + a * dx / d - h * dy / d, y + a * dy / d + h * dx / d, 0};
    const IkGoal place{0, kIkPosition, 1};
    IkBatch batch;
    batch.goals = {&place, 1};
    batch.targets = {&target, 1};
    const std::vector<double> seed{angle + 0.2, 0.3, 1.5};
    batch.seeds = seed;
    const auto r = solve(batch)[0];
    ASSERT_EQ(r.status, IkStatus::solved) << r.detail;
    const auto frames = joint_frames(m, r.q.data());
    const Pose pin_a = multiply(frames[1], m.loops[0].in_a),
               pin_b = multiply(frames[2], m.loops[0].in_b);
    EXPECT_LE(position_gap(pin_a, pin_b), 1e-9);
    EXPECT_LE(position_gap(pin_a, target), 1e-9);
  }
}

/// Grows towards one configuration, as a clearance that a test knows in closed form.
class TowardsConfiguration final : public ClearanceField {
 public:
  explicit TowardsConfiguration(std::vector<double> goal) : goal_(std::move(goal)) {}
  double distance(std::span<const double> q, std::span<double> gradient) const override {
    double sum = 0;
    for (std::size_t i = 0; i < q.size(); ++i) {
      sum += (q[i] - goal_[i]) * (q[i] - goal_[i]);
      gradient[i] = -2 * (q[i] - goal_[i]);
    }
    return 10 - sum;
  }

 private:
  std::vector<double> goal_;
};

TEST_P(IkGoals, FreedomIsUsedForTheObjectiveAndTheTargetIsKept) {
  const RobotModel m = iiwa14();
  prepare(m);
  Random random(33);
  const TowardsConfiguration field(std::vector<double>(7, 0.3));
  const auto off_centre = [&](const std::vector<double>& q) {
    double sum = 0;
    for (std::size_t i = 0; i < 7; ++i) {
      const JointModel& j = m.joints[i];
      const double d = (q[i] - (j.lower + j.upper) / 2) / (j.upper - j.lower);
      sum += d * d;
    }
    return sum;
  };
  int closer = 0;
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(i);
    const auto q = random.configuration(m);
    const Pose target = tip_pose(m, q.data());
    IkBatch batch;
    batch.targets = {&target, 1};
    batch.seeds = q;
    const auto answer = [&](IkObjective o) {
      batch.objective = o;
      batch.clearance = &field;
      const auto r = solve(batch)[0];
      EXPECT_EQ(r.status, IkStatus::solved) << r.detail;
      EXPECT_LE(position_gap(tip_pose(m, r.q.data()), target), 1e-9);
      EXPECT_LE(rotation_gap(tip_pose(m, r.q.data()), target), 1e-9);
      expect_within_limits(r.q);
      return r.q;
    };
    const auto plain = answer(IkObjective::none), centred = answer(IkObjective::centre),
               cleared = answer(IkObjective::clearance);
    answer(IkObjective::manipulability);
    answer(IkObjective::limits);
    EXPECT_LE(off_centre(centred), off_centre(plain) + 1e-9);
    std::vector<double> g(7);
    EXPECT_GE(field.distance(cleared, g), field.distance(plain, g) - 1e-9);
    closer += off_centre(centred) < off_centre(plain) - 1e-3;
  }
  EXPECT_GE(closer, 15) << "of 20 random postures most are not the most central ones";
}

TEST_P(IkGoals, FailureNamesTheShortfallTheJointAndTheLostDirection) {
  RobotModel m = planar_rods();
  prepare(m);
  const IkGoal place{0, kIkPosition, 1};
  Pose target = shift(1.363 * std::cos(0.3), 1.363 * std::sin(0.3), 0);
  IkBatch batch;
  batch.goals = {&place, 1};
  batch.targets = {&target, 1};
  const auto far = solve(batch)[0];
  EXPECT_EQ(far.status, IkStatus::out_of_reach);
  EXPECT_NEAR(far.shortfall, 1.363 - 1.15, 1e-4);
  // Stretched towards the target: the lost direction is the one towards it.
  EXPECT_NEAR(std::fabs(far.lost_direction[0]), std::cos(0.3), 2e-2);
  EXPECT_NEAR(std::fabs(far.lost_direction[1]), std::sin(0.3), 2e-2);

  m.joints[0].lower = -0.1, m.joints[0].upper = 0.1;
  m.joints[1].lower = 0, m.joints[1].upper = 1;
  prepare(m);
  const std::vector<double> beyond{0.05, 1.2};
  target = tip_pose(m, beyond.data());
  const auto limit = solve(batch)[0];
  EXPECT_EQ(limit.status, IkStatus::joint_limit);
  EXPECT_EQ(limit.limiting_joint, 1);
  EXPECT_FALSE(limit.detail.empty());
}

TEST_P(IkGoals, ATargetHasTheSameAnswerAloneAndInABatch) {
  for (const RobotModel& m : {puma560(), iiwa14()}) {
    SCOPED_TRACE(m.name);
    prepare(m);
    Random random(34);
    std::vector<Pose> targets;
    std::vector<double> seeds;
    for (int i = 0; i < 100; ++i) {
      targets.push_back(tip_pose(m, random.configuration(m).data()));
      for (const double x : random.configuration(m)) seeds.push_back(x);
    }
    IkBatch batch;
    batch.targets = targets;
    batch.seeds = seeds;
    const auto together = solve(batch);
    for (std::size_t i = 0; i < targets.size(); ++i) {
      batch.targets = {&targets[i], 1};
      batch.seeds = {seeds.data() + i * m.dof(), m.dof()};
      EXPECT_EQ(solve(batch)[0].q, together[i].q) << i;
    }
  }
}

TEST_P(IkGoals, AGoalThatNamesNothingIsRefused) {
  prepare(puma560());
  const Pose target = shift(0.5, 0, 0);
  std::vector<IkResult> results(1);
  NoProgress none;
  IkBatch batch;
  batch.targets = {&target, 1};
  for (const IkGoal& bad : {IkGoal{0, 0, 1}, IkGoal{3, kIkPose, 1}, IkGoal{0, kIkPose, 0}}) {
    batch.goals = {&bad, 1};
    EXPECT_FALSE(solver_->solve(batch, results, none).ok());
  }
  batch.goals = {};
  batch.objective = IkObjective::clearance;
  EXPECT_FALSE(solver_->solve(batch, results, none).ok()) << "a clearance without a field";
}

}  // namespace robomosp::conformance
