// SPDX-License-Identifier: Apache-2.0
// Conformance suite of robomosp.retimer/1 (layer: contract helper for tests, GoogleTest,
// header-only): optima known in closed form, limits kept everywhere. Include it in one file of a
// test program and instantiate RetimerConformance with RetimerCase values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/conformance/threads.h>
#include <robomosp/sdk/retimer.h>

namespace robomosp::conformance {

struct RetimerCase {
  std::string file, provider;
  bool has_torques = true;  ///< it keeps torque limits
};
inline void PrintTo(const RetimerCase& c, std::ostream* os) { *os << c.provider; }

/// A joint path on a grid, with memory for its tables.
struct RetimePath {
  std::size_t dof = 1;
  std::vector<double> s, q, q1, q2, velocity, acceleration, torque_a, torque_b, torque_c, torque;
  double start_rate = 0, end_rate = 0;

  template <class Fn>  // fn(s, q, q1, q2) fills one row
  RetimePath(std::size_t joints, double end, std::size_t steps, Fn&& fn) : dof(joints) {
    for (std::size_t i = 0; i <= steps; ++i) {
      s.push_back(end * static_cast<double>(i) / static_cast<double>(steps));
      for (auto* table : {&q, &q1, &q2}) table->resize(table->size() + dof);
      fn(s.back(), q.data() + i * dof, q1.data() + i * dof, q2.data() + i * dof);
    }
    velocity.assign(dof, std::numeric_limits<double>::infinity());
    acceleration = velocity;
  }
  [[nodiscard]] RetimeProblem problem() const {
    RetimeProblem p;
    p.dof = dof;
    p.s = s, p.q = q, p.q1 = q1, p.q2 = q2;
    p.velocity = velocity, p.acceleration = acceleration;
    p.torque_a = torque_a, p.torque_b = torque_b, p.torque_c = torque_c, p.torque = torque;
    p.start_rate = start_rate, p.end_rate = end_rate;
    return p;
  }
};

class RetimerConformance : public testing::TestWithParam<RetimerCase> {
 protected:
  void SetUp() override {
    auto found = find_provider<Retimer>(GetParam().file, GetParam().provider);
    ASSERT_TRUE(found.ok()) << found.error().sentence();
    retimer_ = create<Retimer>(**found);
    params_ = TableParams(**found);
  }
  Result<Retiming> retime(const RetimePath& path) {
    NoProgress none;
    return retimer_->retime(path.problem(), params_, none);
  }
  /// Velocities and accelerations at both ends of every step stay within the limits.
  static void expect_within(const RetimePath& p, const Retiming& r, double slack = 1e-6) {
    for (std::size_t i = 0; i + 1 < p.s.size(); ++i) {
      const double h = p.s[i + 1] - p.s[i],
                   u = (r.rate[i + 1] * r.rate[i + 1] - r.rate[i] * r.rate[i]) / (2 * h);
      for (const std::size_t k : {i, i + 1})
        for (std::size_t j = 0; j < p.dof; ++j) {
          const double x = r.rate[k] * r.rate[k], q1 = p.q1[k * p.dof + j];
          EXPECT_LE(std::fabs(q1 * r.rate[k]), p.velocity[j] * (1 + slack)) << "at " << p.s[k];
          EXPECT_LE(std::fabs(q1 * u + p.q2[k * p.dof + j] * x), p.acceleration[j] * (1 + slack))
              << "joint " << j + 1 << " at " << p.s[k];
          if (p.torque_a.empty()) continue;
          EXPECT_LE(std::fabs(p.torque_a[k * p.dof + j] * u + p.torque_b[k * p.dof + j] * x +
                              p.torque_c[k * p.dof + j]),
                    p.torque[j] * (1 + slack))
              << "torque of joint " << j + 1 << " at " << p.s[k];
        }
    }
  }
  std::shared_ptr<Retimer> retimer_;
  TableParams params_;
};
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(RetimerConformance);

// A straight path of length L: bang-bang, T = 2 sqrt(L / A); with a speed limit V < sqrt(L A) a
// trapezoid, T = L / V + V / A (any textbook; e.g. Siciliano et al., Robotics, section 4.2).
TEST_P(RetimerConformance, StraightWaysTakeTheTimeOfTheTrapezoid) {
  const double L = 1.7, A = 2.5;
  RetimePath path(2, L, 200, [](double s, double* q, double* q1, double* q2) {
    q[0] = s, q[1] = -0.25 * s, q1[0] = 1, q1[1] = -0.25, q2[0] = q2[1] = 0;
  });
  path.acceleration = {A, 10};
  auto bang = retime(path);
  ASSERT_TRUE(bang.ok()) << bang.error().sentence();
  EXPECT_NEAR(bang->time.back(), 2 * std::sqrt(L / A), 1e-9);
  expect_within(path, *bang);
  const double V = 0.9;
  path.velocity = {V, 10};
  auto trapezoid = retime(path);
  ASSERT_TRUE(trapezoid.ok()) << trapezoid.error().sentence();
  // The corners of the trapezoid fall between grid points.
  EXPECT_NEAR(trapezoid->time.back(), L / V + V / A, 1e-3 * (L / V + V / A));
  EXPECT_GE(trapezoid->time.back(), L / V + V / A - 1e-9);
  expect_within(path, *trapezoid);
  // With speeds at the ends: from v0 to v1 by full acceleration and braking.
  path.velocity = {10, 10};
  path.start_rate = 0.5, path.end_rate = 0.8;
  auto moving = retime(path);
  ASSERT_TRUE(moving.ok()) << moving.error().sentence();
  const double top = std::sqrt(A * L + (0.25 + 0.64) / 2);
  EXPECT_NEAR(moving->time.back(), (2 * top - 1.3) / A, 1e-3);
  EXPECT_NEAR(moving->rate.front(), 0.5, 1e-9);
  EXPECT_NEAR(moving->rate.back(), 0.8, 1e-9);
}

// Two joints that run a circle of radius r: with |qdd| <= A each, the steady rate is where the
// centripetal acceleration of the joint on the diameter reaches A: s' = sqrt(A / r) in radians.
TEST_P(RetimerConformance, CirclesAreRunAtTheSpeedOfTheirCurvature) {
  const double r = 0.3, A = 4;
  RetimePath path(2, 6 * std::acos(-1.0), 1500, [r](double s, double* q, double* q1, double* q2) {
    q[0] = r * std::cos(s), q[1] = r * std::sin(s);
    q1[0] = -r * std::sin(s), q1[1] = r * std::cos(s);
    q2[0] = -r * std::cos(s), q2[1] = -r * std::sin(s);
  });
  path.acceleration = {A, A};
  auto run = retime(path);
  ASSERT_TRUE(run.ok()) << run.error().sentence();
  expect_within(path, *run, 1e-5);
  double fastest = 0;
  for (std::size_t i = 0; i < path.s.size(); ++i) fastest = std::max(fastest, run->rate[i]);
  EXPECT_LE(fastest, std::pow(2.0, 0.25) * std::sqrt(A / r) * (1 + 1e-6));
  EXPECT_GE(fastest, std::sqrt(A / r) * 0.99);
}

// Finer grids do not change what is found by more than their own step.
TEST_P(RetimerConformance, GridsAgree) {
  std::vector<double> times;
  for (const std::size_t steps : {100U, 1000U, 4000U}) {
    RetimePath path(3, 2, steps, [](double s, double* q, double* q1, double* q2) {
      for (int j = 0; j < 3; ++j) {
        const double w = 1.3 + j, a = 0.7 - 0.2 * j;
        q[j] = a * std::sin(w * s), q1[j] = a * w * std::cos(w * s),
        q2[j] = -a * w * w * std::sin(w * s);
      }
    });
    path.velocity = {1.2, 1.5, 1};
    path.acceleration = {3, 2, 4};
    auto run = retime(path);
    ASSERT_TRUE(run.ok()) << run.error().sentence();
    expect_within(path, *run, 1e-5);
    times.push_back(run->time.back());
  }
  EXPECT_NEAR(times[0], times[2], 0.02 * times[2]);
  EXPECT_NEAR(times[1], times[2], 0.002 * times[2]);
}

// A mass m on a vertical slide with |f| <= F: up with (F - m g) / m, braking with gravity's help.
TEST_P(RetimerConformance, TorqueLimitsAndGravity) {
  if (!GetParam().has_torques) GTEST_SKIP();
  const double m = 2, g = 9.81, F = 30, L = 0.8;
  RetimePath path(1, L, 400, [](double s, double* q, double* q1, double* q2) {
    q[0] = s, q1[0] = 1, q2[0] = 0;
  });
  path.torque_a.assign(path.s.size(), m);
  path.torque_b.assign(path.s.size(), 0);
  path.torque_c.assign(path.s.size(), m * g);
  path.torque = {F};
  auto run = retime(path);
  ASSERT_TRUE(run.ok()) << run.error().sentence();
  const double up = (F - m * g) / m, down = (F + m * g) / m;
  const double top = std::sqrt(2 * L * up * down / (up + down));
  EXPECT_NEAR(run->time.back(), top / up + top / down, 1e-3 * run->time.back());
  expect_within(path, *run);
  path.torque = {15};  // less than m g
  const auto stuck = retime(path);
  ASSERT_FALSE(stuck.ok());
  EXPECT_NE(stuck.error().sentence().find("joint 1"), std::string::npos)
      << stuck.error().sentence();
}

TEST_P(RetimerConformance, SeveralThreadsGetTheSameTimesAtOnce) {
  RetimePath path(2, 1.7, 200, [](double s, double* q, double* q1, double* q2) {
    q[0] = s, q[1] = -0.25 * s * s, q1[0] = 1, q1[1] = -0.5 * s, q2[0] = 0, q2[1] = -0.5;
  });
  path.acceleration = {2.5, 10};
  const auto alone = retime(path);
  ASSERT_TRUE(alone.ok()) << alone.error().sentence();
  std::array<std::vector<double>, 4> together;
  at_once(together.size(), [&](std::size_t thread) {
    const auto timed = retime(path);
    EXPECT_TRUE(timed.ok());
    if (timed.ok()) together[thread] = timed->time;
  });
  for (const auto& time : together) EXPECT_EQ(time, alone->time);
}

TEST_P(RetimerConformance, BrokenInputIsRefusedInASentence) {
  const auto line = [](double s, double* q, double* q1, double* q2) {
    q[0] = s, q1[0] = 1, q2[0] = 0;
  };
  const RetimePath good(1, 1, 10, line);
  const auto refused = [&](const RetimePath& p) {
    const auto r = retime(p);
    return !r.ok() && !r.error().sentence().empty();
  };
  RetimePath p = good;
  p.s[5] = p.s[4];
  EXPECT_TRUE(refused(p)) << "a grid that does not rise";
  p = good;
  p.q1[3] = std::nan("");
  EXPECT_TRUE(refused(p)) << "a path that is not finite";
  p = good;
  p.acceleration[0] = 0;
  EXPECT_TRUE(refused(p)) << "a limit of 0";
  p = good;
  p.acceleration[0] = 1, p.start_rate = 100;
  EXPECT_TRUE(refused(p)) << "too fast at the start to stop at the end";
  p = good;
  p.q2.pop_back();
  EXPECT_TRUE(refused(p)) << "tables of different lengths";
}

}  // namespace robomosp::conformance
