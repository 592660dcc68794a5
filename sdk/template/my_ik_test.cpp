// SPDX-License-Identifier: Apache-2.0
// Tests of the plugin through its file, as the program uses it. The general requirements on a
// solver are checked by the SDK's conformance suite (CONFORMANCE ik in CMakeLists.txt).
#include <gtest/gtest.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/ik.h>

namespace {

using namespace robomosp;
using namespace robomosp::conformance;

/// A solver of this plugin, ready for `model`.
std::unique_ptr<IkSolver> solver_for(const RobotModel& model) {
  const auto provider = find_provider<IkSolver>(ROBOMOSP_PLUGIN_FILE, "my_ik");
  if (!provider.ok()) {
    ADD_FAILURE() << provider.error().sentence();
    return nullptr;
  }
  auto solver = create<IkSolver>(**provider);
  const auto prepared = solver->prepare(model, TableParams(**provider));
  EXPECT_TRUE(prepared.ok());
  return solver;
}

TEST(MyIk, ReachesAPoseOfThePa10WithTheToolDownwards) {
  const RobotModel model = pa10();
  const auto solver = solver_for(model);
  ASSERT_NE(solver, nullptr);
  // Position (0.557, 0, 0.374) m, roll pi, pitch 0, yaw pi: R = Rz(pi) Ry(0) Rx(pi).
  const Pose target = multiply(shift(0.557, 0, 0.374), multiply(turn_z(kPi), turn_x(kPi)));
  IkBatch batch;
  batch.targets = {&target, 1};
  std::vector<IkResult> results(1);
  NoProgress progress;
  ASSERT_TRUE(solver->solve(batch, results, progress).ok());
  ASSERT_EQ(results[0].status, IkStatus::solved) << results[0].detail;
  const Pose reached = tip_pose(model, results[0].q.data());
  EXPECT_LE(position_gap(reached, target), 1e-9);
  EXPECT_LE(rotation_gap(reached, target), 1e-9);
}

TEST(MyIk, ReachesBothArmsOfATree) {
  const RobotModel model = tree();
  const auto solver = solver_for(model);
  ASSERT_NE(solver, nullptr);
  Random random(5);
  NoProgress progress;
  for (std::int32_t tip = 0; tip < 2; ++tip) {
    const Pose target =
        tip_pose(model, random.configuration(model).data(), static_cast<std::size_t>(tip));
    IkBatch batch;
    batch.targets = {&target, 1};
    batch.tip = tip;
    std::vector<IkResult> results(1);
    ASSERT_TRUE(solver->solve(batch, results, progress).ok());
    EXPECT_EQ(results[0].status, IkStatus::solved) << "tip " << tip << ": " << results[0].detail;
  }
}

}  // namespace
