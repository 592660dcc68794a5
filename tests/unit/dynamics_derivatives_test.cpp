// SPDX-License-Identifier: Apache-2.0
// Derivatives of dynamics against exact ones in longer numbers, against a slower way to compute
// them, and against what they must fulfil; for all joint types, trees and instruction sets, alone
// and in batches.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/all_models.h>
#include <robomosp/sdk/conformance/provider.h>
#include <robomosp/sdk/dynamics.h>

#include "support/exact_dynamics.h"
#include "support/pairwise_derivatives.h"
#include "support/seed.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using conformance::Random;
using conformance::TableParams;

const char* const kSets[] = {"baseline", "avx2", "avx512"};

template <class Interface>
std::shared_ptr<Interface> solver(const char* plugin, const char* name, const RobotModel& m,
                                  const char* set) {
  const auto found =
      conformance::find_provider<Interface>(std::string(ROBOMOSP_PLUGIN_DIR) + plugin, name);
  EXPECT_TRUE(found.ok());
  TableParams params(**found);
  params.set("instructions", std::string(set));
  std::shared_ptr<Interface> made = conformance::create<Interface>(**found);
  const auto ready = made->prepare(m, params);
  EXPECT_TRUE(ready.ok()) << ready.error().sentence();
  return ready.ok() ? made : nullptr;
}

/// Joints of all types, one on any of the earlier ones or one behind the other.
RobotModel random_tree(std::size_t n, bool is_chain, Random& random) {
  RobotModel m;
  m.name = (is_chain ? "chain of " : "tree of ") + std::to_string(n);
  m.gravity = {1, -2, -9};
  for (std::size_t i = 0; i < n; ++i) {
    JointModel j;
    j.name = "j" + std::to_string(i);
    const double before = static_cast<double>(i);
    j.parent =
        static_cast<std::int32_t>(is_chain ? before - 1 : std::floor(random.uniform(-1, before)));
    const double kind = random.uniform(0, 10);
    j.type = kind < 5   ? JointType::revolute
             : kind < 7 ? JointType::prismatic
             : kind < 9 ? JointType::spherical
                        : JointType::free;
    const auto x = random.vector(10, -1, 1);
    j.placement = conformance::multiply(
        conformance::shift(0.3 * x[0], 0.2 * x[1], 0.3 * x[2]),
        conformance::multiply(conformance::turn_x(i % 3 ? 3 * x[3] : conformance::kPi / 2),
                              conformance::turn_y(i % 2 ? 2 * x[4] : 0.0)));
    j.body = conformance::body(1.5 + x[5], 0.2 * x[6], 0.2 * x[7], 0.2 * x[8], 0.02, 0.03, 0.025,
                               0.002, -0.001, 0.003);
    j.friction.viscous = 0.3;
    if (coordinate_count(j.type) == 1) j.armature = 0.1, j.spring = {7, 0.2};
    for (std::size_t k = i; k-- > 0 && !is_chain;)
      if (coordinate_count(j.type) == 1 && x[9] > 0.6 && !m.joints[k].is_coupled() &&
          coordinate_count(m.joints[k].type) == 1) {
        j.coupling = {static_cast<std::int32_t>(k), -0.7, 0.1};
        break;
      }
    m.joints.push_back(j);
  }
  m.number_coordinates();
  const auto tool =
      conformance::multiply(conformance::shift(0.1, 0.2, -0.1), conformance::turn_x(0.3));
  m.tips = {{"last", static_cast<std::int32_t>(n) - 1, tool},
            {"middle", static_cast<std::int32_t>(n / 2), tool},
            {"base", -1, tool}};
  return m;
}

std::vector<RobotModel> models(Random& random) {
  std::vector<RobotModel> all;
  for (const auto& named : conformance::named_models()) {
    all.push_back(named.make());
    all.back().loops.clear();
  }
  for (const std::size_t n : {1, 2, 3, 5, 8, 13, 21}) {
    all.push_back(random_tree(n, true, random));
    all.push_back(random_tree(n, false, random));
  }
  all.push_back(conformance::long_chain(100));
  // Entries of tau in another order than the joints.
  all.push_back(conformance::panda());
  all.back().name += " backwards";
  for (JointModel& j : all.back().joints) j.v_index = all.back().velocities - 1 - j.v_index;
  return all;
}

double largest(std::span<const double> x) {
  double most = 0;
  for (const double v : x) most = std::max(most, std::fabs(v));
  return most;
}

/// Samples of one robot, with all that acts on it.
struct Samples {
  Samples(const RobotModel& m, std::size_t n, Random& random) : count(n) {
    for (std::size_t i = 0; i < n; ++i) {
      const auto one = random.configuration(m);
      q.insert(q.end(), one.begin(), one.end());
      const auto x = random.vector(18, -2, 2);
      wrenches.push_back({{x[0], x[1], x[2]}, {x[3], x[4], x[5]}});
      bases.push_back({{x[6], x[7], x[8] - 9},
                       {x[9], x[10], x[11]},
                       {x[12], x[13], x[14]},
                       {x[15], x[16], x[17]}});
    }
    qd = random.vector(n * m.dof(), -1, 1), u = random.vector(n * m.dof(), -2, 2);
  }
  DynamicsBatch batch(std::vector<double>& scratch, std::int32_t tip = 0) const {
    DynamicsBatch b;
    b.count = count, b.q = q, b.qd = qd, b.qdd = u, b.tau = u, b.scratch = scratch;
    b.tip = wrenches, b.base = bases, b.tip_index = tip;
    return b;
  }
  std::size_t count;
  std::vector<double> q, qd, u;
  std::vector<TipWrench> wrenches;
  std::vector<BaseMotion> bases;
};

class DynamicsDerivatives : public testing::Test {
 protected:
  Random random_{test::seed()};
  NoProgress none_;
};

TEST_F(DynamicsDerivatives, AreTheExactOnesToElevenDigits) {
  for (const RobotModel& m : models(random_)) {
    const std::size_t n = m.dof(), count = n > 50 ? 2 : 11;
    const Samples s(m, count, random_);
    const auto tip =
        static_cast<std::int32_t>(random_.uniform(0, static_cast<double>(m.tips.size())));
    std::vector<double> exact_q(count * n * n), exact_qd(exact_q.size());
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t k = 0; k < n; ++k)
        for (const bool by_rate : {false, true}) {
          test::ExactState state{s.q.data() + i * m.coordinate_count(), s.qd.data() + i * n,
                                 s.u.data() + i * n, s.bases[i]};
          state.tip = &m.tips[static_cast<std::size_t>(tip)];
          state.wrench = s.wrenches[i];
          state.by_rate = by_rate, state.k = k;
          const auto tau = test::exact_torques(m, state);
          for (std::size_t r = 0; r < n; ++r)
            (by_rate ? exact_qd : exact_q)[(i * n + r) * n + k] = static_cast<double>(tau[r].d);
        }
    for (const char* set : kSets) {
      SCOPED_TRACE(m.name + ", " + set);
      const auto inverse =
          solver<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, set);
      std::vector<double> scratch(inverse->scratch_size());
      for (const std::size_t used : {std::size_t{1}, std::size_t{2}, count}) {
        std::vector<double> by_q(used * n * n, std::nan("")), by_qd = by_q;
        DynamicsBatch b = s.batch(scratch, tip);
        b.count = used;
        b.q = b.q.first(used * m.coordinate_count()), b.qd = b.qd.first(used * n);
        b.qdd = b.qdd.first(used * n), b.tau = {};
        b.tip = b.tip.first(used), b.base = b.base.first(used);
        const auto done = inverse->derivatives(b, by_q, by_qd, none_);
        ASSERT_TRUE(done.ok()) << done.error().sentence();
        for (std::size_t i = 0; i < used; ++i) {
          const auto of = [&](const std::vector<double>& v) {
            return std::span(v).subspan(i * n * n, n * n);
          };
          const double size = 1e-11 * std::max(largest(of(exact_q)), largest(of(exact_qd)));
          for (std::size_t e = 0; e < n * n; ++e) {
            ASSERT_NEAR(of(by_q)[e], of(exact_q)[e], size)
                << "sample " << i << " of " << used << ", " << e / n << " by place " << e % n;
            ASSERT_NEAR(of(by_qd)[e], of(exact_qd)[e], size)
                << "sample " << i << " of " << used << ", " << e / n << " by rate " << e % n;
          }
        }
      }
    }
  }
}

TEST_F(DynamicsDerivatives, AreThoseOfProductsOfEveryPairForAllTerms) {
  for (const RobotModel& m : models(random_)) {
    const std::size_t n = m.dof();
    const auto tree = test::unwrap(spatial::make_body_tree(m));
    const auto inverse =
        solver<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, "auto");
    std::vector<double> scratch(std::max(inverse->scratch_size(), test::pairwise_scratch(tree)));
    for (std::uint32_t terms = 0; terms <= kAllTerms; ++terms) {
      if (n > 30 && terms % 7 != 0) continue;
      SCOPED_TRACE(m.name + ", terms " + std::to_string(terms));
      const Samples s(m, 3, random_);
      DynamicsBatch b = s.batch(scratch);
      b.terms = terms;
      if (terms % 3 == 1) b.base = {};
      std::vector<double> by_q(3 * n * n), by_qd(by_q.size()), slow_q(n * n), slow_qd(n * n);
      const auto done = inverse->derivatives(b, by_q, by_qd, none_);
      ASSERT_TRUE(done.ok()) << done.error().sentence();
      for (std::size_t i = 0; i < 3; ++i) {
        test::pairwise_derivatives(tree, b, i, nullptr, false, scratch.data(), slow_q, slow_qd);
        const double size = 1e-11 * (1e-3 + largest(slow_q) + largest(slow_qd));
        for (std::size_t e = 0; e < n * n; ++e) {
          ASSERT_NEAR(by_q[i * n * n + e], slow_q[e], size) << e / n << " by place " << e % n;
          ASSERT_NEAR(by_qd[i * n * n + e], slow_qd[e], size) << e / n << " by rate " << e % n;
        }
      }
    }
  }
}

/// M times the derivatives of the accelerations are those of the torques that keep them, taken
/// away; and the inverse of M. Holds however badly M is conditioned.
TEST_F(DynamicsDerivatives, OfAccelerationsSolveThoseOfTorques) {
  std::size_t compared = 0;
  for (RobotModel m : models(random_)) {
    if (m.name.ends_with("backwards")) continue;  // no order for the factors of M
    // Models of kinematics have no masses.
    if (std::all_of(m.joints.begin(), m.joints.end(),
                    [](const JointModel& j) { return j.body.mass == 0; }))
      for (JointModel& j : m.joints)
        j.body = conformance::body(2, 0.1, 0.02, -0.05, 0.02, 0.03, 0.025);
    const std::size_t n = m.dof(), count = n > 50 ? 2 : 9;
    const auto tree = test::unwrap(spatial::make_body_tree(m));
    const Samples s(m, count, random_);
    for (const char* set : kSets) {
      SCOPED_TRACE(m.name + ", " + set);
      const auto forward =
          solver<ForwardDynamics>("/dynamics_articulated.so", "articulated_body", m, set);
      const auto inverse =
          solver<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, set);
      ASSERT_TRUE(forward && inverse);
      std::vector<double> scratch(std::max(
          {forward->scratch_size(), inverse->scratch_size(), test::pairwise_scratch(tree)}));
      for (const std::size_t used : {std::size_t{1}, count}) {
        DynamicsBatch b = s.batch(scratch);
        b.count = used;
        b.q = b.q.first(used * m.coordinate_count()), b.qd = b.qd.first(used * n);
        b.tau = b.tau.first(used * n), b.qdd = {};
        b.tip = b.tip.first(used), b.base = b.base.first(used);
        std::vector<double> by_q(used * n * n, std::nan("")),
            by_qd = by_q, by_tau = by_q, M = by_q, qdd(used * n), slow_q(n * n), slow_qd(n * n);
        auto done = forward->derivatives(b, by_q, by_qd, by_tau, none_);
        ASSERT_TRUE(done.ok()) << done.error().sentence();
        ASSERT_TRUE(forward->accelerations(b, qdd, none_).ok());
        ASSERT_TRUE(inverse->inertia(b, M, none_).ok());
        for (std::size_t i = 0; i < used; ++i) {
          test::pairwise_derivatives(tree, b, i, qdd.data() + i * n, true, scratch.data(), slow_q,
                                     slow_qd);
          const auto of = [&](const std::vector<double>& v) {
            return std::span(v).subspan(i * n * n, n * n);
          };
          const double mass = largest(of(M));
          const auto check = [&](std::span<const double> x, const char* what, auto&& right) {
            double size = 0;
            for (std::size_t e = 0; e < n * n; ++e)
              size = std::max(size, std::fabs(right(e / n, e % n)));
            size = 1e-12 * (size + static_cast<double>(n) * mass * largest(x));
            for (std::size_t e = 0; e < n * n; ++e) {
              long double sum = 0;
              for (std::size_t k = 0; k < n; ++k)
                sum += static_cast<long double>(of(M)[e / n * n + k]) * x[k * n + e % n];
              ASSERT_NEAR(static_cast<double>(sum), right(e / n, e % n), size)
                  << "sample " << i << " of " << used << ", " << e / n << what << e % n;
            }
          };
          check(of(by_q), " by place ", [&](auto r, auto c) { return -slow_q[r * n + c]; });
          check(of(by_qd), " by rate ", [&](auto r, auto c) { return -slow_qd[r * n + c]; });
          check(of(by_tau), " by force ", [&](auto r, auto c) { return r == c ? 1.0 : 0.0; });
          if (m.name != "puma560" && m.name != "panda" && m.name != "pa10") continue;
          std::vector<double> slow_tau(n * n);
          ASSERT_TRUE(test::pairwise_derivatives(tree, b, i, qdd.data() + i * n, scratch.data(),
                                                 slow_q, slow_qd, slow_tau));
          ++compared;
          for (std::size_t e = 0; e < n * n; ++e) {
            ASSERT_NEAR(of(by_q)[e], slow_q[e], 1e-11 * largest(slow_q));
            ASSERT_NEAR(of(by_qd)[e], slow_qd[e], 1e-11 * largest(slow_qd));
            ASSERT_NEAR(of(by_tau)[e], slow_tau[e], 1e-11 * largest(slow_tau));
          }
        }
      }
    }
  }
  EXPECT_GT(compared, 50U);
}

TEST_F(DynamicsDerivatives, OfAnyRobotOfTheLibraryAreTheSlowerOnes) {
  test::Workbench bench;
  std::size_t robots = 0;
  for (const auto& file :
       std::filesystem::directory_iterator(test::Workbench::library() / "robots")) {
    if (file.path().extension() != ".rbt") continue;
    SCOPED_TRACE(file.path().filename().string());
    const RobotId id{bench.load("robots/" + file.path().filename().string()).number};
    RobotModel m =
        *test::unwrap(bench.derived.robot_model(*bench.document.now(), id, {0, 0, -9.81}, none_));
    m.loops.clear();
    const std::size_t n = m.dof();
    const auto tree = test::unwrap(spatial::make_body_tree(m));
    const auto inverse =
        solver<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, "auto");
    std::vector<double> scratch(std::max(inverse->scratch_size(), test::pairwise_scratch(tree)));
    for (const std::size_t count : {1UL, 9UL}) {
      const Samples s(m, count, random_);
      DynamicsBatch b = s.batch(scratch);
      if (m.tips.empty()) b.tip = {};
      std::vector<double> by_q(count * n * n), by_qd(by_q.size()), slow_q(n * n), slow_qd(n * n);
      ASSERT_TRUE(inverse->derivatives(b, by_q, by_qd, none_).ok());
      for (std::size_t i = 0; i < count; ++i) {
        test::pairwise_derivatives(tree, b, i, nullptr, false, scratch.data(), slow_q, slow_qd);
        const double size = 1e-11 * (1e-3 + largest(slow_q) + largest(slow_qd));
        for (std::size_t e = 0; e < n * n; ++e) {
          ASSERT_NEAR(by_q[i * n * n + e], slow_q[e], size) << e / n << " by place " << e % n;
          ASSERT_NEAR(by_qd[i * n * n + e], slow_qd[e], size) << e / n << " by rate " << e % n;
        }
      }
    }
    ++robots;
  }
  EXPECT_GT(robots, 20U);
}

TEST_F(DynamicsDerivatives, OfASampleDoNotDependOnItsPlaceInABatch) {
  for (const RobotModel& m : {conformance::puma560(), conformance::long_chain(40),
                              random_tree(9, false, random_), random_tree(6, true, random_)}) {
    const std::size_t n = m.dof(), square = n * n;
    const auto inverse =
        solver<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, "auto");
    const auto forward =
        solver<ForwardDynamics>("/dynamics_articulated.so", "articulated_body", m, "auto");
    std::vector<double> scratch(std::max(inverse->scratch_size(), forward->scratch_size()));
    // Enough to be divided among threads.
    const Samples s(m, 700, random_);
    const auto all = [&](std::size_t first, std::size_t count) {
      DynamicsBatch b = s.batch(scratch);
      b.count = count;
      b.q = b.q.subspan(first * m.coordinate_count(), count * m.coordinate_count());
      b.qd = b.qd.subspan(first * n, count * n), b.qdd = b.qdd.subspan(first * n, count * n);
      b.tau = b.qdd, b.tip = b.tip.subspan(first, count), b.base = b.base.subspan(first, count);
      std::vector<double> out(5 * count * square);
      const auto part = [&](std::size_t k) {
        return std::span(out).subspan(k * count * square, count * square);
      };
      EXPECT_TRUE(inverse->derivatives(b, part(0), part(1), none_).ok());
      EXPECT_TRUE(forward->derivatives(b, part(2), part(3), part(4), none_).ok());
      return out;
    };
    const auto whole = all(0, 700);
    for (const auto& [first, count] :
         {std::pair<std::size_t, std::size_t>{0, 2}, {3, 5}, {17, 9}, {333, 64}, {697, 3}}) {
      const auto some = all(first, count);
      for (std::size_t k = 0; k < 5; ++k)
        for (std::size_t e = 0; e < count * square; ++e)
          ASSERT_EQ(some[k * count * square + e], whole[(k * 700 + first) * square + e])
              << m.name << ", matrix " << k << ", " << first << " + " << e / square;
    }
  }
}

TEST_F(DynamicsDerivatives, OfWhatIsBeyondNumbersAreASentence) {
  const double wild[] = {0,      1e-300,  1e12,         1e155,
                         -1e300, 1.7e308, std::nan(""), std::numeric_limits<double>::infinity()};
  for (const RobotModel& m :
       {conformance::puma560(), conformance::long_chain(40), random_tree(7, false, random_)}) {
    const std::size_t n = m.dof();
    const auto inverse =
        solver<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, "auto");
    const auto forward =
        solver<ForwardDynamics>("/dynamics_articulated.so", "articulated_body", m, "auto");
    std::vector<double> scratch(std::max(inverse->scratch_size(), forward->scratch_size()));
    std::size_t refused = 0;
    for (const std::size_t count : {1UL, 9UL})
      for (const double x : wild)
        for (int where = 0; where < 6; ++where) {
          Samples s(m, count, random_);
          const std::size_t bad = count - 1;
          if (where == 0) s.q[bad * m.coordinate_count()] = x;
          if (where == 1) s.qd[bad * n] = x;
          if (where == 2) s.u[bad * n] = x;
          if (where == 3) s.wrenches[bad].moment[1] = x;
          if (where == 4) s.bases[bad].angular_velocity[0] = x;
          if (where == 5) s.bases[bad].gravity[2] = x;
          std::vector<double> a(count * n * n), b(a.size()), c(a.size());
          const auto judge = [&](const Result<void>& done, const char* what) {
            if (done.ok()) {
              for (const auto* v : {&a, &b, &c})
                for (const double y : *v) ASSERT_TRUE(std::isfinite(y)) << what << ' ' << x;
              return;
            }
            ++refused;
            EXPECT_EQ(done.error().code, ErrorCode::invalid_argument) << done.error().sentence();
            EXPECT_NE(done.error().sentence().find("sample " + std::to_string(count)),
                      std::string::npos)
                << done.error().sentence();
          };
          judge(inverse->derivatives(s.batch(scratch), a, b, none_), "torques");
          judge(forward->derivatives(s.batch(scratch), a, b, c, none_), "accelerations");
        }
    EXPECT_GT(refused, 20U) << m.name;
  }
}

/// Friction is of joints of one coordinate, in both directions of the question.
TEST_F(DynamicsDerivatives, AccelerationsOfBallJointsTakeNoFrictionThatTorquesLeaveOut) {
  RobotModel m = conformance::floating_manipulator();
  ASSERT_EQ(m.joints[1].type, JointType::spherical);
  m.joints[1].friction = {0.8, 0.1, -0.2};
  const std::size_t n = m.dof();
  const auto inverse =
      solver<InverseDynamics>("/dynamics_newton_euler.so", "newton_euler", m, "auto");
  const auto forward =
      solver<ForwardDynamics>("/dynamics_articulated.so", "articulated_body", m, "auto");
  std::vector<double> scratch(std::max(inverse->scratch_size(), forward->scratch_size()));
  const Samples s(m, 5, random_);
  std::vector<double> tau(5 * n), back(5 * n);
  DynamicsBatch b = s.batch(scratch);
  ASSERT_TRUE(inverse->torques(b, tau, none_).ok());
  b.tau = tau;
  ASSERT_TRUE(forward->accelerations(b, back, none_).ok());
  for (std::size_t i = 0; i < back.size(); ++i) EXPECT_NEAR(back[i], s.u[i], 1e-9) << i;
}

}  // namespace
}  // namespace robomosp
