// SPDX-License-Identifier: Apache-2.0
// Every provider on mechanisms with followers, floating bases and closed loops: it solves or it
// refuses with a sentence. None crashes, and none fails as a program.
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include <robomosp/sdk/controller.h>
#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/ik.h>
#include <robomosp/sdk/integrator.h>
#include <robomosp/sdk/robot_code.h>

#include "lua/lua_state.h"
#include "support/program.h"

namespace robomosp::lua {
namespace {

class EveryProvider : public test::ProgramTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    state_ = std::make_unique<LuaState>(app(), session_, LuaOptions{});
    const auto loaded = state_->eval(std::string("arm = robot '") + GetParam() +
                                     "' world.create{name = 'cell'}:add_robot{robot = arm}");
    ASSERT_TRUE(loaded.ok()) << loaded.error().sentence();
  }
  void expect_solved_or_refused(const std::string& code) {
    const auto done = state_->eval(code);
    if (done.ok()) {
      ++solved_;
      return;
    }
    const Error& e = done.error();
    EXPECT_TRUE(e.code == ErrorCode::unsupported || e.code == ErrorCode::unreachable ||
                e.code == ErrorCode::invalid_argument)
        << code << ": " << to_string(e.code) << ": " << e.sentence();
    EXPECT_FALSE(e.message.empty()) << code;
  }
  void expect_each(const char* interface_id, const std::string& before, const std::string& after) {
    for (const ProviderInfo& p : app().registry.list(interface_id)) {
      SCOPED_TRACE(p.name);
      expect_solved_or_refused(before + "'" + p.name + "'" + after);
    }
  }
  ioci::Session session_{"test"};
  std::unique_ptr<LuaState> state_;
  int solved_ = 0;
};

TEST_P(EveryProvider, SolvesOrRefuses) {
  const std::string target = "target = pose(0.1, 0.05, 0.2, rpy(0.1, 0.2, 0.3))";
  expect_each(IkSolver::kInterfaceId,
              "arm:solve_ik{" + target + ", partial = true, provider = ", "}");
  expect_each(IkSolver::kInterfaceId,
              "arm:solve_ik{" + target + ", partial = true, all = true, provider = ", "}");
  expect_each(IkSolver::kInterfaceId,
              "arm:solve_ik{" + target + ", partial = true, arm_angle = 0.3, provider = ", "}");
  expect_each(
      IkSolver::kInterfaceId,
      "arm:solve_goals{goals = {{" + target + ", parts = 'position'}}, partial = true, provider = ",
      "}");
  for (const char* what : {"inverse_dynamics", "inertia", "gravity_torques", "energy", "momentum",
                           "regressor", "dynamics_derivatives"})
    expect_each(InverseDynamics::kInterfaceId, std::string("arm:") + what + "{provider = ", "}");
  expect_each(ForwardDynamics::kInterfaceId, "arm:forward_dynamics{provider = ", "}");
  expect_each(Controller::kInterfaceId,
              "arm:simulate{duration = 0.005, sample_time = 0.005, reference = "
              "arm:joint_values(), controller = ",
              "}");
  expect_each(Integrator::kInterfaceId,
              "arm:simulate{duration = 0.005, sample_time = 0.005, integrator = ", "}");
  expect_each(RobotCodeGenerator::kInterfaceId,
              "arm:generate_code{folder = '" + std::filesystem::temp_directory_path().string() +
                  "', name = 'every_mechanism', provider = ",
              "}");
  EXPECT_GT(solved_, 5) << "hardly anything was solved: is it asked rightly?";
}

INSTANTIATE_TEST_SUITE_P(Mechanisms, EveryProvider,
                         testing::Values("gripper", "satellite_arm", "stewart", "delta", "pa10",
                                         "dual_arm", "slider_crank"),
                         [](const auto& c) { return std::string(c.param); });

}  // namespace
}  // namespace robomosp::lua
