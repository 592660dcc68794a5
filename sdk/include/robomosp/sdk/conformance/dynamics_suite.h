// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.inverse_dynamics/1 and robomosp.forward_dynamics/1 (layer: contract
// helper for tests, GoogleTest, header-only). What a provider answers with ErrorCode::unsupported
// is skipped; a provider of one half alone is tested as such. Include it in one file of a test
// program and instantiate DynamicsConformance with dynamics_cases(file, inverse provider, forward
// provider, models). Derivatives and what is linear in the masses are in dynamics_suite_linear.h,
// closed loops in dynamics_suite_loops.h.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/dynamics_reference.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/solve_or_refuse.h>
#include <robomosp/sdk/dynamics.h>

namespace robomosp::conformance {

struct DynamicsCase {
  std::string file, inverse, forward;  ///< forward: empty = the plugin has inverse dynamics only
  RobotModel model;
  std::vector<std::pair<std::string, std::string>> params;
  std::string inverse_file;  ///< when the inverse dynamics come from another plugin
};
inline std::vector<DynamicsCase> dynamics_cases(
    const std::string& file, const std::string& inverse, const std::string& forward,
    std::vector<RobotModel> models, std::vector<std::pair<std::string, std::string>> params = {}) {
  std::vector<DynamicsCase> cases;
  for (RobotModel& m : models) cases.push_back({file, inverse, forward, std::move(m), params, {}});
  return cases;
}
/// The same with the inverse dynamics of another plugin.
inline std::vector<DynamicsCase> with_inverse_of(const std::string& file,
                                                 std::vector<DynamicsCase> cases) {
  for (DynamicsCase& c : cases) c.inverse_file = file;
  return cases;
}
inline void PrintTo(const DynamicsCase& c, std::ostream* os) {
  *os << c.inverse;
  if (!c.forward.empty()) *os << " and " << c.forward;
  *os << " on " << c.model.name;
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
    const DynamicsCase& c = GetParam();
    auto id =
        find_provider<InverseDynamics>(c.inverse_file.empty() ? c.file : c.inverse_file, c.inverse);
    ASSERT_TRUE(id.ok()) << id.error().sentence();
    inverse_ = create<InverseDynamics>(**id);
    TableParams ip(**id);
    for (const auto& [name, text] : c.params) ip.set(name, text);
    ready(inverse_->prepare(model(), ip));
    if (IsSkipped() || HasFatalFailure()) return;
    scratch_.resize(inverse_->scratch_size());
    if (c.forward.empty()) return;
    auto fd = find_provider<ForwardDynamics>(c.file, c.forward);
    ASSERT_TRUE(fd.ok()) << fd.error().sentence();
    forward_ = create<ForwardDynamics>(**fd);
    TableParams fp(**fd);
    for (const auto& [name, text] : c.params) fp.set(name, text);
    ready(forward_->prepare(model(), fp));
    if (IsSkipped() || HasFatalFailure()) return;
    scratch_.resize(std::max(scratch_.size(), forward_->scratch_size()));
  }
  static void ready(const Result<void>& prepared) {
    if (!prepared.ok() && prepared.error().code == ErrorCode::unsupported)
      GTEST_SKIP() << prepared.error().sentence();
    ASSERT_TRUE(prepared.ok()) << prepared.error().sentence();
  }
  const RobotModel& model() const { return GetParam().model; }
  std::size_t dof() const { return model().dof(); }
  std::vector<double> rates(double size) { return random_.vector(dof(), -size, size); }
  /// A batch of all the samples in q; the vectors must live as long.
  DynamicsBatch batch(const std::vector<double>& q, const std::vector<double>& qd = {},
                      const std::vector<double>& qdd = {}, std::uint32_t terms = kAllTerms,
                      const std::vector<TipWrench>& tip = {}) {
    DynamicsBatch b;
    b.count = q.size() / model().coordinate_count();
    b.q = q, b.qd = qd, b.qdd = qdd, b.tip = tip, b.terms = terms, b.scratch = scratch_;
    return b;
  }
  std::vector<double> torques(const DynamicsBatch& b) {
    std::vector<double> tau(b.count * dof());
    const auto r = inverse_->torques(b, tau, none_);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return tau;
  }
  std::vector<double> torques(const std::vector<double>& q, const std::vector<double>& qd,
                              const std::vector<double>& qdd, std::uint32_t terms = kAllTerms,
                              const std::vector<TipWrench>& tip = {}) {
    return torques(batch(q, qd, qdd, terms, tip));
  }
  std::vector<double> accelerations(const DynamicsBatch& b) {
    std::vector<double> qdd(b.count * dof());
    const auto r = forward_->accelerations(b, qdd, none_);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return qdd;
  }
  std::vector<double> inertia(const std::vector<double>& q) {
    const DynamicsBatch b = batch(q);
    std::vector<double> m(b.count * dof() * dof());
    const auto r = inverse_->inertia(b, m, none_);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return m;
  }
  /// True when a function that a provider may leave out was left out, as it should say it.
  static bool left_out(const Result<void>& r) {
    if (r.ok()) return false;
    EXPECT_EQ(r.error().code, ErrorCode::unsupported) << r.error().sentence();
    return true;
  }
  Random random_{19560};
  std::unique_ptr<InverseDynamics> inverse_;
  std::unique_ptr<ForwardDynamics> forward_;
  std::vector<double> scratch_;
  NoProgress none_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(DynamicsConformance);

TEST_P(DynamicsConformance, EveryMechanismIsSolvedOrRefused) {
  const DynamicsCase& c = GetParam();
  const auto id =
      find_provider<InverseDynamics>(c.inverse_file.empty() ? c.file : c.inverse_file, c.inverse);
  ASSERT_TRUE(id.ok());
  solve_or_refuse([&] { return create<InverseDynamics>(**id); }, TableParams(**id));
  if (c.forward.empty()) return;
  const auto fd = find_provider<ForwardDynamics>(c.file, c.forward);
  ASSERT_TRUE(fd.ok());
  solve_or_refuse([&] { return create<ForwardDynamics>(**fd); }, TableParams(**fd));
}

TEST_P(DynamicsConformance, SeveralThreadsGetTheSameTorquesAtOnce) {
  const std::vector<double> q = rest(model()), qd = rates(1), qdd = rates(2);
  const std::vector<double> alone = torques(q, qd, qdd);
  std::array<std::vector<double>, 4> together;
  at_once(together.size(), [&](std::size_t thread) {
    NoProgress none;
    std::vector<double> scratch(inverse_->scratch_size());
    DynamicsBatch b;
    b.count = 1;
    b.q = q, b.qd = qd, b.qdd = qdd, b.scratch = scratch;
    together[thread].resize(dof());
    EXPECT_TRUE(inverse_->torques(b, together[thread], none).ok());
  });
  for (const auto& tau : together) EXPECT_EQ(tau, alone);
}

TEST_P(DynamicsConformance, SeveralThreadsGetTheSameAccelerationsAtOnce) {
  if (!forward_) GTEST_SKIP() << "it has no forward dynamics";
  const std::vector<double> q = rest(model()), qd = rates(1), tau = rates(2);
  DynamicsBatch one = batch(q, qd);
  one.tau = tau;
  const std::vector<double> alone = accelerations(one);
  std::array<std::vector<double>, 4> together;
  at_once(together.size(), [&](std::size_t thread) {
    NoProgress none;
    std::vector<double> scratch(forward_->scratch_size());
    DynamicsBatch b = one;
    b.scratch = scratch;
    together[thread].resize(dof());
    EXPECT_TRUE(forward_->accelerations(b, together[thread], none).ok());
  });
  for (const auto& qdd : together) EXPECT_EQ(qdd, alone);
}

TEST_P(DynamicsConformance, NothingIsAllocatedForASample) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  constexpr std::size_t kCount = 20;
  std::vector<double> q, qd = random_.vector(kCount * dof(), -2, 2),
                         qdd = random_.vector(kCount * dof(), -5, 5);
  for (std::size_t i = 0; i < kCount; ++i)
    for (const double x : random_.configuration(model())) q.push_back(x);
  const std::vector<TipWrench> tip{{{3, -4, 5}, {0.3, 0.2, -0.1}}};
  DynamicsBatch b = batch(q, qd, qdd, kAllTerms, tip);
  std::vector<double> tau(kCount * dof()), m(kCount * dof() * dof());
  for (const bool is_first : {true, false}) {  // threads and tables are made once
    const long long torques = allocations_in([&] { (void)inverse_->torques(b, tau, none_); });
    const long long inertia = allocations_in([&] { (void)inverse_->inertia(b, m, none_); });
    long long accelerations = 0;
    if (forward_) {
      DynamicsBatch f = b;
      f.tau = tau, f.qdd = {};
      std::vector<double> out(kCount * dof());
      accelerations = allocations_in([&] { (void)forward_->accelerations(f, out, none_); });
    }
    if (is_first) continue;
    EXPECT_EQ(torques, 0) << "by torques of " << kCount << " samples";
    EXPECT_EQ(inertia, 0) << "by inertia of " << kCount << " samples";
    EXPECT_EQ(accelerations, 0) << "by accelerations of " << kCount << " samples";
  }
}

TEST_P(DynamicsConformance, TermsAddUpToTheWhole) {
  for (int i = 0; i < 20; ++i) {
    const auto q = random_.configuration(model()), qd = random_.vector(dof(), -2, 2),
               qdd = random_.vector(dof(), -5, 5);
    const std::vector<TipWrench> tip{{{3, -4, 5}, {0.3, 0.2, -0.1}}};
    DynamicsBatch b = batch(q, qd, qdd, kAllTerms, tip);
    const BaseMotion base{{1, -2, -9}, {0.5, 1, -2}, {0.4, -0.7, 0.9}, {-1, 2, 0.5}};
    if (i % 2) b.base = std::span(&base, 1);
    b.tip_index = static_cast<std::int32_t>(i / 2 % static_cast<int>(model().tips.size()));
    const auto whole = torques(b);
    std::vector<double> sum(dof());
    double size = 0;
    for (const std::uint32_t term :
         {kGravityTerm, kInertialTerm, kVelocityTerm, kFrictionTerm, kExternalTerm, kSpringTerm}) {
      b.terms = term;
      const auto part = torques(b);
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
      EXPECT_NEAR(g[j], expected[j], 1e-8 * (1 + std::fabs(expected[j]))) << "entry " << j + 1;
  }
}

TEST_P(DynamicsConformance, SpringTorqueIsTheGradientOfTheSpringsEnergy) {
  const auto q = random_.configuration(model());
  const auto s = torques(q, {}, {}, kSpringTerm), expected = gradient(model(), q, spring_energy);
  for (std::size_t j = 0; j < dof(); ++j)
    EXPECT_NEAR(s[j], expected[j], 1e-9 * (1 + std::fabs(expected[j]))) << "entry " << j + 1;
}

TEST_P(DynamicsConformance, InertiaIsSymmetricPositiveAndGivesTheKineticEnergy) {
  const std::size_t n = dof();
  for (int i = 0; i < 10; ++i) {
    const auto q = random_.configuration(model()), qd = random_.vector(n, -1, 1);
    const auto m = inertia(q);
    double energy = 0;
    for (std::size_t r = 0; r < n; ++r)
      for (std::size_t c = 0; c < n; ++c) {
        EXPECT_NEAR(m[r * n + c], m[c * n + r], 1e-13 * (1 + std::fabs(m[r * n + c])));
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
      EXPECT_NEAR(tau[j], m[j * n + k], 1e-12 * (1 + std::fabs(m[j * n + k])))
          << j + 1 << ", " << k + 1;
  }
}

TEST_P(DynamicsConformance, TorquesSatisfyKanesEquations) {
  const BaseMotion base{{1, -2, -9}, {0.5, 1, -2}, {0.4, -0.7, 0.9}, {-1, 2, 0.5}};
  for (const BaseMotion* moving : {static_cast<const BaseMotion*>(nullptr), &base}) {
    const auto q = random_.configuration(model()), qd = rates(1), qdd = rates(2);
    DynamicsBatch b = batch(q, qd, qdd, kGravityTerm | kInertialTerm | kVelocityTerm);
    if (moving) b.base = std::span(moving, 1);
    const auto tau = torques(b), expected = kane_torques(model(), q, qd, qdd, moving);
    double size = 1;
    for (const double x : expected) size = std::max(size, std::fabs(x));
    for (std::size_t j = 0; j < dof(); ++j)
      EXPECT_NEAR(tau[j], expected[j], 1e-7 * size) << "entry " << j + 1;
  }
}

TEST_P(DynamicsConformance, TorquesSatisfyLagrangesEquation) {
  if (!model().is_simple()) GTEST_SKIP() << "its velocities are no derivatives of coordinates";
  if (dof() > 20) GTEST_SKIP() << "differences of long chains take long";
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
  // Any curve with these velocities and accelerations has the same rate.
  const double rate = difference(
      [&](double t) {
        std::vector<double> v = qd;
        for (std::size_t k = 0; k < n; ++k) v[k] += t * qdd[k];
        const auto x = advanced(model(), q.data(), qd.data(), t);
        return kinetic_energy(model(), x, v) + potential_energy(model(), x);
      },
      1e-3);
  EXPECT_NEAR(power, rate, 1e-7 * (1 + std::fabs(power)));
}

TEST_P(DynamicsConformance, AWrenchAtEveryTipIsBalancedByVirtualWork) {
  const auto q = random_.configuration(model());
  const std::vector<TipWrench> w{{{3, -4, 5}, {0.3, 0.2, -0.1}}};
  for (std::size_t tip = 0; tip < model().tips.size(); ++tip) {
    DynamicsBatch batch_at_tip = batch(q, {}, {}, kExternalTerm, w);
    batch_at_tip.tip_index = static_cast<std::int32_t>(tip);
    const auto tau = torques(batch_at_tip);
    const Pose now = tip_pose(model(), q.data(), tip);
    for (std::size_t j = 0; j < dof(); ++j) {
      const double work = difference(
          [&](double h) {
            const Pose a = tip_pose(model(), nudged(model(), q, j, h).data(), tip);
            double D[9] = {};  // small rotation from now to a, read from its skew part
            for (std::size_t r = 0; r < 3; ++r)
              for (std::size_t c = 0; c < 3; ++c)
                for (std::size_t k = 0; k < 3; ++k)
                  D[3 * r + c] += a.R[3 * r + k] * now.R[3 * c + k];
            const Vec3 turn{(D[7] - D[5]) / 2, (D[2] - D[6]) / 2, (D[3] - D[1]) / 2};
            return dotted(w[0].force, a.p) + dotted(w[0].moment, turn);
          },
          1e-3);
      EXPECT_NEAR(tau[j], -work, 1e-8 * (1 + std::fabs(work)))
          << "tip " << tip + 1 << ", entry " << j + 1;
    }
  }
}

TEST_P(DynamicsConformance, ForwardUndoesInverseForManySamplesAtOnce) {
  if (!forward_) GTEST_SKIP() << "it has no forward dynamics";
  constexpr std::size_t kCount = 50;
  std::vector<double> q, qd = random_.vector(kCount * dof(), -2, 2),
                         qdd = random_.vector(kCount * dof(), -5, 5);
  for (std::size_t i = 0; i < kCount; ++i)
    for (const double x : random_.configuration(model())) q.push_back(x);
  const std::vector<TipWrench> tip{{{1, 2, -3}, {0.1, 0, 0.2}}};
  const BaseMotion base{{1, -2, -9}, {0.5, 1, -2}, {0.4, -0.7, 0.9}, {-1, 2, 0.5}};
  for (std::size_t at = 0; at < model().tips.size(); ++at) {
    DynamicsBatch b = batch(q, qd, qdd, kAllTerms, tip);
    b.tip_index = static_cast<std::int32_t>(at);
    if (at == 0) b.base = std::span(&base, 1);
    const auto tau = torques(b);
    b.qdd = {};
    b.tau = tau;
    const auto back = accelerations(b);
    // What is lost grows with the chain: the inertia of its base against that of its tip.
    const double tolerance = dof() > 20 ? 1e-5 : 1e-8;
    for (std::size_t i = 0; i < back.size(); ++i)
      EXPECT_NEAR(back[i], qdd[i], tolerance) << "value " << i;
  }
}

TEST_P(DynamicsConformance, ForwardLeavesOutTheTermsThatAreNotAsked) {
  if (!forward_) GTEST_SKIP() << "it has no forward dynamics";
  const auto q = random_.configuration(model()), qd = rates(1), qdd = rates(2);
  for (const std::uint32_t terms : {kGravityTerm | kInertialTerm, kVelocityTerm | kInertialTerm,
                                    kFrictionTerm | kInertialTerm, kSpringTerm | kInertialTerm}) {
    DynamicsBatch b = batch(q, qd, qdd, terms);
    const auto tau = torques(b);
    b.tau = tau;
    b.terms = terms & ~static_cast<std::uint32_t>(kInertialTerm);
    const auto back = accelerations(b);
    for (std::size_t i = 0; i < back.size(); ++i)
      EXPECT_NEAR(back[i], qdd[i], dof() > 20 ? 1e-5 : 1e-8) << "value " << i;
  }
}

TEST_P(DynamicsConformance, FrictionOpposesMotionAndIsZeroAtRest) {
  const auto q = random_.configuration(model());
  // Up to 1e-9 the sign is rounding.
  for (const double speed : {0.5, -0.5, 0.0, 1e-30, -1e-30, 1e-12, -1e-12, 1e-6, -1e-6}) {
    const std::vector<double> qd(dof(), speed);
    const auto f = torques(q, qd, {}, kFrictionTerm);
    std::vector<double> expected(dof());
    for (const JointModel& j : model().joints)
      for (std::int32_t k = 0; k < robomosp::velocity_count(j.type); ++k) {
        const double ratio = j.is_coupled() ? j.coupling.ratio : 1, rate = ratio * speed;
        const JointFriction& t = j.friction;
        expected[static_cast<std::size_t>(j.v_index + k)] +=
            ratio * (t.viscous * rate + (rate > 1e-9    ? t.coulomb_positive
                                         : rate < -1e-9 ? t.coulomb_negative
                                                        : 0));
      }
    for (std::size_t k = 0; k < dof(); ++k)
      EXPECT_NEAR(f[k], expected[k], 1e-15 * (1 + std::fabs(expected[k]))) << "entry " << k + 1;
  }
}

TEST_P(DynamicsConformance, WrongSizesAreRefusedAndCancelIsHeard) {
  const auto q = random_.configuration(model());
  std::vector<double> tau(dof()), small(1);
  DynamicsBatch b = batch(q);
  NoProgress& none = none_;
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
  if (forward_) {
    EXPECT_FALSE(forward_->accelerations(b, tau, none).ok()) << "scratch of one double";
  }
}

TEST_P(DynamicsConformance, AMasslessLastBodyIsRefusedByNameInForwardDynamics) {
  if (!forward_) GTEST_SKIP() << "it has no forward dynamics";
  RobotModel broken = model();
  broken.joints.back().body = {};
  broken.joints.back().armature = 0;
  broken.joints.back().name = "the light one";
  TableParams params(**find_provider<ForwardDynamics>(GetParam().file, GetParam().forward));
  if (broken.joints.back().is_coupled()) GTEST_SKIP() << "another joint moves the last body";
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

#include <robomosp/sdk/conformance/dynamics_suite_linear.h>
