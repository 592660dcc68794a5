// SPDX-License-Identifier: Apache-2.0
// What is this solver's own; the SDK's suite runs on it besides (CONFORMANCE ik in CMakeLists.txt).
#include <gtest/gtest.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/ik.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = ROBOMOSP_PLUGIN_FILE;

std::unique_ptr<IkSolver> solver_for(const RobotModel& model) {
  const auto provider = find_provider<IkSolver>(kFile, "scara");
  auto solver = create<IkSolver>(**provider);
  const auto prepared = solver->prepare(model, TableParams(**provider));
  EXPECT_TRUE(prepared.ok());
  return solver;
}

TEST(Scara, HasTwoConfigurationsThatMirrorTheElbow) {
  RobotModel model = scara();
  for (JointModel& j : model.joints)
    if (j.type == JointType::revolute) j.lower = -kPi, j.upper = kPi;
  const auto solver = solver_for(model);
  const std::vector<double> q{0.3, 0.7, 0.1, -0.4};
  const Pose target = tip_pose(model, q.data());
  IkBatch batch;
  batch.targets = {&target, 1};
  batch.seeds = q;
  batch.all_solutions = true;
  std::vector<IkResult> results(1);
  NoProgress progress;
  ASSERT_TRUE(solver->solve(batch, results, progress).ok());
  ASSERT_EQ(results[0].q.size(), 8U);
  EXPECT_NEAR(results[0].q[1], 0.7, 1e-12);
  EXPECT_NEAR(results[0].q[5], -0.7, 1e-12);
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_LT(position_gap(tip_pose(model, &results[0].q[4 * k]), target), 1e-12);
}

TEST(Scara, ATiltedToolIsRefusedInWords) {
  const RobotModel model = scara();
  const Pose target =
      multiply(tip_pose(model, std::vector<double>{0.2, 0.5, 0.1, 0.3}.data()), turn_x(0.4));
  IkBatch batch;
  batch.targets = {&target, 1};
  std::vector<IkResult> results(1);
  NoProgress progress;
  ASSERT_TRUE(solver_for(model)->solve(batch, results, progress).ok());
  EXPECT_EQ(results[0].status, IkStatus::out_of_reach);
  EXPECT_EQ(results[0].detail, "a SCARA cannot tilt its tool");
}

TEST(Scara, AnArmThatIsNoneIsRefusedWithTheReason) {
  const auto provider = find_provider<IkSolver>(kFile, "scara");
  const auto r = create<IkSolver>(**provider)->prepare(puma560(), TableParams(**provider));
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(
      r.error().sentence(),
      "robot \"puma560\": it is not a SCARA: it is not a chain of four joints. Choose another "
      "provider.");
}

}  // namespace
}  // namespace robomosp::conformance
