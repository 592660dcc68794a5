// SPDX-License-Identifier: Apache-2.0
// Provider "srs": the SDK's suites, the arm angle, and its spans against dense sampling.
#include <robomosp/sdk/conformance/arms.h>
#include <robomosp/sdk/conformance/ik_closed_suite.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/ik_srs.so";

/// An elbow beside the line from shoulder to wrist, as of the Barrett WAM (45 mm).
RobotModel offset_elbow_arm() {
  const double r = kPi / 2;
  return serial("arm with an offset elbow", false,
                {{0, 0.3, 0, -r, -150, 150, {}},
                 {0, 0, 0, r, -113, 113, {}},
                 {0, 0.55, 0.045, -r, -157, 157, {}},
                 {0, 0, -0.045, r, -50, 180, {}},
                 {0, 0.3, 0, -r, -273, 71, {}},
                 {0, 0, 0, r, -60, 90, {}},
                 {0, 0.06, 0, 0, -172, 172, {}}});
}

INSTANTIATE_TEST_SUITE_P(
    Srs, IkConformance,
    testing::ValuesIn(ik_cases(kFile, "srs", {pa10(), pa10_nus(), iiwa14(), offset_elbow_arm()})),
    ik_case_name);
INSTANTIATE_TEST_SUITE_P(
    Srs, IkClosedForm,
    testing::ValuesIn(ik_cases(kFile, "srs", {pa10(), pa10_nus(), iiwa14(), offset_elbow_arm()})),
    ik_case_name);

class SrsIk : public testing::Test {
 protected:
  void prepare(const RobotModel& m) {
    const rmp_provider* provider = *find_provider<IkSolver>(kFile, "srs");
    model_ = m;
    solver_ = create<IkSolver>(*provider);
    const auto r = solver_->prepare(model_, TableParams(*provider));
    ASSERT_TRUE(r.ok()) << r.error().sentence();
  }
  IkResult solve(const Pose& target, const std::vector<double>& seed = {},
                 const std::vector<double>& arm_angles = {}, bool all = false) {
    IkBatch batch;
    batch.targets = {&target, 1};
    batch.seeds = seed;
    batch.arm_angles = arm_angles;
    batch.all_solutions = all;
    std::vector<IkResult> results(1);
    NoProgress none;
    const auto r = solver_->solve(batch, results, none);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return results[0];
  }
  /// The angle from the plane of axis 1 to the elbow, about the line from shoulder to wrist.
  double elbow_angle(const std::vector<double>& q) const {
    const auto f = joint_frames(model_, q.data());
    const auto z = [](const Pose& p) { return Vec3{p.R[2], p.R[5], p.R[8]}; };
    const auto minus = [](const Vec3& a, const Vec3& b) {
      return Vec3{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    };
    const auto dot = [](const Vec3& a, const Vec3& b) {
      return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    };
    const auto cross = [](const Vec3& a, const Vec3& b) {
      return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    };
    // Joint 2's frame stands in the shoulder, joint 6's in the wrist, joint 4's in the elbow.
    const Vec3 way = minus(f[5].p, f[1].p), elbow = minus(f[3].p, f[1].p), up = z(f[0]);
    const double n = std::sqrt(dot(way, way));
    const Vec3 u{way[0] / n, way[1] / n, way[2] / n};
    const auto across = [&](const Vec3& v) {
      const double along = dot(u, v);
      return Vec3{v[0] - along * u[0], v[1] - along * u[1], v[2] - along * u[2]};
    };
    const Vec3 from = across(up), to = across(elbow);
    return std::atan2(dot(u, cross(from, to)), dot(from, to));
  }
  RobotModel model_;
  std::unique_ptr<IkSolver> solver_;
};

TEST_F(SrsIk, AtTheArmAngleOfAConfigurationThatConfigurationIsAmongAllEight) {
  for (const RobotModel& m : {pa10(), iiwa14(), offset_elbow_arm()}) {
    SCOPED_TRACE(m.name);
    prepare(m);
    Random random(31);
    std::size_t most = 0;
    for (int i = 0; i < 200; ++i) {
      const std::vector<double> q = random.configuration(model_);
      const IkResult r = solve(tip_pose(model_, q.data()), {}, {elbow_angle(q)}, true);
      ASSERT_EQ(r.status, IkStatus::solved) << r.detail;
      double least = INFINITY;
      for (std::size_t k = 0; k < r.q.size() / 7; ++k) {
        const std::vector<double> x(r.q.begin() + static_cast<std::ptrdiff_t>(7 * k),
                                    r.q.begin() + static_cast<std::ptrdiff_t>(7 * k + 7));
        EXPECT_NEAR(std::remainder(elbow_angle(x) - elbow_angle(q), 2 * kPi), 0, 1e-7);
        least = std::min(least, apart(model_, x.data(), q.data()));
      }
      EXPECT_LT(least, 1e-7);
      most = std::max(most, r.q.size() / 7);
    }
    EXPECT_GE(most, 4U);
  }
}

// Limits cut the arm angle to spans: wherever one of 720 arm angles serves, an answer is found
// without asking for one, and where none serves, a limit is named.
TEST_F(SrsIk, AnAnswerIsFoundExactlyWhereSomeArmAngleServes) {
  RobotModel m = iiwa14();
  for (JointModel& j : m.joints) j.lower *= 0.45, j.upper *= 0.45;
  m.joints[3].lower = -2, m.joints[3].upper = 2;
  prepare(m);
  Random random(32);
  RobotModel wide = iiwa14();
  int served = 0, refused = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE("target " + std::to_string(i));
    const Pose target = tip_pose(wide, random.configuration(wide).data());
    bool any = false;
    for (int k = 0; k < 720 && !any; ++k)
      any = solve(target, {}, {k * kPi / 360}).status == IkStatus::solved;
    const IkResult r = solve(target);
    if (any) {
      EXPECT_EQ(r.status, IkStatus::solved) << r.detail;
    }
    if (r.status != IkStatus::solved) {
      EXPECT_EQ(r.status, IkStatus::joint_limit);
      EXPECT_GE(r.limiting_joint, 0);
      ++refused;
    } else {
      // The middle of the widest span: a little to either side the same branch serves, too.
      ++served;
      const double angle = elbow_angle(r.q);
      EXPECT_EQ(solve(target, r.q, {angle + 1e-7}).status, IkStatus::solved);
      EXPECT_EQ(solve(target, r.q, {angle - 1e-7}).status, IkStatus::solved);
    }
  }
  EXPECT_GE(served, 5);
  EXPECT_GE(refused, 5);
}

TEST_F(SrsIk, TheSeedsArmAngleIsKeptUntilALimitTurnsTheElbow) {
  prepare(iiwa14());
  const std::vector<double> q{0.2, 0.6, 0.4, -1.2, 0.3, 0.7, 0.1};
  const double before = elbow_angle(q);
  Pose target = tip_pose(model_, q.data());
  target.p[2] += 0.02;
  EXPECT_NEAR(elbow_angle(solve(target, q).q), before, 1e-9);
  // Joint 3 may no longer be where it is: the elbow turns until it is at its limit, no farther.
  RobotModel narrow = iiwa14();
  narrow.joints[2].upper = 0.35;
  prepare(narrow);
  const std::vector<double> seed{0.2, 0.6, 0.35, -1.2, 0.3, 0.7, 0.1};
  const IkResult r = solve(tip_pose(model_, q.data()), seed, {});
  ASSERT_EQ(r.status, IkStatus::solved) << r.detail;
  EXPECT_NEAR(r.q[2], 0.35, 1e-6);
  EXPECT_LE(r.q[2], 0.35);
}

/// Sums of slow waves, from the middle of the limits into some of them.
std::vector<Pose> wave_path(const RobotModel& model, std::size_t samples) {
  std::vector<Pose> targets;
  std::vector<double> q(7);
  for (std::size_t i = 0; i < samples; ++i) {
    const double t = 2 * kPi * static_cast<double>(i) / static_cast<double>(samples);
    for (std::size_t j = 0; j < 7; ++j) {
      const double middle = 0.5 * (model.joints[j].lower + model.joints[j].upper);
      q[j] =
          middle + (j % 2 == 1 ? 0.9 : 0) + 0.8 * std::sin(t * (1 + 0.5 * static_cast<double>(j)));
    }
    targets.push_back(tip_pose(model, q.data()));
  }
  return targets;
}

TEST_F(SrsIk, APathIsTheSameAllAtOnceAndSampleBySample) {
  for (const RobotModel& model : {pa10(), iiwa14(), offset_elbow_arm()}) {
    SCOPED_TRACE(model.name);
    prepare(model);
    const std::vector<Pose> targets = wave_path(model, 3000);
    IkBatch batch;
    batch.targets = targets;
    const std::vector<double> start = solve(targets[0]).q;
    ASSERT_EQ(start.size(), 7U);
    batch.seeds = start;
    batch.continuous = true;
    std::vector<IkResult> all(targets.size()), pair(2);
    NoProgress none;
    ASSERT_TRUE(solver_->solve(batch, all, none).ok());
    std::size_t solved = 0;
    for (std::size_t i = 1; i < targets.size(); ++i) {
      if (all[i].status != IkStatus::solved) continue;
      ++solved;
      const Pose tip = tip_pose(model, all[i].q.data());
      EXPECT_LT(position_gap(tip, targets[i]), 1e-12);
      EXPECT_LT(rotation_gap(tip, targets[i]), 1e-12);
      if (all[i - 1].status != IkStatus::solved) continue;
      // A single target is solved over all branches, and takes the one nearest to its seed.
      const IkResult one = solve(targets[i], all[i - 1].q);
      ASSERT_EQ(one.status, IkStatus::solved) << i;
      double apart = 0, moved = 0;
      for (std::size_t j = 0; j < 7; ++j) {
        apart = std::max(apart, std::fabs(one.q[j] - all[i].q[j]));
        moved = std::max(moved, std::fabs(one.q[j] - all[i - 1].q[j]));
      }
      // On a path the elbow may leave its angle where keeping it would be a fast motion.
      if (moved < 0.01) {
        EXPECT_LT(apart, 1e-10) << i;
      }
    }
    EXPECT_GT(solved, targets.size() / 2);
  }
}

TEST_F(SrsIk, ReachIsTheSumOfUpperArmAndForearm) {
  prepare(iiwa14());
  // Straight up: shoulder at 0.36 m, 0.42 + 0.4 m to the wrist, 0.126 m to the flange; 0.1 more.
  const IkResult r = solve(shift(0, 0, 0.36 + 0.42 + 0.4 + 0.126 + 0.1));
  EXPECT_EQ(r.status, IkStatus::out_of_reach);
  EXPECT_NEAR(r.shortfall, 0.1, 1e-12);
  EXPECT_NEAR(r.position_error, 0.1, 1e-9);
  EXPECT_NEAR(r.rotation_error, 0, 1e-9);
  EXPECT_EQ(r.detail, "the target is out of reach by 0.1 m");
}

TEST_F(SrsIk, ArmsThatAreNoneAreRefusedWithTheReason) {
  const rmp_provider* provider = *find_provider<IkSolver>(kFile, "srs");
  const auto refusal = [&](const RobotModel& m) {
    const auto r = create<IkSolver>(*provider)->prepare(m, TableParams(*provider));
    return r.ok() ? std::string("accepted") : r.error().sentence();
  };
  EXPECT_EQ(refusal(panda()),
            "robot \"panda\": it is not a spherical-revolute-spherical arm: axis 7 passes the "
            "point where axes 5 and 6 meet at 0.088 m. Choose another provider, such as numeric.");
  EXPECT_NE(refusal(puma560()).find("needs 7 revolute joints"), std::string::npos);
  EXPECT_NE(refusal(scara()).find("is not revolute"), std::string::npos);
}

}  // namespace
}  // namespace robomosp::conformance
