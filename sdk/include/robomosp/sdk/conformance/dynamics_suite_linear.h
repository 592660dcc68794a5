// SPDX-License-Identifier: Apache-2.0
// The part of the dynamics suite for what providers may leave out: energy and momentum, the
// regressor, partial derivatives (layer: contract helper for tests, GoogleTest, header-only).
// Included by dynamics_suite.h.
#pragma once

#include <robomosp/sdk/conformance/dynamics_suite.h>

namespace robomosp::conformance {

TEST_P(DynamicsConformance, EnergyAndMomentumAreThoseOfTheBodies) {
  for (int i = 0; i < 5; ++i) {
    const auto q = random_.configuration(model()), qd = rates(1);
    std::vector<Energy> out(1);
    if (left_out(inverse_->energy(batch(q, qd), out, none_)))
      GTEST_SKIP() << "the provider computes no energy";
    const Energy e = energy_of_motion(model(), q, qd);
    EXPECT_NEAR(out[0].kinetic, e.kinetic, 1e-9 * (1 + e.kinetic));
    const double potential = potential_energy(model(), q) + spring_energy(model(), q);
    EXPECT_NEAR(out[0].potential, potential, 1e-11 * (1 + std::fabs(potential)));
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(out[0].momentum[k], e.momentum[k], 1e-9 * (1 + std::fabs(e.momentum[k])));
      EXPECT_NEAR(out[0].angular_momentum[k], e.angular_momentum[k],
                  1e-9 * (1 + std::fabs(e.angular_momentum[k])));
      EXPECT_NEAR(out[0].com[k], e.com[k], 1e-12);
    }
  }
}

/// The ten parameters of a body about its joint frame's origin, as InverseDynamics::regressor has
/// them: the parallel axis theorem by hand.
[[nodiscard]] inline std::array<double, 10> ten_parameters(const MassProperties& b) {
  const double m = b.mass, x = b.com[0], y = b.com[1], z = b.com[2];
  const Sym3& I = b.inertia;
  return {m,
          m * x,
          m * y,
          m * z,
          I.xx + m * (y * y + z * z),
          I.yy + m * (x * x + z * z),
          I.zz + m * (x * x + y * y),
          I.xy - m * x * y,
          I.yz - m * y * z,
          I.xz - m * x * z};
}

TEST_P(DynamicsConformance, TheRegressorTimesTheParametersGivesTheTorques) {
  const std::size_t n = dof(), width = 10 * model().joints.size();
  const BaseMotion base{{1, -2, -9}, {0.5, 1, -2}, {0.4, -0.7, 0.9}, {-1, 2, 0.5}};
  for (const std::uint32_t terms :
       {kGravityTerm | kInertialTerm | kVelocityTerm, kGravityTerm + 0U, kVelocityTerm + 0U}) {
    const auto q = random_.configuration(model()), qd = rates(1), qdd = rates(2);
    DynamicsBatch b = batch(q, qd, qdd, terms);
    if (terms != kGravityTerm) b.base = std::span(&base, 1);
    std::vector<double> y(n * width);
    if (left_out(inverse_->regressor(b, y, none_)))
      GTEST_SKIP() << "the provider computes no regressor";
    std::vector<double> tau = torques(b);
    for (const JointModel& j : model().joints)
      if ((terms & kInertialTerm) && robomosp::velocity_count(j.type) == 1) {
        const double ratio = j.is_coupled() ? j.coupling.ratio : 1;
        const auto v = static_cast<std::size_t>(j.v_index);
        tau[v] -= ratio * ratio * j.armature * qdd[v];
      }
    for (std::size_t r = 0; r < n; ++r) {
      double sum = 0, size = 1;
      for (std::size_t i = 0; i < model().joints.size(); ++i) {
        const auto pi = ten_parameters(model().joints[i].body);
        for (std::size_t p = 0; p < 10; ++p) {
          const double part = y[r * width + 10 * i + p] * pi[p];
          sum += part;
          size = std::max(size, std::fabs(part));
        }
      }
      EXPECT_NEAR(sum, tau[r], 1e-11 * size) << "entry " << r + 1;
    }
  }
}

TEST_P(DynamicsConformance, DerivativesOfTheTorquesAreTheirDifferences) {
  const std::size_t n = dof();
  const std::vector<TipWrench> tip{{{3, -4, 5}, {0.3, 0.2, -0.1}}};
  const BaseMotion base{{1, -2, -9}, {0.5, 1, -2}, {0.4, -0.7, 0.9}, {-1, 2, 0.5}};
  const auto q = random_.configuration(model()), qd = rates(1), qdd = rates(2);
  const std::uint32_t some[] = {kAllTerms, kGravityTerm | kExternalTerm, kVelocityTerm};
  for (std::size_t at = 0; at < 3; ++at) {
    DynamicsBatch b = batch(q, qd, qdd, some[at], tip);
    b.tip_index = static_cast<std::int32_t>(at % model().tips.size());
    if (at != 1) b.base = std::span(&base, 1);
    std::vector<double> by_q(n * n), by_qd(n * n);
    if (left_out(inverse_->derivatives(b, by_q, by_qd, none_)))
      GTEST_SKIP() << "the provider computes no derivatives";
    double size = 1;
    for (const auto* m : {&by_q, &by_qd})
      for (const double x : *m) size = std::max(size, std::fabs(x));
    for (std::size_t k = 0; k < n; ++k)
      for (const bool rate : {false, true}) {
        const auto at_step = [&](double h) {
          std::vector<double> x = q, v = qd;
          if (rate) v[k] += h;
          else x = nudged(model(), q, k, h);
          DynamicsBatch s = b;
          s.q = x, s.qd = v;
          return torques(s);
        };
        const double h = 1e-3;
        const auto u = at_step(h), d = at_step(-h), uu = at_step(2 * h), dd = at_step(-2 * h);
        for (std::size_t r = 0; r < n; ++r)
          EXPECT_NEAR((rate ? by_qd : by_q)[r * n + k],
                      (8 * (u[r] - d[r]) - (uu[r] - dd[r])) / (12 * h), 1e-8 * size)
              << "terms " << some[at] << ", of entry " << r + 1 << " by "
              << (rate ? "rate " : "place ") << k + 1;
      }
  }
}

TEST_P(DynamicsConformance, DerivativesOfTheAccelerationsAreTheirDifferences) {
  if (!forward_) GTEST_SKIP() << "it has no forward dynamics";
  const std::size_t n = dof();
  const std::vector<TipWrench> tip{{{3, -4, 5}, {0.3, 0.2, -0.1}}};
  const BaseMotion base{{1, -2, -9}, {0.5, 1, -2}, {0.4, -0.7, 0.9}, {-1, 2, 0.5}};
  const auto q = random_.configuration(model()), qd = rates(1), tau = rates(3);
  DynamicsBatch b = batch(q, qd, {}, kAllTerms, tip);
  b.tau = tau;
  b.base = std::span(&base, 1);
  std::vector<double> by_q(n * n), by_qd(n * n), by_tau(n * n);
  if (left_out(forward_->derivatives(b, by_q, by_qd, by_tau, none_)))
    GTEST_SKIP() << "the provider computes no derivatives";
  const std::vector<double>* const matrices[] = {&by_q, &by_qd, &by_tau};
  for (std::size_t kind = 0; kind < 3; ++kind) {
    double size = 1;
    for (const double x : *matrices[kind]) size = std::max(size, std::fabs(x));
    for (std::size_t k = 0; k < n; ++k) {
      const auto at_step = [&](double h) {
        std::vector<double> x = q, v = qd, f = tau;
        if (kind == 0) x = nudged(model(), q, k, h);
        else (kind == 1 ? v : f)[k] += h;
        DynamicsBatch s = b;
        s.q = x, s.qd = v, s.tau = f;
        return accelerations(s);
      };
      const double h = kind == 0 ? 3e-4 : 1e-3;
      const auto u = at_step(h), d = at_step(-h), uu = at_step(2 * h), dd = at_step(-2 * h);
      for (std::size_t r = 0; r < n; ++r)
        EXPECT_NEAR((*matrices[kind])[r * n + k], (8 * (u[r] - d[r]) - (uu[r] - dd[r])) / (12 * h),
                    1e-7 * size)
            << "of entry " << r + 1 << " by "
            << (kind == 0   ? "place "
                : kind == 1 ? "rate "
                            : "force ")
            << k + 1;
    }
  }
}

}  // namespace robomosp::conformance
