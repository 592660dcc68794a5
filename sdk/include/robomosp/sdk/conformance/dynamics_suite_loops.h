// SPDX-License-Identifier: Apache-2.0
// Suite of robomosp.forward_dynamics/1 for mechanisms with closed loops: the accelerations keep the
// loops closed and the forces balance the equations of motion, both judged by the bodies' frames
// alone (layer: contract helper for tests, GoogleTest, header-only). Instantiate LoopConformance
// with dynamics_cases(file, "", forward provider, models).
#pragma once

#include <robomosp/sdk/conformance/dynamics_suite.h>

namespace robomosp::conformance {

class LoopConformance : public testing::TestWithParam<DynamicsCase> {
 protected:
  void SetUp() override {
    auto fd = find_provider<ForwardDynamics>(GetParam().file, GetParam().forward);
    ASSERT_TRUE(fd.ok()) << fd.error().sentence();
    forward_ = create<ForwardDynamics>(**fd);
    TableParams params(**fd);
    for (const auto& [name, text] : GetParam().params) params.set(name, text);
    const auto prepared = forward_->prepare(model(), params);
    ASSERT_TRUE(prepared.ok()) << prepared.error().sentence();
    scratch_.resize(forward_->scratch_size());
    q_ = closed_near(model(), random_.configuration(model()));
    for (const double r : loop_residuals(model(), q_))
      ASSERT_LT(std::fabs(r), 1e-11) << "the test did not close the loops";
    const auto any = random_.vector(model().dof(), -1, 1);
    qd_ = velocities_that_close(model(), q_, any);
    tau_ = random_.vector(model().dof(), -2, 2);
  }
  const RobotModel& model() const { return GetParam().model; }
  /// Accelerations and forces in the state of the members.
  void solve(std::vector<double>& qdd, std::vector<double>& forces,
             const BaseMotion* base = nullptr) {
    DynamicsBatch b;
    b.count = 1;
    b.q = q_, b.qd = qd_, b.tau = tau_, b.scratch = scratch_;
    b.terms = kAllTerms & ~static_cast<std::uint32_t>(kFrictionTerm);
    if (base) b.base = std::span(base, 1);
    qdd.assign(model().dof(), 0);
    forces.assign(loop_residuals(model(), q_).size(), 0);
    const auto r = forward_->constrained(b, qdd, forces, none_);
    ASSERT_TRUE(r.ok()) << r.error().sentence();
    std::vector<double> alone(qdd.size());
    const auto s = forward_->accelerations(b, alone, none_);
    ASSERT_TRUE(s.ok()) << s.error().sentence();
    EXPECT_EQ(alone, qdd) << "with and without the forces asked for";
  }
  Random random_{6021};
  std::unique_ptr<ForwardDynamics> forward_;
  std::vector<double> scratch_, q_, qd_, tau_;
  NoProgress none_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(LoopConformance);

TEST_P(LoopConformance, AccelerationsKeepTheLoopsClosed) {
  std::vector<double> qdd, forces;
  solve(qdd, forces);
  // Along a motion with these velocities and accelerations the residuals stay zero to the third
  // order of time.
  double size = 1;
  for (const double x : qdd) size = std::max(size, std::fabs(x));
  const double h = 0.02 / std::sqrt(size);
  const auto at = [&](double t) {
    return loop_residuals(model(), moved_on(model(), q_, qd_, qdd, t));
  };
  const auto u = at(h), d = at(-h), uu = at(2 * h), dd = at(-2 * h), now = at(0);
  for (std::size_t i = 0; i < now.size(); ++i)
    EXPECT_NEAR((16 * (u[i] + d[i]) - (uu[i] + dd[i]) - 30 * now[i]) / (12 * h * h), 0, 1e-6 * size)
        << "residual " << i + 1;
}

TEST_P(LoopConformance, ForcesBalanceTheEquationsOfMotion) {
  const BaseMotion base{{1, -2, -9}, {0.5, 1, -2}, {0.4, -0.7, 0.9}, {-1, 2, 0.5}};
  for (const BaseMotion* moving : {static_cast<const BaseMotion*>(nullptr), &base}) {
    std::vector<double> qdd, forces;
    solve(qdd, forces, moving);
    const auto needed = kane_torques(model(), q_, qd_, qdd, moving);
    const auto springs = gradient(model(), q_, spring_energy);
    const auto J = loop_force_rows(model(), q_);
    double size = 1;
    for (const double x : needed) size = std::max(size, std::fabs(x));
    for (const double x : forces) size = std::max(size, std::fabs(x));
    for (std::size_t k = 0; k < model().dof(); ++k) {
      double sum = tau_[k] - springs[k];
      for (std::size_t i = 0; i < forces.size(); ++i) sum += J[i][k] * forces[i];
      EXPECT_NEAR(sum, needed[k], 1e-7 * size) << "entry " << k + 1;
    }
  }
}

TEST_P(LoopConformance, AFrictionlessMechanismKeepsItsPower) {
  // Loops do no work: the rate of kinetic energy is the power of drives and weight.
  std::vector<double> qdd, forces;
  solve(qdd, forces);
  const double rate = difference(
      [&](double t) {
        std::vector<double> v = qd_;
        for (std::size_t k = 0; k < v.size(); ++k) v[k] += t * qdd[k];
        const auto x = moved_on(model(), q_, qd_, qdd, t);
        return kinetic_energy(model(), x, v) + potential_energy(model(), x) +
               spring_energy(model(), x);
      },
      1e-3);
  double power = 0;
  for (std::size_t k = 0; k < qd_.size(); ++k) power += tau_[k] * qd_[k];
  double size = 1;
  for (const double x : qdd) size = std::max(size, std::fabs(x));
  EXPECT_NEAR(rate, power, 1e-8 * size * (1 + std::fabs(power)));
}

TEST_P(LoopConformance, AnOpenedLoopIsPulledTogether) {
  // A small gap at rest, without weight and drives: the loops accelerate against it.
  std::vector<double> push = random_.vector(model().dof(), -1e-4, 1e-4);
  q_ = advanced(model(), q_.data(), push.data(), 1);
  std::vector<double> qdd(model().dof());
  DynamicsBatch b;
  b.count = 1;
  b.q = q_, b.scratch = scratch_, b.terms = 0;
  const auto r = forward_->accelerations(b, qdd, none_);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  const auto gap = loop_residuals(model(), q_);
  const auto J = loop_jacobian(model(), q_);
  double towards = 0, size = 0;
  for (std::size_t i = 0; i < gap.size(); ++i)
    for (std::size_t k = 0; k < qdd.size(); ++k) towards += gap[i] * J[i][k] * qdd[k];
  for (const double x : gap) size += x * x;
  EXPECT_LT(towards, -size) << "the gap's square must fall";
}

}  // namespace robomosp::conformance
