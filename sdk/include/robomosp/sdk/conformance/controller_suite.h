// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.controller/1 (layer: contract helper for tests, GoogleTest,
// header-only). The closed loop is integrated here, with accelerations from the inertia matrix of
// the inverse dynamics by elimination. Include it in one file of a test program and instantiate
// ControllerConformance with controller_cases(...).
#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/allocations.h>
#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/controller.h>

namespace robomosp::conformance {

struct ControllerCase {
  std::string file, provider;                    ///< of the controller
  std::string dynamics_file, dynamics_provider;  ///< of the inverse dynamics that it asks
  RobotModel model;
  std::vector<std::pair<std::string, std::string>> params;
  bool compensates_weight = true;  ///< holds the reference exactly from the first tick
  double settles_to = 1e-4;        ///< greatest error left after 3 s at rest [rad, m]
};
inline void PrintTo(const ControllerCase& c, std::ostream* os) {
  *os << c.provider << " on " << c.model.name;
}
inline std::string controller_case_name(const testing::TestParamInfo<ControllerCase>& info) {
  std::string s = info.param.provider + "_" + info.param.model.name;
  for (char& c : s)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return s;
}

/// A mechanism driven by torques that are held from tick to tick.
class Loop {
 public:
  Loop(const RobotModel& model, const InverseDynamics& dynamics)
      : model_(model), dynamics_(dynamics), scratch_(dynamics.scratch_size()) {}

  /// qdd from M qdd = tau - h, by elimination with pivoting.
  std::vector<double> accelerations(const std::vector<double>& q, const std::vector<double>& qd,
                                    const std::vector<double>& tau,
                                    std::uint32_t terms = kAllTerms) {
    const std::size_t n = model_.dof();
    std::vector<double> m(n * n), x(n);
    DynamicsBatch b;
    b.count = 1, b.q = q, b.qd = qd, b.scratch = scratch_;
    b.terms = terms & ~static_cast<std::uint32_t>(kInertialTerm);
    NoProgress none;
    EXPECT_TRUE(dynamics_.torques(b, x, none).ok());
    EXPECT_TRUE(dynamics_.inertia(b, m, none).ok());
    for (std::size_t i = 0; i < n; ++i) x[i] = tau[i] - x[i];
    for (std::size_t k = 0; k < n; ++k) {
      std::size_t p = k;
      for (std::size_t i = k + 1; i < n; ++i)
        if (std::fabs(m[i * n + k]) > std::fabs(m[p * n + k])) p = i;
      for (std::size_t j = 0; j < n; ++j) std::swap(m[k * n + j], m[p * n + j]);
      std::swap(x[k], x[p]);
      for (std::size_t i = k + 1; i < n; ++i) {
        const double f = m[i * n + k] / m[k * n + k];
        for (std::size_t j = k; j < n; ++j) m[i * n + j] -= f * m[k * n + j];
        x[i] -= f * x[k];
      }
    }
    for (std::size_t k = n; k-- > 0;) {
      for (std::size_t j = k + 1; j < n; ++j) x[k] -= m[k * n + j] * x[j];
      x[k] /= m[k * n + k];
    }
    return x;
  }
  /// One step of the classical Runge-Kutta method.
  void step(std::vector<double>& q, std::vector<double>& qd, const std::vector<double>& tau,
            double h) {
    const auto ahead = [](const std::vector<double>& v, const std::vector<double>& d, double s) {
      std::vector<double> out = v;
      for (std::size_t i = 0; i < v.size(); ++i) out[i] += s * d[i];
      return out;
    };
    const auto a1 = accelerations(q, qd, tau);
    const auto v2 = ahead(qd, a1, h / 2);
    const auto a2 = accelerations(ahead(q, qd, h / 2), v2, tau);
    const auto v3 = ahead(qd, a2, h / 2);
    const auto a3 = accelerations(ahead(q, v2, h / 2), v3, tau);
    const auto v4 = ahead(qd, a3, h);
    const auto a4 = accelerations(ahead(q, v3, h), v4, tau);
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i] += h / 6 * (qd[i] + 2 * v2[i] + 2 * v3[i] + v4[i]);
      qd[i] += h / 6 * (a1[i] + 2 * a2[i] + 2 * a3[i] + a4[i]);
    }
  }

 private:
  const RobotModel& model_;
  const InverseDynamics& dynamics_;
  std::vector<double> scratch_;
};

/// The same mechanism without friction, limits of force and joint limits.
[[nodiscard]] inline RobotModel without_friction(RobotModel m) {
  for (JointModel& j : m.joints) {
    j.friction = {};
    j.max_force = std::numeric_limits<double>::infinity();
  }
  return m;
}

class ControllerConformance : public testing::TestWithParam<ControllerCase> {
 protected:
  void SetUp() override {
    model_ = GetParam().model;
    ASSERT_TRUE(model_.is_simple()) << "the suite's closed loop knows joints of one coordinate";
    auto dynamics =
        find_provider<InverseDynamics>(GetParam().dynamics_file, GetParam().dynamics_provider);
    ASSERT_TRUE(dynamics.ok()) << dynamics.error().sentence();
    dynamics_ = conformance::create<InverseDynamics>(**dynamics);
    const auto bound = dynamics_->prepare(model_, TableParams(**dynamics));
    ASSERT_TRUE(bound.ok()) << bound.error().sentence();
    controller_ = make();
    n_ = model_.dof();
    state_.assign(controller_->state_size(), 0.0);
    zero_.assign(n_, 0.0);
  }
  std::unique_ptr<Controller> make() {
    auto found = find_provider<Controller>(GetParam().file, GetParam().provider);
    EXPECT_TRUE(found.ok()) << (found.ok() ? "" : found.error().sentence());
    auto made = conformance::create<Controller>(**found);
    TableParams params(**found);
    for (const auto& [name, text] : GetParam().params) params.set(name, text);
    const auto ready = made->prepare(model_, *dynamics_, params);
    EXPECT_TRUE(ready.ok()) << (ready.ok() ? "" : ready.error().sentence());
    return made;
  }
  ControlInput input(const std::vector<double>& q, const std::vector<double>& qd,
                     const std::vector<double>& q_desired) const {
    ControlInput in;
    in.dt = 1e-3;
    in.q = q, in.qd = qd, in.q_desired = q_desired;
    in.qd_desired = zero_, in.qdd_desired = zero_;
    return in;
  }
  std::vector<double> torques(const ControlInput& in, std::vector<double>& state) {
    std::vector<double> scratch(controller_->scratch_size()), tau(n_, std::nan(""));
    const auto r = controller_->torques(in, state, scratch, tau);
    EXPECT_TRUE(r.ok()) << (r.ok() ? "" : r.error().sentence());
    return tau;
  }
  /// A configuration well inside the limits.
  std::vector<double> somewhere() {
    auto q = random_.configuration(model_);
    for (std::size_t j = 0; j < n_; ++j) {
      const JointModel& joint = model_.joints[j];
      if (std::isfinite(joint.lower) && std::isfinite(joint.upper))
        q[j] = 0.5 * (joint.lower + joint.upper) + 0.3 * (q[j] - 0.5 * (joint.lower + joint.upper));
    }
    return q;
  }

  RobotModel model_;
  Random random_{271828};
  std::unique_ptr<InverseDynamics> dynamics_;
  std::unique_ptr<Controller> controller_;
  std::size_t n_ = 0;
  std::vector<double> state_, zero_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(ControllerConformance);

TEST_P(ControllerConformance, AnErrorVanishesInTheClosedLoop) {
  const auto wanted = somewhere();
  std::vector<double> q = wanted, qd = zero_;
  for (std::size_t j = 0; j < n_; ++j) q[j] += j % 2 ? -0.05 : 0.05;
  Loop loop(model_, *dynamics_);
  const double h = 1e-3;
  for (int tick = 0; tick < 3000; ++tick) {
    ControlInput in = input(q, qd, wanted);
    in.time = tick * h, in.dt = tick ? h : 0;
    loop.step(q, qd, torques(in, state_), h);
    ASSERT_TRUE(std::isfinite(q[0])) << "at tick " << tick;
  }
  for (std::size_t j = 0; j < n_; ++j) {
    EXPECT_NEAR(q[j], wanted[j], GetParam().settles_to) << "joint " << j + 1;
    EXPECT_NEAR(qd[j], 0, 50 * GetParam().settles_to) << "joint " << j + 1;
  }
}

TEST_P(ControllerConformance, AtTheReferenceItHoldsTheWeight) {
  if (!GetParam().compensates_weight) GTEST_SKIP() << "it knows no weight";
  const auto q = somewhere();
  const auto tau = torques(input(q, zero_, q), state_);
  std::vector<double> expected(n_), scratch(dynamics_->scratch_size());
  DynamicsBatch b;
  b.count = 1, b.q = q, b.scratch = scratch, b.terms = kGravityTerm | kSpringTerm;
  NoProgress none;
  ASSERT_TRUE(dynamics_->torques(b, expected, none).ok());
  for (std::size_t j = 0; j < n_; ++j)
    EXPECT_NEAR(tau[j], expected[j], 1e-9 * (1 + std::fabs(expected[j]))) << "joint " << j + 1;
}

TEST_P(ControllerConformance, AllItKeepsIsInTheMemoryOfTheRun) {
  const auto wanted = somewhere(), q = somewhere(), other = somewhere();
  std::vector<double> a(controller_->state_size()), b = a, c = a;
  std::vector<double> alone, between;
  for (int i = 0; i < 5; ++i) alone = torques(input(q, zero_, wanted), a);
  for (int i = 0; i < 5; ++i) {
    between = torques(input(q, zero_, wanted), b);
    torques(input(other, wanted, q), c);
  }
  EXPECT_EQ(alone, between);
  EXPECT_EQ(a, b);
}

TEST_P(ControllerConformance, ItStaysWithinItsScratch) {
  const auto q = somewhere(), wanted = somewhere();
  const std::size_t size = controller_->scratch_size(), more = 64;
  std::vector<double> scratch(size + more, 12345.0), tau(n_ + more, 12345.0),
      state(controller_->state_size() + more, 0.0);
  std::fill(state.end() - static_cast<std::ptrdiff_t>(more), state.end(), 12345.0);
  ASSERT_TRUE(controller_
                  ->torques(input(q, zero_, wanted),
                            std::span<double>(state).first(controller_->state_size()),
                            std::span<double>(scratch).first(size),
                            std::span<double>(tau).first(n_))
                  .ok());
  for (std::size_t i = 0; i < more; ++i) {
    EXPECT_EQ(scratch[size + i], 12345.0);
    EXPECT_EQ(tau[n_ + i], 12345.0);
    EXPECT_EQ(state[controller_->state_size() + i], 12345.0);
  }
}

TEST_P(ControllerConformance, SeveralThreadsGetTheSameTorquesAtOnce) {
  const auto q = somewhere(), wanted = somewhere();
  const auto run = [&](std::vector<double>& tau) {
    std::vector<double> state(controller_->state_size()), scratch(controller_->scratch_size());
    tau.resize(n_);
    for (int i = 0; i < 50; ++i) {
      EXPECT_TRUE(controller_->torques(input(q, zero_, wanted), state, scratch, tau).ok());
    }
  };
  std::vector<double> alone;
  run(alone);
  std::array<std::vector<double>, 4> together;
  at_once(together.size(), [&](std::size_t thread) { run(together[thread]); });
  for (const auto& tau : together) EXPECT_EQ(tau, alone);
}

TEST_P(ControllerConformance, NothingIsAllocatedForATick) {
  RMP_NEEDS_ALLOCATION_COUNTS();
  const auto q = somewhere(), wanted = somewhere();
  std::vector<double> scratch(controller_->scratch_size()), tau(n_);
  const ControlInput in = input(q, zero_, wanted);
  ASSERT_TRUE(controller_->torques(in, state_, scratch, tau).ok());
  EXPECT_EQ(allocations_in([&] {
              for (int i = 0; i < 10; ++i) (void)controller_->torques(in, state_, scratch, tau);
            }),
            0);
}

TEST_P(ControllerConformance, PassiveJointsGetNoTorque) {
  model_.joints.back().passive = true;
  controller_ = make();
  const auto tau = torques(input(somewhere(), zero_, somewhere()), state_);
  EXPECT_EQ(tau.back(), 0);
}

TEST_P(ControllerConformance, WrongSizesAreRefused) {
  const auto q = somewhere();
  std::vector<double> scratch(controller_->scratch_size()), tau(n_),
      state(controller_->state_size());
  ASSERT_TRUE(controller_->torques(input(q, zero_, q), state, scratch, tau).ok());
  const std::vector<double> shorter(q.begin(), q.end() - 1);
  EXPECT_FALSE(controller_->torques(input(shorter, zero_, q), state, scratch, tau).ok());
  EXPECT_FALSE(controller_->torques(input(q, zero_, shorter), state, scratch, tau).ok());
  EXPECT_FALSE(
      controller_->torques(input(q, zero_, q), state, scratch, std::span<double>(tau).first(n_ - 1))
          .ok());
  if (!scratch.empty()) {
    EXPECT_FALSE(controller_
                     ->torques(input(q, zero_, q), state,
                               std::span<double>(scratch).first(scratch.size() - 1), tau)
                     .ok());
  }
  if (!state.empty()) {
    EXPECT_FALSE(controller_
                     ->torques(input(q, zero_, q), std::span<double>(state).first(state.size() - 1),
                               scratch, tau)
                     .ok());
  }
}

}  // namespace robomosp::conformance
