// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.ik/1 (layer: contract helper for tests, GoogleTest, header-only).
// Include it in one file of a test program and instantiate it:
//   INSTANTIATE_TEST_SUITE_P(MyIk, IkConformance, testing::ValuesIn(ik_cases("my_ik.so", "my_ik",
//                            {puma560(), pa10()})), ik_case_name);
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/ik_branches_check.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/solve_or_refuse.h>
#include <robomosp/sdk/conformance/stop_after.h>
#include <robomosp/sdk/ik.h>

namespace robomosp::conformance {

struct IkCase {
  std::string file, provider;
  RobotModel model;
  std::string oracle;  ///< file of the provider "numeric" to compare all solutions with; or empty
  bool may_refuse = false;  ///< a mechanism that it says it cannot solve is left out
};
inline std::vector<IkCase> ik_cases(const std::string& file, const std::string& provider,
                                    std::vector<RobotModel> models,
                                    const std::string& oracle = {}) {
  std::vector<IkCase> cases;
  for (RobotModel& m : models) cases.push_back({file, provider, std::move(m), oracle, false});
  return cases;
}
inline void PrintTo(const IkCase& c, std::ostream* os) {
  *os << c.provider << " on " << c.model.name;
}
inline std::string ik_case_name(const testing::TestParamInfo<IkCase>& info) {
  std::string s = info.param.model.name;
  for (char& c : s)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return s;
}

class IkConformance : public testing::TestWithParam<IkCase> {
 protected:
  static constexpr std::uint64_t kSeed = 20061;
  void SetUp() override {
    auto found = find_provider<IkSolver>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    params_ = TableParams(**found);
    solver_ = create<IkSolver>(**found);
    ASSERT_NE(solver_, nullptr);
    const auto prepared = solver_->prepare(model(), params_);
    if (!prepared.ok() && GetParam().may_refuse) {
      expect_refusal(prepared.error());
      GTEST_SKIP() << prepared.error().sentence();
    }
    ASSERT_TRUE(prepared.ok()) << prepared.error().sentence();
  }
  const RobotModel& model() const { return GetParam().model; }
  std::size_t dof() const { return model().dof(); }
  std::vector<IkResult> solve(const IkBatch& batch) {
    std::vector<IkResult> results(batch.targets.size());
    NoProgress none;
    const auto done = solver_->solve(batch, results, none);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    return results;
  }
  void expect_within_limits(const IkResult& r) const {
    ASSERT_FALSE(r.q.empty());
    ASSERT_EQ(r.q.size() % dof(), 0U);
    for (std::size_t i = 0; i < r.q.size(); ++i) {
      const JointModel& j = model().joints[i % dof()];
      ASSERT_TRUE(std::isfinite(r.q[i]));
      ASSERT_GE(r.q[i], j.lower) << j.name;
      ASSERT_LE(r.q[i], j.upper) << j.name;
    }
  }
  void expect_reaches(const Pose& target, const IkResult& r, const IkTolerance& t,
                      std::size_t tip = 0) const {
    for (std::size_t k = 0; k < r.q.size() / dof(); ++k) {
      const Pose at = tip_pose(model(), r.q.data() + k * dof(), tip);
      ASSERT_LE(position_gap(at, target), t.position) << "solution " << k + 1;
      ASSERT_LE(rotation_gap(at, target), t.rotation + 1e-15) << "solution " << k + 1;
    }
  }

  TableParams params_;
  std::unique_ptr<IkSolver> solver_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(IkConformance);

TEST_P(IkConformance, ReachableTargetsAreSolvedToToleranceWithinLimits) {
  Random random(kSeed);
  for (std::size_t tip = 0; tip < model().tips.size(); ++tip) {
    std::vector<Pose> targets;
    for (int i = 0; i < 200; ++i)
      targets.push_back(tip_pose(model(), random.configuration(model()).data(), tip));
    IkBatch batch;
    batch.targets = targets;
    batch.tip = static_cast<std::int32_t>(tip);
    const auto results = solve(batch);
    for (std::size_t i = 0; i < targets.size(); ++i) {
      SCOPED_TRACE("tip " + std::to_string(tip) + ", target " + std::to_string(i) + ", seed " +
                   std::to_string(kSeed));
      ASSERT_EQ(results[i].status, IkStatus::solved) << results[i].detail;
      expect_within_limits(results[i]);
      expect_reaches(targets[i], results[i], batch.tolerance, tip);
      ASSERT_LE(results[i].position_error, batch.tolerance.position);
      ASSERT_LE(results[i].rotation_error, batch.tolerance.rotation);
    }
  }
}

TEST_P(IkConformance, TheSameCallGivesTheSameAnswerToTheBit) {
  Random random(kSeed + 1);
  std::vector<Pose> targets;
  for (int i = 0; i < 10; ++i)
    targets.push_back(tip_pose(model(), random.configuration(model()).data()));
  IkBatch batch;
  batch.targets = targets;
  const auto first = solve(batch), second = solve(batch);
  for (std::size_t i = 0; i < targets.size(); ++i) EXPECT_EQ(first[i].q, second[i].q);
}

TEST_P(IkConformance, ASeedThatIsTheAnswerIsKept) {
  Random random(kSeed + 2);
  const std::vector<double> q = random.configuration(model());
  const Pose target[] = {tip_pose(model(), q.data())};
  IkBatch batch;
  batch.targets = target;
  batch.seeds = q;
  const auto r = solve(batch);
  ASSERT_EQ(r[0].status, IkStatus::solved);
  for (std::size_t j = 0; j < dof(); ++j) EXPECT_NEAR(r[0].q[j], q[j], 1e-6) << "joint " << j + 1;
}

TEST_P(IkConformance, ATargetFarAwayIsReportedWithTheClosestConfiguration) {
  Pose target[] = {tip_pose(model(), std::vector<double>(dof(), 0.1).data())};
  target[0].p[0] += 40;
  IkBatch batch;
  batch.targets = target;
  const auto r = solve(batch);
  EXPECT_EQ(r[0].status, IkStatus::out_of_reach);
  EXPECT_FALSE(r[0].detail.empty());
  EXPECT_GT(r[0].position_error, 1.0);
  expect_within_limits(r[0]);
  const Pose at = tip_pose(model(), r[0].q.data());
  EXPECT_NEAR(position_gap(at, target[0]), r[0].position_error, 1e-9);
}

TEST_P(IkConformance, WrongSizesAndBrokenNumbersAreRefused) {
  const Pose good[] = {tip_pose(model(), std::vector<double>(dof(), 0.1).data())};
  NoProgress none;
  std::vector<IkResult> one(1), two(2);
  IkBatch batch;
  batch.targets = good;
  EXPECT_FALSE(solver_->solve(batch, two, none).ok()) << "two results for one target";
  const std::vector<double> seeds(dof() + 1, 0.0);
  batch.seeds = seeds;
  EXPECT_FALSE(solver_->solve(batch, one, none).ok()) << "a seed of dof + 1 values";
  batch.seeds = {};
  batch.tip = static_cast<std::int32_t>(model().tips.size());
  EXPECT_FALSE(solver_->solve(batch, one, none).ok()) << "a tip that does not exist";
  batch.tip = 0;
  Pose broken[] = {good[0]};
  broken[0].p[1] = std::nan("");
  batch.targets = broken;
  const auto r = solver_->solve(batch, one, none);
  EXPECT_FALSE(r.ok()) << "a target that is not a number";
  for (const double q : one[0].q) EXPECT_TRUE(std::isfinite(q));
}

TEST_P(IkConformance, AConfigurationIsFollowedAlongAPathWithoutJumps) {
  Random random(kSeed + 3);
  // A smooth joint motion gives a path that certainly exists.
  std::vector<double> from, to;
  for (const JointModel& j : model().joints) {
    const double low = std::max(j.lower, -kPi), high = std::min(j.upper, kPi);
    from.push_back(low + 0.45 * (high - low));
    to.push_back(low + 0.6 * (high - low));
  }
  std::vector<Pose> targets;
  constexpr int kSamples = 200;
  for (int i = 0; i < kSamples; ++i) {
    std::vector<double> q(dof());
    for (std::size_t j = 0; j < dof(); ++j) q[j] = from[j] + (to[j] - from[j]) * i / (kSamples - 1);
    targets.push_back(tip_pose(model(), q.data()));
  }
  IkBatch batch;
  batch.targets = targets;
  batch.seeds = from;
  batch.continuous = true;
  const auto results = solve(batch);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    SCOPED_TRACE("sample " + std::to_string(i));
    ASSERT_EQ(results[i].status, IkStatus::solved) << results[i].detail;
    expect_within_limits(results[i]);
    expect_reaches(targets[i], results[i], batch.tolerance);
    for (std::size_t j = 0; i > 0 && j < dof(); ++j)
      ASSERT_LT(std::fabs(results[i].q[j] - results[i - 1].q[j]), 0.08) << "joint " << j + 1;
  }
}

TEST_P(IkConformance, EveryMechanismIsSolvedOrRefused) {
  const auto found = find_provider<IkSolver>(GetParam().file, GetParam().provider);
  ASSERT_TRUE(found.ok());
  solve_or_refuse([&] { return create<IkSolver>(**found); }, params_);
}

TEST_P(IkConformance, SeveralThreadsGetTheSameAnswersAtOnce) {
  Random random(kSeed + 4);
  std::vector<Pose> targets;
  for (int i = 0; i < 8; ++i)
    targets.push_back(tip_pose(model(), random.configuration(model()).data()));
  IkBatch batch;
  batch.targets = targets;
  const auto alone = solve(batch);
  std::array<std::vector<IkResult>, 4> together;
  at_once(together.size(), [&](std::size_t thread) {
    NoProgress none;
    together[thread].resize(targets.size());
    EXPECT_TRUE(solver_->solve(batch, together[thread], none).ok());
  });
  for (const auto& results : together)
    for (std::size_t i = 0; i < targets.size(); ++i) EXPECT_EQ(results[i].q, alone[i].q) << i;
}

TEST_P(IkConformance, BranchesThatAreNamedAreToldApart) {
  const auto found = find_provider<IkSolver>(GetParam().file, GetParam().provider);
  ASSERT_TRUE(found.ok());
  const std::string tags = std::string(",") + ((*found)->tags ? (*found)->tags : "") + ",";
  const auto* branches =
      static_cast<const IkBranches*>(solver_->extension(IkBranches::kExtensionId));
  if (tags.find(",branches,") != std::string::npos) {
    ASSERT_NE(branches, nullptr) << "its tags say that it names them";
  }
  if (!branches) return;
  EXPECT_EQ(solver_->extension(IkBranches::kExtensionId), branches)
      << "it is another one each time";
  bool has_names = false;
  for (std::size_t tip = 0; tip < model().tips.size(); ++tip) {
    const auto i = static_cast<std::int32_t>(tip);
    has_names = has_names || !branches->choices(i).empty();
    EXPECT_EQ(branch_fault(*branches, model(), i, kSeed), "") << "tip " << tip;
  }
  EXPECT_TRUE(!has_names || tags.find(",branches,") != std::string::npos)
      << "the tag \"branches\" is how users find solvers that name them";
}

TEST_P(IkConformance, CancellingStopsWithinATenthOfASecond) {
  std::vector<Pose> targets(20000, tip_pose(model(), std::vector<double>(dof(), 0.1).data()));
  for (Pose& t : targets) t.p[2] += 0.7;
  std::vector<IkResult> results(targets.size());
  IkBatch batch;
  batch.targets = targets;
  StopAfter progress(0.03);
  const auto r = solver_->solve(batch, results, progress);
  EXPECT_LT(progress.since_told(), 0.1) << "it was asked to stop and went on";
  EXPECT_LT(progress.unheard(), 0.1) << "it computed for longer without asking";
  if (!r.ok()) {  // else it was done before
    EXPECT_EQ(r.error().code, ErrorCode::cancelled);
  }
}

}  // namespace robomosp::conformance
