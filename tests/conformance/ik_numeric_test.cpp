// SPDX-License-Identifier: Apache-2.0
// Provider "numeric": the SDK's suite, the paper's PA-10 pose and what is said about targets
// without an answer.
#include <robomosp/sdk/conformance/ik_goals_suite.h>
#include <robomosp/sdk/conformance/ik_suite.h>
#include <robomosp/sdk/curve.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/ik_numeric.so";

INSTANTIATE_TEST_SUITE_P(Numeric, IkConformance,
                         testing::ValuesIn(ik_cases(kFile, "numeric",
                                                    {puma560(), puma560_modified(), pa10(),
                                                     pa10_nus(), panda(), planar_rods(), scara(),
                                                     tree()})),
                         ik_case_name);

INSTANTIATE_TEST_SUITE_P(Numeric, IkGoals, testing::Values(IkGoalsCase{kFile, "numeric"}));

class NumericIk : public testing::Test {
 protected:
  void prepare(const RobotModel& m) {
    const rmp_provider* provider = *find_provider<IkSolver>(kFile, "numeric");
    model_ = m;
    solver_ = create<IkSolver>(*provider);
    ASSERT_TRUE(solver_->prepare(model_, TableParams(*provider)).ok());
  }
  IkResult solve(const Pose& target, const std::vector<double>& seed = {}, bool all = false) {
    IkBatch batch;
    batch.targets = {&target, 1};
    batch.seeds = seed;
    batch.all_solutions = all;
    std::vector<IkResult> results(1);
    NoProgress none;
    const auto r = solver_->solve(batch, results, none);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return results[0];
  }
  RobotModel model_;
  std::unique_ptr<IkSolver> solver_;
};

// The paper's fourth validation case: position (0.557, 0, 0.374) m, roll-pitch-yaw (pi, 0, pi).
TEST_F(NumericIk, SolvesThePaperPoseOfThePa10ForBothSetsOfLengths) {
  const Pose target = multiply(shift(0.557, 0, 0.374), multiply(turn_z(kPi), turn_x(kPi)));
  for (const RobotModel& m : {pa10(), pa10_nus()}) {
    SCOPED_TRACE(m.name);
    prepare(m);
    const IkResult r = solve(target);
    ASSERT_EQ(r.status, IkStatus::solved) << r.detail;
    const Pose at = tip_pose(m, r.q.data());
    EXPECT_LE(position_gap(at, target), 1e-9);
    EXPECT_LE(rotation_gap(at, target), 1e-9);
    for (std::size_t j = 0; j < 7; ++j) {
      EXPECT_GE(r.q[j], m.joints[j].lower);
      EXPECT_LE(r.q[j], m.joints[j].upper);
    }
  }
}

// The paper's first validation case, sampled every 0.1 s: the whole circle within limits, joint
// rates without jumps.
TEST_F(NumericIk, FollowsThePaperCircleWithContinuousJointRates) {
  const std::string file = std::string(ROBOMOSP_PLUGIN_DIR) + "/path_analytic.so";
  const rmp_provider* provider = *find_provider<CurveFactory>(file, "circle");
  const auto down = [](double x, double y) { return multiply(shift(x, y, 0.7346), turn_y(kPi)); };
  const std::vector<Pose> points{down(0.558, 0), down(0.758, 0), down(0.658, -0.1)};
  const auto circle = create<CurveFactory>(*provider)->make(points, TableParams(*provider));
  ASSERT_TRUE(circle.ok()) << circle.error().sentence();
  // 10 mm/s along 2 pi 100 mm, every 0.1 s.
  constexpr double kStep = 0.1, kDuration = 2 * kPi * 0.1 / 0.01;
  std::vector<double> shares;
  for (double t = 0; t < kDuration; t += kStep) shares.push_back(t / kDuration * (*circle)->end());
  std::vector<CurveSample> path(shares.size());
  ASSERT_TRUE((*circle)->evaluate(shares, path).ok());
  std::vector<Pose> targets;
  for (const CurveSample& p : path) {
    targets.push_back(points.front());
    targets.back().p = p.p;
  }

  for (const RobotModel& m : {pa10(), pa10_nus()}) {
    SCOPED_TRACE(m.name);
    prepare(m);
    const std::vector<double> seed{0, 45 * kDeg, 0, 90 * kDeg, 0, 45 * kDeg, 0};
    IkBatch batch;
    batch.targets = targets;
    batch.seeds = seed;
    batch.continuous = true;
    std::vector<IkResult> results(targets.size());
    NoProgress none;
    ASSERT_TRUE(solver_->solve(batch, results, none).ok());
    for (std::size_t i = 0; i < results.size(); ++i) {
      ASSERT_EQ(results[i].status, IkStatus::solved) << i << ": " << results[i].detail;
      EXPECT_LE(position_gap(tip_pose(m, results[i].q.data()), targets[i]), 1e-9);
      for (std::size_t j = 0; i >= 2 && j < 7; ++j) {
        const double rate = (results[i].q[j] - results[i - 1].q[j]) / kStep;
        const double before = (results[i - 1].q[j] - results[i - 2].q[j]) / kStep;
        EXPECT_LT(std::fabs(rate), 0.1) << "joint " << j + 1 << ", sample " << i;
        // 10 mm/s round 100 mm turns by 0.01 rad a sample: rates change by about that share.
        EXPECT_LT(std::fabs(rate - before), 2e-3) << "joint " << j + 1 << ", sample " << i;
      }
    }
  }
}

TEST_F(NumericIk, FindsAllEightPosturesOfThePuma) {
  RobotModel m = puma560();
  for (JointModel& j : m.joints) j.lower = -kPi, j.upper = kPi;  // so that limits hide none
  prepare(m);
  const std::vector<double> q{0.3, 0.6, -0.5, 0.7, 0.8, -0.4};
  const Pose target = tip_pose(m, q.data());
  const IkResult r = solve(target, q, true);
  ASSERT_EQ(r.status, IkStatus::solved);
  // Left or right arm, elbow up or down, wrist flipped or not.
  EXPECT_EQ(r.q.size(), 8U * 6U);
  for (std::size_t k = 0; k < r.q.size() / 6; ++k)
    EXPECT_LE(position_gap(tip_pose(m, r.q.data() + 6 * k), target), 1e-9);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_NEAR(r.q[j], q[j], 1e-8) << "the one nearest to the seed comes first";
}

TEST_F(NumericIk, TellsHowFarATargetIsOutOfReach) {
  prepare(planar_rods());
  // The rods reach 1.15 m; this point is 1.363 m away.
  const IkResult r = solve(shift(1.363, 0, 0));
  EXPECT_EQ(r.status, IkStatus::out_of_reach);
  EXPECT_EQ(r.detail, "the target is out of reach by 0.213 m");
}

TEST_F(NumericIk, NamesTheJointWhoseLimitForbidsTheTarget) {
  RobotModel m = pa10();
  m.joints[3].name = "elbow";
  // Locked but for the elbow, so that no other posture can help.
  for (std::size_t j : {0, 1, 2, 4, 5, 6}) m.joints[j].lower = -1e-3, m.joints[j].upper = 1e-3;
  prepare(m);
  const std::vector<double> beyond{0, 0, 0, 151.2 * kDeg, 0, 0, 0};
  const IkResult r = solve(tip_pose(m, beyond.data()), beyond);
  EXPECT_EQ(r.status, IkStatus::joint_limit);
  EXPECT_NE(r.detail.find("would need"), std::string::npos) << r.detail;
  EXPECT_NE(r.detail.find("its limit is"), std::string::npos) << r.detail;
  EXPECT_LE(r.q[3], m.joints[3].upper);

  RobotModel one = planar_rods();
  one.joints[0].lower = -0.1, one.joints[0].upper = 0.1;
  one.joints[1].lower = 0, one.joints[1].upper = 1;
  one.joints[1].name = "elbow";
  prepare(one);
  const std::vector<double> far{0.05, 1.2};
  const IkResult e = solve(tip_pose(one, far.data()));
  EXPECT_EQ(e.status, IkStatus::joint_limit);
  EXPECT_EQ(e.detail, "joint 2 (\"elbow\") would need 68.75 deg; its limit is 57.3 deg");
}

TEST_F(NumericIk, SaysWhenOnlyTheOrientationIsImpossible) {
  prepare(scara());
  Pose target = tip_pose(scara(), std::vector<double>{0.2, 0.5, 0.1, 0.3}.data());
  target = multiply(target, turn_x(0.4));  // a SCARA cannot tilt its tool
  const IkResult r = solve(target);
  EXPECT_EQ(r.status, IkStatus::out_of_reach);
  EXPECT_NE(r.detail.find("not with this orientation"), std::string::npos) << r.detail;
}

}  // namespace
}  // namespace robomosp::conformance
