// SPDX-License-Identifier: Apache-2.0
// Provider "newton_euler" and "inertia_matrix": the SDK's suite and published figures.
#include <robomosp/sdk/conformance/dynamics_suite.h>
#include <robomosp/sdk/conformance/mechanisms.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so";

std::vector<RobotModel> models() {
  return {puma560(), puma560_modified(),    pa10(), pa10_nus(), panda(), planar_rods(), scara(),
          tree(),    floating_manipulator()};
}

INSTANTIATE_TEST_SUITE_P(Composite, DynamicsConformance,
                         testing::ValuesIn(dynamics_cases(kFile, "newton_euler", "inertia_matrix",
                                                          models())),
                         dynamics_case_name);
INSTANTIATE_TEST_SUITE_P(Columns, DynamicsConformance,
                         testing::ValuesIn(dynamics_cases(kFile, "newton_euler", "inertia_matrix",
                                                          {puma560(), scara(), tree(),
                                                           floating_manipulator()},
                                                          {{"inertia_method", "columns"}})),
                         dynamics_case_name);

std::vector<double> gravity_torques_at_zero(const RobotModel& m) {
  const rmp_provider* provider = *find_provider<InverseDynamics>(kFile, "newton_euler");
  auto solver = create<InverseDynamics>(*provider);
  EXPECT_TRUE(solver->prepare(m, TableParams(*provider)).ok());
  std::vector<double> q(m.dof()), tau(m.dof()), scratch(solver->scratch_size());
  DynamicsBatch b;
  b.count = 1, b.q = q, b.scratch = scratch;
  NoProgress none;
  EXPECT_TRUE(solver->torques(b, tau, none).ok());
  return tau;
}

// The paper's third validation case; digits from an evaluation independent of this project, the
// paper prints {0, 37.48366, 0.248928, 0, 0, 0}.
TEST(NewtonEuler, GivesThePublishedPumaGravityTorques) {
  const double expected[] = {0, 37.48366665, 0.24892875, 0, 0, 0};
  const auto tau = gravity_torques_at_zero(puma560());
  const auto gradient = potential_gradient(puma560(), std::vector<double>(6));
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_NEAR(tau[j], expected[j], 1e-8) << "joint " << j + 1;
    EXPECT_NEAR(tau[j], gradient[j], 1e-9) << "joint " << j + 1;
  }
}

TEST(NewtonEuler, GivesTheGravityTorquesOfTheModifiedPuma) {
  const double expected[] = {0, -36.98581, 0.24892875, 0, 0, 0};
  const auto tau = gravity_torques_at_zero(puma560_modified());
  const auto gradient = potential_gradient(puma560_modified(), std::vector<double>(6));
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_NEAR(tau[j], expected[j], 5e-6) << "joint " << j + 1;
    EXPECT_NEAR(tau[j], gradient[j], 1e-9) << "joint " << j + 1;
  }
}

}  // namespace
}  // namespace robomosp::conformance
