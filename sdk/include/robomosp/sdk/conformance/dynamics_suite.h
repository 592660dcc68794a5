// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.inverse_dynamics/1 and robomosp.forward_dynamics/1 (layer: contract
// helper for tests, GoogleTest, header-only). Energies are computed here from the bodies' motion,
// independently of any recursion. Include it in one file of a test program and instantiate
// DynamicsConformance with dynamics_cases(file, inverse provider, forward provider, models).
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/dynamics.h>

namespace robomosp::conformance {

/// Kinetic energy of bodies and motors [J]: velocities by differentiating the frames numerically
/// along the motion (central differences of order four), not by a recursion.
[[nodiscard]] inline double kinetic_energy(const RobotModel& m, const std::vector<double>& q,
                                           const std::vector<double>& qd) {
  const double h = 1e-3;
  const double steps[4] = {-2, -1, 1, 2}, weights[4] = {1.0 / 12, -8.0 / 12, 8.0 / 12, -1.0 / 12};
  std::vector<Pose> at[4];
  for (int s = 0; s < 4; ++s) {
    at[s] = joint_frames(m, advanced(m, q.data(), qd.data(), steps[s] * h).data());
  }
  const std::vector<Pose> now = joint_frames(m, q.data());
  double energy = 0;
  for (std::size_t i = 0; i < m.joints.size(); ++i) {
    const MassProperties& b = m.joints[i].body;
    Vec3 v{};
    double Rd[9] = {};
    for (int s = 0; s < 4; ++s) {
      const Pose c = multiply(at[s][i], shift(b.com[0], b.com[1], b.com[2]));
      for (std::size_t k = 0; k < 3; ++k) v[k] += weights[s] * c.p[k] / h;
      for (std::size_t k = 0; k < 9; ++k) Rd[k] += weights[s] * c.R[k] / h;
    }
    // Body-frame angular velocity from W = R^T Rd.
    double W[9] = {};
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k) W[3 * r + c] += now[i].R[3 * k + r] * Rd[3 * k + c];
    const double x = (W[7] - W[5]) / 2, y = (W[2] - W[6]) / 2, z = (W[3] - W[1]) / 2;
    const Sym3& I = b.inertia;
    energy += 0.5 * b.mass * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    energy += 0.5 * (I.xx * x * x + I.yy * y * y + I.zz * z * z) + I.xy * x * y + I.yz * y * z +
              I.xz * x * z;
    const JointModel& joint = m.joints[i];
    if (robomosp::velocity_count(joint.type) == 1) {
      const double rate = (joint.is_coupled() ? joint.coupling.ratio : 1) *
                          qd[static_cast<std::size_t>(joint.v_index)];
      energy += 0.5 * joint.armature * rate * rate;
    }
  }
  return energy;
}

/// Potential energy of the bodies [J].
[[nodiscard]] inline double potential_energy(const RobotModel& m, const std::vector<double>& q) {
  const std::vector<Pose> now = joint_frames(m, q.data());
  double energy = 0;
  for (std::size_t i = 0; i < m.joints.size(); ++i) {
    const MassProperties& b = m.joints[i].body;
    const Pose c = multiply(now[i], shift(b.com[0], b.com[1], b.com[2]));
    for (std::size_t k = 0; k < 3; ++k) energy -= b.mass * m.gravity[k] * c.p[k];
  }
  return energy;
}

/// dV by the velocities, by central differences of order four [N m or N].
[[nodiscard]] inline std::vector<double> potential_gradient(const RobotModel& m,
                                                            const std::vector<double>& q) {
  const double h = 2e-3;
  std::vector<double> g(m.dof()), unit(m.dof());
  for (std::size_t j = 0; j < g.size(); ++j) {
    const auto at = [&](double s) {
      std::fill(unit.begin(), unit.end(), 0.0);
      unit[j] = s;
      return potential_energy(m, advanced(m, q.data(), unit.data(), h));
    };
    g[j] = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h);
  }
  return g;
}

struct DynamicsCase {
  std::string file, inverse, forward;
  RobotModel model;
  std::vector<std::pair<std::string, std::string>> params;
};
inline std::vector<DynamicsCase> dynamics_cases(
    const std::string& file, const std::string& inverse, const std::string& forward,
    std::vector<RobotModel> models, std::vector<std::pair<std::string, std::string>> params = {}) {
  std::vector<DynamicsCase> cases;
  for (RobotModel& m : models) cases.push_back({file, inverse, forward, std::move(m), params});
  return cases;
}
inline void PrintTo(const DynamicsCase& c, std::ostream* os) {
  *os << c.inverse << " on " << c.model.name;
}
inline std::string dynamics_case_name(const testing::TestParamInfo<DynamicsCase>& info) {
  std::string s = info.param.model.name;
  for (char& c : s)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return s;
}

class DynamicsConformance : public testing::TestWithParam<DynamicsCase> {
 protected:
  void SetUp() override {
    auto id = find_provider<InverseDynamics>(GetParam().file, GetParam().inverse);
    ASSERT_TRUE(id.ok()) << id.error().sentence();
    auto fd = find_provider<ForwardDynamics>(GetParam().file, GetParam().forward);
    ASSERT_TRUE(fd.ok()) << fd.error().sentence();
    inverse_ = create<InverseDynamics>(**id);
    forward_ = create<ForwardDynamics>(**fd);
    TableParams ip(**id), fp(**fd);
    for (const auto& [name, text] : GetParam().params) ip.set(name, text), fp.set(name, text);
    const auto a = inverse_->prepare(model(), ip);
    ASSERT_TRUE(a.ok()) << a.error().sentence();
    const auto b = forward_->prepare(model(), fp);
    ASSERT_TRUE(b.ok()) << b.error().sentence();
    scratch_.resize(std::max(inverse_->scratch_size(), forward_->scratch_size()));
  }
  const RobotModel& model() const { return GetParam().model; }
  std::size_t dof() const { return model().dof(); }
  std::vector<double> torques(const std::vector<double>& q, const std::vector<double>& qd,
                              const std::vector<double>& qdd, std::uint32_t terms = kAllTerms,
                              const std::vector<TipWrench>& tip = {}) {
    DynamicsBatch b;
    b.count = q.size() / model().coordinate_count();
    b.q = q, b.qd = qd, b.qdd = qdd, b.tip = tip, b.terms = terms, b.scratch = scratch_;
    std::vector<double> tau(q.size());
    NoProgress none;
    const auto r = inverse_->torques(b, tau, none);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return tau;
  }
  std::vector<double> inertia(const std::vector<double>& q) {
    DynamicsBatch b;
    b.count = q.size() / model().coordinate_count();
    b.q = q, b.scratch = scratch_;
    std::vector<double> m(b.count * dof() * dof());
    NoProgress none;
    const auto r = inverse_->inertia(b, m, none);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return m;
  }
  Random random_{19560};
  std::unique_ptr<InverseDynamics> inverse_;
  std::unique_ptr<ForwardDynamics> forward_;
  std::vector<double> scratch_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(DynamicsConformance);

TEST_P(DynamicsConformance, TermsAddUpToTheWhole) {
  for (int i = 0; i < 20; ++i) {
    const auto q = random_.configuration(model()), qd = random_.vector(dof(), -2, 2),
               qdd = random_.vector(dof(), -5, 5);
    const std::vector<TipWrench> tip{{{3, -4, 5}, {0.3, 0.2, -0.1}}};
    const auto whole = torques(q, qd, qdd, kAllTerms, tip);
    std::vector<double> sum(dof());
    double size = 0;
    for (const std::uint32_t term :
         {kGravityTerm, kInertialTerm, kVelocityTerm, kFrictionTerm, kExternalTerm}) {
      const auto part = torques(q, qd, qdd, term, tip);
      for (std::size_t j = 0; j < dof(); ++j)
        sum[j] += part[j], size = std::max(size, std::fabs(part[j]));
    }
    for (std::size_t j = 0; j < dof(); ++j)
      EXPECT_NEAR(whole[j], sum[j], 1e-13 * (1 + size)) << "joint " << j + 1;
  }
}

TEST_P(DynamicsConformance, GravityTorqueIsTheGradientOfPotentialEnergy) {
  for (int i = 0; i < 10; ++i) {
    const auto q = random_.configuration(model());
    const auto g = torques(q, {}, {}, kGravityTerm), expected = potential_gradient(model(), q);
    for (std::size_t j = 0; j < dof(); ++j)
      EXPECT_NEAR(g[j], expected[j], 1e-8) << "joint " << j + 1;
  }
}

TEST_P(DynamicsConformance, InertiaIsSymmetricPositiveAndGivesTheKineticEnergy) {
  const std::size_t n = dof();
  for (int i = 0; i < 10; ++i) {
    const auto q = random_.configuration(model()), qd = random_.vector(n, -1, 1);
    const auto m = inertia(q);
    double energy = 0;
    for (std::size_t r = 0; r < n; ++r)
      for (std::size_t c = 0; c < n; ++c) {
        EXPECT_NEAR(m[r * n + c], m[c * n + r], 1e-14);
        energy += 0.5 * qd[r] * m[r * n + c] * qd[c];
      }
    EXPECT_GT(energy, 0);
    EXPECT_NEAR(energy, kinetic_energy(model(), q, qd), 1e-9 * (1 + energy));
  }
}

TEST_P(DynamicsConformance, ColumnsOfTheInertiaAreTorquesOfUnitAccelerations) {
  const std::size_t n = dof();
  const auto q = random_.configuration(model());
  const auto m = inertia(q);
  for (std::size_t k = 0; k < n; ++k) {
    std::vector<double> unit(n);
    unit[k] = 1;
    const auto tau = torques(q, {}, unit, kInertialTerm);
    for (std::size_t j = 0; j < n; ++j)
      EXPECT_NEAR(tau[j], m[j * n + k], 1e-12) << j + 1 << ", " << k + 1;
  }
}

TEST_P(DynamicsConformance, TorquesSatisfyLagrangesEquation) {
  // tau_j = d/dt (dT/dqd_j) - dT/dq_j + dV/dq_j, with T = qd^T M(q) qd / 2 from the energies above:
  // dT/dq by differences of the kinetic energy, the time derivative along (qd, qdd).
  const std::size_t n = dof();
  const auto q = random_.configuration(model()), qd = random_.vector(n, -1, 1),
             qdd = random_.vector(n, -2, 2);
  const auto tau = torques(q, qd, qdd, kGravityTerm | kInertialTerm | kVelocityTerm);
  const auto gravity = potential_gradient(model(), q);
  // T is quadratic in qd, so this difference is exact but for rounding.
  const auto momentum = [&](const std::vector<double>& x, const std::vector<double>& v,
                            std::size_t j) {
    std::vector<double> up = v, down = v;
    up[j] += 0.5, down[j] -= 0.5;
    return kinetic_energy(model(), x, up) - kinetic_energy(model(), x, down);
  };
  const double h = 1e-3;
  for (std::size_t j = 0; j < n; ++j) {
    const auto along = [&](double s) {
      std::vector<double> x = q, v = qd;
      for (std::size_t k = 0; k < n; ++k) {
        x[k] += s * h * qd[k] + 0.5 * s * s * h * h * qdd[k];
        v[k] += s * h * qdd[k];
      }
      return momentum(x, v, j);
    };
    const auto across = [&](double s) {
      std::vector<double> x = q;
      x[j] += s * h;
      return kinetic_energy(model(), x, qd);
    };
    const auto derivative = [&](const auto& f) {
      return (8 * (f(1) - f(-1)) - (f(2) - f(-2))) / (12 * h);
    };
    const double expected = derivative(along) - derivative(across) + gravity[j];
    EXPECT_NEAR(tau[j], expected, 1e-7 * (1 + std::fabs(expected))) << "joint " << j + 1;
  }
}

TEST_P(DynamicsConformance, PowerEqualsTheRateOfEnergyWithoutFriction) {
  const std::size_t n = dof();
  const auto q = random_.configuration(model()), qd = random_.vector(n, -1, 1),
             qdd = random_.vector(n, -2, 2);
  const auto tau = torques(q, qd, qdd, kGravityTerm | kInertialTerm | kVelocityTerm);
  double power = 0;
  for (std::size_t j = 0; j < n; ++j) power += tau[j] * qd[j];
  const double h = 1e-3;
  const auto energy = [&](double s) {
    std::vector<double> x = q, v = qd;
    for (std::size_t k = 0; k < n; ++k) {
      x[k] += s * h * qd[k] + 0.5 * s * s * h * h * qdd[k];
      v[k] += s * h * qdd[k];
    }
    return kinetic_energy(model(), x, v) + potential_energy(model(), x);
  };
  const double rate = (8 * (energy(1) - energy(-1)) - (energy(2) - energy(-2))) / (12 * h);
  EXPECT_NEAR(power, rate, 1e-7 * (1 + std::fabs(power)));
}

TEST_P(DynamicsConformance, AWrenchAtTheTipIsBalancedByVirtualWork) {
  const std::size_t n = dof();
  const auto q = random_.configuration(model());
  const TipWrench w{{3, -4, 5}, {0.3, 0.2, -0.1}};
  const auto tau = torques(q, {}, {}, kExternalTerm, {w});
  const double h = 1e-4;
  for (std::size_t j = 0; j < n; ++j) {
    std::vector<double> up = q, down = q;
    up[j] += h, down[j] -= h;
    const Pose a = tip_pose(model(), down.data()), b = tip_pose(model(), up.data());
    double work = 0;
    for (std::size_t k = 0; k < 3; ++k) work += w.force[k] * (b.p[k] - a.p[k]);
    // Small rotation b a^T, read from its skew part.
    double D[9] = {};
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t k = 0; k < 3; ++k) D[3 * r + c] += b.R[3 * r + k] * a.R[3 * c + k];
    work += 0.5 * (w.moment[0] * (D[7] - D[5]) + w.moment[1] * (D[2] - D[6]) +
                   w.moment[2] * (D[3] - D[1]));
    EXPECT_NEAR(tau[j], -work / (2 * h), 1e-6) << "joint " << j + 1;
  }
}

TEST_P(DynamicsConformance, ForwardUndoesInverseForManySamplesAtOnce) {
  constexpr std::size_t kCount = 50;
  std::vector<double> q, qd = random_.vector(kCount * dof(), -2, 2),
                         qdd = random_.vector(kCount * dof(), -5, 5);
  for (std::size_t i = 0; i < kCount; ++i)
    for (const double x : random_.configuration(model())) q.push_back(x);
  const std::vector<TipWrench> tip{{{1, 2, -3}, {0.1, 0, 0.2}}};
  const auto tau = torques(q, qd, qdd, kAllTerms, tip);
  DynamicsBatch b;
  b.count = kCount, b.q = q, b.qd = qd, b.tau = tau, b.tip = tip, b.scratch = scratch_;
  std::vector<double> back(q.size());
  NoProgress none;
  const auto r = forward_->accelerations(b, back, none);
  ASSERT_TRUE(r.ok()) << r.error().sentence();
  for (std::size_t i = 0; i < back.size(); ++i) EXPECT_NEAR(back[i], qdd[i], 1e-8) << "value " << i;
}

TEST_P(DynamicsConformance, FrictionOpposesMotionAndIsZeroAtRest) {
  const auto q = random_.configuration(model());
  const std::vector<double> forward(dof(), 0.5), backward(dof(), -0.5), rest(dof(), 0.0);
  const auto f = torques(q, forward, {}, kFrictionTerm),
             b = torques(q, backward, {}, kFrictionTerm);
  const auto r = torques(q, rest, {}, kFrictionTerm);
  for (std::size_t j = 0; j < dof(); ++j) {
    const JointFriction& t = model().joints[j].friction;
    EXPECT_DOUBLE_EQ(f[j], 0.5 * t.viscous + t.coulomb_positive);
    EXPECT_DOUBLE_EQ(b[j], -0.5 * t.viscous + t.coulomb_negative);
    EXPECT_EQ(r[j], 0);
  }
}

TEST_P(DynamicsConformance, WrongSizesAreRefusedAndCancelIsHeard) {
  std::vector<double> q(dof()), tau(dof()), small(1);
  DynamicsBatch b;
  b.count = 1, b.q = q, b.scratch = scratch_;
  NoProgress none;
  CancelledProgress stop;
  EXPECT_TRUE(inverse_->torques(b, tau, none).ok());
  EXPECT_FALSE(inverse_->torques(b, std::span<double>(tau).first(dof() - 1), none).ok());
  const auto stopped = inverse_->torques(b, tau, stop);
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::cancelled);
  b.count = 2;
  EXPECT_FALSE(inverse_->torques(b, tau, none).ok()) << "q of one sample for two";
  b.count = 1;
  b.scratch = small;
  EXPECT_FALSE(inverse_->torques(b, tau, none).ok()) << "scratch of one double";
  EXPECT_FALSE(forward_->accelerations(b, tau, none).ok()) << "scratch of one double";
}

TEST_P(DynamicsConformance, AMasslessLastBodyIsRefusedByNameInForwardDynamics) {
  RobotModel broken = model();
  broken.joints.back().body = {};
  broken.joints.back().armature = 0;
  broken.joints.back().name = "the light one";
  TableParams params(**find_provider<ForwardDynamics>(GetParam().file, GetParam().forward));
  const auto r = forward_->prepare(broken, params);
  ASSERT_FALSE(r.ok());
  EXPECT_NE(r.error().sentence().find("the light one"), std::string::npos) << r.error().sentence();
}

/// tau of the two rods of planar_rods() from their closed form (Spong, Robot Modeling and Control,
/// 7.3): angles from the horizontal, I about each rod's middle.
[[nodiscard]] inline std::vector<double> rods_closed_form(const std::vector<double>& q,
                                                          const std::vector<double>& qd,
                                                          const std::vector<double>& qdd) {
  const double l1 = 0.7, m1 = 2.5, l2 = 0.45, m2 = 1.2, c1 = l1 / 2, c2 = l2 / 2, g = 9.81;
  const double i1 = m1 * l1 * l1 / 12, i2 = m2 * l2 * l2 / 12;
  const double c = std::cos(q[1]), h = -m2 * l1 * c2 * std::sin(q[1]);
  const double d11 = m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2 + 2 * l1 * c2 * c) + i1 + i2;
  const double d12 = m2 * (c2 * c2 + l1 * c2 * c) + i2, d22 = m2 * c2 * c2 + i2;
  const double g2 = m2 * c2 * g * std::cos(q[0] + q[1]),
               g1 = (m1 * c1 + m2 * l1) * g * std::cos(q[0]) + g2;
  return {d11 * qdd[0] + d12 * qdd[1] + h * (2 * qd[0] * qd[1] + qd[1] * qd[1]) + g1,
          d12 * qdd[0] + d22 * qdd[1] - h * qd[0] * qd[0] + g2};
}

TEST_P(DynamicsConformance, TwoRodsFollowTheirClosedForm) {
  if (model().name != "planar2rods") GTEST_SKIP() << "only for the two rods";
  for (int i = 0; i < 50; ++i) {
    const auto q = random_.configuration(model()), qd = random_.vector(2, -3, 3),
               qdd = random_.vector(2, -5, 5);
    const auto tau = torques(q, qd, qdd), expected = rods_closed_form(q, qd, qdd);
    for (std::size_t j = 0; j < 2; ++j)
      EXPECT_NEAR(tau[j], expected[j], 1e-12) << "joint " << j + 1;
  }
}

}  // namespace robomosp::conformance
