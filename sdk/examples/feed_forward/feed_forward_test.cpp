// SPDX-License-Identifier: Apache-2.0
// The controller on a mechanism whose inverse dynamics stands here in closed form: a pendulum of
// 1 kg at the end of a rod of 1 m, tau = qdd + g cos q.
#include <cmath>

#include <gtest/gtest.h>
#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/controller.h>

namespace {

using namespace robomosp;
using namespace robomosp::conformance;
constexpr double kGravity = 9.81;

class Pendulum final : public InverseDynamics {
 public:
  Result<void> prepare(const RobotModel&, const Params&) override { return {}; }
  std::size_t scratch_size() const override { return 0; }
  Result<void> torques(const DynamicsBatch& b, std::span<double> tau, Progress&) const override {
    tau[0] = (b.qdd.empty() ? 0 : b.qdd[0]) + kGravity * std::cos(b.q[0]);
    return {};
  }
  Result<void> inertia(const DynamicsBatch&, std::span<double> m, Progress&) const override {
    m[0] = 1;
    return {};
  }
};

TEST(FeedForward, FollowsASwingFromAWrongStart) {
  RobotModel m;
  add_joint(m, "pivot", -1, JointType::revolute, Pose{}, body(1, 1, 0, 0, 0, 0, 0));
  m.number_coordinates();
  const auto provider = find_provider<Controller>(ROBOMOSP_PLUGIN_FILE, "feed_forward");
  ASSERT_TRUE(provider.ok()) << provider.error().sentence();
  const auto controller = create<Controller>(**provider);
  Pendulum dynamics;
  ASSERT_TRUE(controller->prepare(m, dynamics, TableParams(**provider)).ok());
  double q = 0.2, qd = 0;
  const double h = 1e-4;
  for (int i = 0; i < 30000; ++i) {
    const double t = i * h, wanted[3] = {std::sin(t), std::cos(t), -std::sin(t)};
    double tau = 0;
    ControlInput in;
    in.time = t, in.dt = i ? h : 0;
    in.q = {&q, 1}, in.qd = {&qd, 1};
    in.q_desired = {&wanted[0], 1}, in.qd_desired = {&wanted[1], 1},
    in.qdd_desired = {&wanted[2], 1};
    ASSERT_TRUE(controller->torques(in, {}, {}, {&tau, 1}).ok());
    qd += h * (tau - kGravity * std::cos(q));
    q += h * qd;
  }
  EXPECT_NEAR(q, std::sin(3), 1e-3);
}

}  // namespace
