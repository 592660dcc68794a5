// SPDX-License-Identifier: Apache-2.0
// Forces of the motors of mechanisms with closed loops, against virtual work on potential energies
// and against the balance of power, both from frames and masses alone; and controllers of them.
#include <dlfcn.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>
#include <robomosp/sdk/robot_code.h>

#include "motion/provider_params.h"
#include "robotics/closure.h"
#include "robotics/single_joints.h"
#include "sim/closed_dynamics.h"
#include "sim/dynamics.h"
#include "sim/forward_simulation.h"
#include "sim/recording_columns.h"
#include "spatial/mass.h"
#include "spatial/pose.h"
#include "support/closed_mechanism.h"

namespace robomosp {
namespace {

using test::ClosedMechanism;
using test::unwrap;
using Numbers = std::vector<double>;

constexpr std::array kMechanisms{"four_bar", "slider_crank", "five_bar", "delta", "stewart"};

/// Energies from products of frames, masses and springs, by no provider.
double potential_of(const RobotModel& model, const Numbers& q) {
  const auto frames = conformance::joint_frames(model, q.data());
  double sum = 0;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    const JointModel& joint = model.joints[j];
    const auto& c = joint.body.com;
    const Pose at = conformance::multiply(frames[j], conformance::shift(c[0], c[1], c[2]));
    for (std::size_t k = 0; k < 3; ++k) sum -= joint.body.mass * model.gravity[k] * at.p[k];
    if (joint.spring.stiffness == 0) continue;
    const double stretch = spatial::joint_value(joint, q.data()) - joint.spring.rest;
    sum += 0.5 * joint.spring.stiffness * stretch * stretch;
  }
  return sum;
}

class ClosedDynamicsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { bench_ = new test::Workbench; }
  static void TearDownTestSuite() {
    delete bench_;
    bench_ = nullptr;
  }
  static std::shared_ptr<const RobotModel> shared(const RobotModel& model) {
    return std::make_shared<const RobotModel>(model);
  }
  static sim::Bound<InverseDynamics> inverse_of(const RobotModel& model) {
    return unwrap(sim::bind_inverse_dynamics(bench_->registry, shared(model), {}));
  }
  Numbers torques(const RobotModel& model, const Numbers& q, const Numbers& qd, const Numbers& qdd,
                  std::uint32_t terms) {
    DynamicsBatch batch;
    batch.count = 1, batch.q = q, batch.qd = qd, batch.qdd = qdd, batch.terms = terms;
    return unwrap(sim::torques(inverse_of(model), batch, progress));
  }
  /// Rates and accelerations of all joints for those of the motors.
  void follow(const RobotModel& model, const Numbers& q, Numbers& qd, Numbers& qdd) {
    DynamicsBatch batch;
    batch.count = 1, batch.q = q, batch.qd = qd, batch.qdd = qdd;
    sim::FollowedRates followed;
    const auto done = sim::check_loops(
        model, batch, &followed, [](std::size_t) { return ""; }, progress);
    ASSERT_TRUE(done.ok()) << done.error().sentence();
    qd = followed.qd, qdd = followed.qdd;
  }
  /// A motion of the motors with closed loops.
  void some_motion(const ClosedMechanism& m, unsigned seed, Numbers& q, Numbers& qd, Numbers& qdd) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const std::vector<bool> motor = robotics::actuated_velocities(m.model);
    Numbers step(m.model.dof(), 0.0);
    qd = qdd = step;
    for (std::size_t v = 0; v < step.size(); ++v) {
      if (!motor[v]) continue;
      step[v] = 0.1 * uniform(random), qd[v] = uniform(random), qdd[v] = 3 * uniform(random);
    }
    Numbers target = m.home;
    robotics::move_configuration(m.model, step, target);
    const robotics::Closure c = robotics::close_loops(m.model, m.home, target, motor);
    ASSERT_TRUE(c.is_closed);
    q = c.q;
    follow(m.model, q, qd, qdd);
  }
  /// The configuration with one velocity moved, closed with the others of `held` where they were.
  static Numbers moved(const RobotModel& model, const Numbers& q, std::size_t entry, double by,
                       const std::vector<bool>& held) {
    Numbers step(model.dof(), 0.0), target = q;
    step[entry] = by;
    robotics::move_configuration(model, step, target);
    const robotics::Closure c = robotics::close_loops(model, q, target, held);
    EXPECT_TRUE(c.is_closed);
    return c.q;
  }
  /// Derivative of a number of a configuration by a motor, all others following.
  static double by_motor(const RobotModel& model, const Numbers& q, std::size_t entry,
                         const std::vector<bool>& held,
                         const std::function<double(const Numbers&)>& number) {
    constexpr double h = 2e-3;
    const auto at = [&](double x) { return number(moved(model, q, entry, x, held)); };
    return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
  }

  static test::Workbench* bench_;
  NoProgress progress;
};
test::Workbench* ClosedDynamicsTest::bench_ = nullptr;

TEST_F(ClosedDynamicsTest, MotorsHoldTheWeightThatVirtualWorkGives) {
  for (const char* name : kMechanisms) {
    const ClosedMechanism m(name);
    RobotModel model = m.model;
    // Springs at joints without motors are held by the motors as well.
    for (JointModel& j : model.joints)
      if (j.passive && j.type == JointType::revolute) j.spring = {2.5, 0.3};
    const std::vector<bool> motor = robotics::actuated_velocities(model);
    for (unsigned seed = 0; seed < 2; ++seed) {
      Numbers q, qd, qdd;
      some_motion(m, seed, q, qd, qdd);
      const Numbers tau = torques(model, q, {}, {}, kGravityTerm | kSpringTerm);
      for (std::size_t v = 0; v < tau.size(); ++v) {
        if (!motor[v]) {
          EXPECT_EQ(tau[v], 0) << name << ", entry " << v;
          continue;
        }
        const double expected = by_motor(
            model, q, v, motor, [&](const Numbers& at) { return potential_of(model, at); });
        EXPECT_NEAR(tau[v], expected, 1e-7 * std::max(1.0, std::fabs(expected)))
            << name << ", entry " << v;
      }
    }
  }
}

// The figures of a report: what holds the mechanisms at home.
TEST_F(ClosedDynamicsTest, TheWeightAtHomeIsThatOfTheReport) {
  const auto motors_of = [&](const char* name) {
    const ClosedMechanism m(name);
    const Numbers tau = torques(m.model, m.home, {}, {}, kGravityTerm);
    const std::vector<bool> motor = robotics::actuated_velocities(m.model);
    Numbers out;
    for (std::size_t v = 0; v < tau.size(); ++v)
      if (motor[v]) out.push_back(tau[v]);
    return out;
  };
  EXPECT_NEAR(motors_of("four_bar").at(0), 0.477, 5e-4);
  for (const double x : motors_of("delta")) EXPECT_NEAR(x, -1.432, 5e-4);
  for (const double x : motors_of("stewart")) EXPECT_NEAR(x, 34.48, 5e-3);
}

TEST_F(ClosedDynamicsTest, AccelerationsOfTheTorquesAreThoseOfTheMotion) {
  for (const char* name : kMechanisms) {
    const ClosedMechanism m(name);
    RobotModel model = m.model;
    for (JointModel& j : model.joints)
      if (coordinate_count(j.type) == 1) {
        j.friction.viscous += 0.05;
        if (j.passive) j.friction.coulomb_positive = 0.1, j.friction.coulomb_negative = -0.2;
        if (j.passive) j.spring = {1.5, -0.2};
      }
    const auto forward = unwrap(sim::bind_forward_dynamics(bench_->registry, shared(model),
                                                           sim::forward_choice(model, {})));
    for (unsigned seed = 3; seed < 6; ++seed) {
      Numbers q, qd, qdd;
      some_motion(m, seed, q, qd, qdd);
      const Numbers tau = torques(model, q, qd, qdd, kAllTerms);
      DynamicsBatch batch;
      batch.count = 1, batch.q = q, batch.qd = qd, batch.tau = tau;
      const Numbers back = unwrap(sim::accelerations(forward, batch, progress));
      double size = 1;
      for (const double x : qdd) size = std::max(size, std::fabs(x));
      for (std::size_t v = 0; v < qdd.size(); ++v)
        EXPECT_NEAR(back[v], qdd[v], 1e-9 * size) << name << ", entry " << v;
    }
  }
}

// tau . qd = d/dt (kinetic + potential energy) + what friction takes, along a motion of the motors;
// energies from frames at neighbouring times.
TEST_F(ClosedDynamicsTest, MotorsGiveThePowerThatEnergyAndFrictionTake) {
  for (const char* name : kMechanisms) {
    const ClosedMechanism m(name);
    RobotModel model = m.model;
    for (JointModel& j : model.joints)
      if (j.passive && coordinate_count(j.type) == 1) j.friction.viscous = 0.2;
    const std::vector<bool> motor = robotics::actuated_velocities(model);
    Numbers q, qd, qdd;
    some_motion(m, 11, q, qd, qdd);
    const auto at = [&](double t) {
      Numbers step(model.dof(), 0.0), target = q;
      for (std::size_t v = 0; v < step.size(); ++v)
        if (motor[v]) step[v] = qd[v] * t + 0.5 * qdd[v] * t * t;
      robotics::move_configuration(model, step, target);
      return robotics::close_loops(model, q, target, motor).q;
    };
    // Legs of 1 m/s turn a platform fast: its differences want shorter steps.
    const double h = std::string(name) == "stewart" ? 1e-3 : 5e-3;
    const auto difference = [h](const auto& f, double t) {
      return (8 * (f(t + h) - f(t - h)) - (f(t + 2 * h) - f(t - 2 * h))) / (12 * h);
    };
    const auto energy = [&](double t) {
      std::array<std::vector<Pose>, 4> near;
      const std::array<double, 4> times{t - 2 * h, t - h, t + h, t + 2 * h};
      std::array<Numbers, 4> values;
      for (std::size_t i = 0; i < 4; ++i) {
        values[i] = at(times[i]);
        near[i] = conformance::joint_frames(model, values[i].data());
      }
      const Numbers here = at(t);
      const auto frames = conformance::joint_frames(model, here.data());
      const auto slope = [&](const auto& of) {
        return (8 * (of(2) - of(1)) - (of(3) - of(0))) / (12 * h);
      };
      double sum = potential_of(model, here);
      for (std::size_t j = 0; j < model.joints.size(); ++j) {
        const MassProperties& body = model.joints[j].body;
        // R' R^T = [w]x, in the base; the inertia about the centre of mass in the joint's axes.
        std::array<double, 9> rate{};
        for (std::size_t k = 0; k < 9; ++k)
          rate[k] = slope([&](std::size_t i) { return near[i][j].R[k]; });
        const auto& R = frames[j].R;
        std::array<std::array<double, 3>, 3> own{};  // R^T R' = [w]x in the joint's axes
        for (std::size_t r = 0; r < 3; ++r)
          for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t k = 0; k < 3; ++k) own[r][c] += R[3 * k + r] * rate[3 * k + c];
        const Vec3 w{own[2][1], own[0][2], own[1][0]};
        const Sym3& I = body.inertia;
        const Vec3 l{I.xx * w[0] + I.xy * w[1] + I.xz * w[2],
                     I.xy * w[0] + I.yy * w[1] + I.yz * w[2],
                     I.xz * w[0] + I.yz * w[1] + I.zz * w[2]};
        for (std::size_t k = 0; k < 3; ++k) {
          const double v = slope([&](std::size_t i) {
            return conformance::multiply(near[i][j],
                                         conformance::shift(body.com[0], body.com[1], body.com[2]))
                .p[k];
          });
          sum += 0.5 * body.mass * v * v + 0.5 * w[k] * l[k];
        }
        const JointModel& joint = model.joints[j];
        if (joint.armature == 0 || coordinate_count(joint.type) != 1) continue;
        const double v =
            slope([&](std::size_t i) { return spatial::joint_value(joint, values[i].data()); });
        sum += 0.5 * joint.armature * v * v;
      }
      return sum;
    };
    double expected = difference(energy, 0.0);
    for (const JointModel& j : model.joints) {
      if (coordinate_count(j.type) != 1 || j.is_coupled()) continue;
      const double v = qd[static_cast<std::size_t>(j.v_index)];
      expected += j.friction.viscous * v * v +
                  v * (v > 0 ? j.friction.coulomb_positive : j.friction.coulomb_negative);
    }
    const Numbers tau = torques(model, q, qd, qdd, kAllTerms);
    double power = 0;
    for (std::size_t v = 0; v < tau.size(); ++v) power += tau[v] * qd[v];
    EXPECT_NEAR(power, expected, 2e-6 * std::max(1.0, std::fabs(expected))) << name;
  }
}

// Of a five-bar with a third motor: with two coordinates u, forces f do the work (dq/du)^T f =
// dV/du, and of those the least are f = G (G^T G)^-1 dV/du with the motors' rows G of dq/du.
TEST_F(ClosedDynamicsTest, MoreMotorsThanFreedomsShareTheLeastForces) {
  const ClosedMechanism m("five_bar");
  RobotModel model = m.model;
  model.gravity = {0, -9.81, 0};  // in its plane
  const std::vector<bool> two = robotics::actuated_velocities(model);
  const std::size_t a = m.q_of("left"), b = m.q_of("right"), c = m.q_of("left_forearm");
  Numbers q, qd, qdd;
  some_motion(m, 5, q, qd, qdd);
  std::array<std::array<double, 2>, 3> G{};
  std::array<double, 2> work{};
  for (std::size_t u = 0; u < 2; ++u) {
    const std::size_t entry = u == 0 ? a : b;
    work[u] =
        by_motor(model, q, entry, two, [&](const Numbers& at) { return potential_of(model, at); });
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t row = k == 0 ? a : k == 1 ? b : c;
      G[k][u] = by_motor(model, q, entry, two, [&](const Numbers& at) { return at[row]; });
    }
  }
  double aa = 0, ab = 0, bb = 0;
  for (const auto& row : G) aa += row[0] * row[0], ab += row[0] * row[1], bb += row[1] * row[1];
  const double det = aa * bb - ab * ab;
  const double x = (bb * work[0] - ab * work[1]) / det, y = (aa * work[1] - ab * work[0]) / det;
  for (JointModel& j : model.joints)
    if (j.v_index == static_cast<std::int32_t>(c)) j.passive = false;
  const Numbers tau = torques(model, q, {}, {}, kGravityTerm);
  const std::array<std::size_t, 3> entries{a, b, c};
  for (std::size_t k = 0; k < 3; ++k)
    EXPECT_NEAR(tau[entries[k]], G[k][0] * x + G[k][1] * y, 1e-7) << k;
  EXPECT_EQ(tau[m.q_of("right_forearm")], 0);
}

TEST_F(ClosedDynamicsTest, WhatNoMotorHoldsStaysAtJointsWithoutMotors) {
  const ClosedMechanism m("four_bar");
  RobotModel model = m.model;
  for (JointModel& j : model.joints) j.passive = true;
  const Numbers tau = torques(model, m.home, {}, {}, kGravityTerm);
  // The same work on the only motion.
  const std::vector<bool> motor = robotics::actuated_velocities(m.model);
  double work = 0;
  for (std::size_t v = 0; v < tau.size(); ++v)
    work += tau[v] * by_motor(model, m.home, m.q_of("crank"), motor,
                              [&](const Numbers& at) { return at[v]; });
  EXPECT_NEAR(work,
              by_motor(model, m.home, m.q_of("crank"), motor,
                       [&](const Numbers& at) { return potential_of(model, at); }),
              1e-7);
  EXPECT_TRUE(sim::missing_motor(model, tau));
  EXPECT_FALSE(sim::missing_motor(m.model, torques(m.model, m.home, {}, {}, kGravityTerm)));
}

// The pin of a four-bar at rest: the moments of the rocker about its foot and of the coupler about
// the crank's end give both parts of its force.
TEST_F(ClosedDynamicsTest, TheForceInTheCutIsThatOfTheFreeBodies) {
  const ClosedMechanism m("four_bar");
  const Numbers tau = torques(m.model, m.home, {}, {}, kAllTerms);
  const auto forward = unwrap(sim::bind_forward_dynamics(bench_->registry, shared(m.model),
                                                         sim::forward_choice(m.model, {})));
  DynamicsBatch batch;
  batch.count = 1, batch.q = m.home, batch.tau = tau;
  const auto rest = unwrap(sim::constrained(forward, batch, progress));
  for (const double x : rest.qdd) EXPECT_NEAR(x, 0, 1e-9);
  ASSERT_EQ(rest.forces.size(), 2U);
  // In the plane of the mechanism, its base's x and y; gravity is -y there.
  const double q1 = m.home[0], coupler = q1 + m.home[1], rocker = m.home[2];
  const double fx = std::cos(coupler) * rest.forces[0] - std::sin(coupler) * rest.forces[1];
  const double fy = std::sin(coupler) * rest.forces[0] + std::cos(coupler) * rest.forces[1];
  const double g = 9.81;
  // On the rocker F acts at 0.28 m, its weight of 1 kg at 0.14 m.
  EXPECT_NEAR(0.28 * (std::cos(rocker) * fy - std::sin(rocker) * fx),
              0.14 * std::cos(rocker) * 1.0 * g, 1e-9);
  // On the coupler -F acts at 0.36 m from the crank's end, its weight of 1.2 kg at 0.18 m.
  EXPECT_NEAR(-0.36 * (std::cos(coupler) * fy - std::sin(coupler) * fx),
              0.18 * std::cos(coupler) * 1.2 * g, 1e-9);
}

TEST_F(ClosedDynamicsTest, InertiaIsThatOfTheMotorsAndKeepsTheKineticEnergy) {
  for (const char* name : kMechanisms) {
    const ClosedMechanism m(name);
    const std::size_t n = m.model.dof();
    Numbers q, qd, qdd;
    some_motion(m, 21, q, qd, qdd);
    const auto inverse = inverse_of(m.model);
    DynamicsBatch batch;
    batch.count = 1, batch.q = q, batch.qd = qd;
    const Numbers inertia = unwrap(sim::inertia(inverse, batch, progress));
    const double kinetic = unwrap(sim::energies(inverse, batch, progress)).front().kinetic;
    double twice = 0;
    for (std::size_t r = 0; r < n; ++r)
      for (std::size_t c = 0; c < n; ++c) {
        EXPECT_EQ(inertia[r * n + c], inertia[c * n + r]);
        twice += qd[r] * inertia[r * n + c] * qd[c];
      }
    EXPECT_NEAR(0.5 * twice, kinetic, 1e-10 * std::max(1.0, kinetic)) << name;
    // From rest, where accelerations that keep the loops closed are like rates.
    const Numbers tau = torques(m.model, q, {}, qd, kInertialTerm);
    for (std::size_t r = 0; r < n; ++r) {
      double product = 0;
      for (std::size_t c = 0; c < n; ++c) product += inertia[r * n + c] * qd[c];
      EXPECT_NEAR(product, tau[r], 1e-9 * std::max(1.0, std::fabs(tau[r]))) << name;
    }
  }
}

TEST_F(ClosedDynamicsTest, TheRegressorTimesItsParametersIsTheMotorsTorque) {
  const ClosedMechanism m("delta");
  RobotModel model = m.model;
  for (JointModel& j : model.joints) j.armature = 0;
  Numbers q, qd, qdd;
  some_motion(m, 8, q, qd, qdd);
  DynamicsBatch batch;
  batch.count = 1, batch.q = q, batch.qd = qd, batch.qdd = qdd;
  batch.terms = kGravityTerm | kInertialTerm | kVelocityTerm;
  const auto inverse = inverse_of(model);
  const Numbers y = unwrap(sim::regressor(inverse, batch, progress));
  const Numbers tau = unwrap(sim::torques(inverse, batch, progress));
  Numbers pi;
  for (const JointModel& j : model.joints)
    for (const double x : spatial::inertial_parameters(j.body)) pi.push_back(x);
  ASSERT_EQ(y.size(), pi.size() * tau.size());
  for (std::size_t r = 0; r < tau.size(); ++r) {
    double sum = 0;
    for (std::size_t k = 0; k < pi.size(); ++k) sum += y[r * pi.size() + k] * pi[k];
    EXPECT_NEAR(sum, tau[r], 1e-9) << r;
  }
}

TEST_F(ClosedDynamicsTest, ABatchAnswersEachStateAsAlone) {
  const ClosedMechanism m("stewart");
  const std::size_t n = m.model.dof(), count = 40;
  Numbers q, qd, qdd;
  std::vector<Numbers> alone;
  for (unsigned i = 0; i < count; ++i) {
    Numbers one, rates, accelerations;
    some_motion(m, 100 + i % 5, one, rates, accelerations);
    if (i < 5) alone.push_back(torques(m.model, one, rates, accelerations, kAllTerms));
    q.insert(q.end(), one.begin(), one.end());
    qd.insert(qd.end(), rates.begin(), rates.end());
    qdd.insert(qdd.end(), accelerations.begin(), accelerations.end());
  }
  DynamicsBatch batch;
  batch.count = count, batch.q = q, batch.qd = qd, batch.qdd = qdd;
  const Numbers tau = unwrap(sim::torques(inverse_of(m.model), batch, progress));
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t v = 0; v < n; ++v)
      EXPECT_NEAR(tau[i * n + v], alone[i % 5][v], 1e-9) << "state " << i << ", entry " << v;
}

// Loops that hold some directions twice, as those of the delta, hold no more of them when they are
// open by the digits that were written.
TEST_F(ClosedDynamicsTest, RoundedJointValuesGiveNearlyTheSameTorques) {
  for (const char* name : kMechanisms) {
    const ClosedMechanism m(name);
    const Numbers exact = torques(m.model, m.home, {}, {}, kGravityTerm);
    Numbers rounded = m.home;
    for (double& x : rounded) x = std::round(x * 1e7) / 1e7;
    const Numbers tau = torques(m.model, rounded, {}, {}, kGravityTerm);
    for (std::size_t v = 0; v < tau.size(); ++v)
      EXPECT_NEAR(tau[v], exact[v], 1e-4) << name << ", entry " << v;
  }
}

TEST_F(ClosedDynamicsTest, StatesThatOpenTheLoopsAreRefusedWithTheLoop) {
  const ClosedMechanism m("four_bar");
  const auto refused = [&](const Numbers& q, const Numbers& qd, const Numbers& qdd,
                           std::uint32_t terms = kAllTerms) {
    DynamicsBatch batch;
    batch.count = 1, batch.q = q, batch.qd = qd, batch.qdd = qdd, batch.terms = terms;
    const auto done = sim::check_loops(
        m.model, batch, nullptr, [](std::size_t) { return ", row 7"; }, progress);
    return done.ok() ? std::string() : done.error().sentence();
  };
  Numbers open = m.home;
  open[1] += 0.01;
  EXPECT_NE(refused(open, {}, {}).find("loop \"pin\" is open by"), std::string::npos);
  EXPECT_NE(refused(open, {}, {}).find(", row 7"), std::string::npos);
  EXPECT_NE(refused(m.home, {1, 0, 0}, {}).find("speeds pull"), std::string::npos);
  Numbers qd{1, 0, 0}, qdd{0.5, 0, 0};
  follow(m.model, m.home, qd, qdd);
  EXPECT_EQ(refused(m.home, qd, qdd), "");
  EXPECT_NE(refused(m.home, qd, {0.5, 0, 0}).find("accelerations pull"), std::string::npos);
  EXPECT_EQ(refused(m.home, qd, {0.5, 0, 0}, kGravityTerm), "");
  EXPECT_EQ(qd[0], 1) << "motors keep their rates";
  const sim::Bound<InverseDynamics> inverse = inverse_of(m.model);
  DynamicsBatch batch;
  batch.count = 1, batch.q = m.home;
  const auto derivatives = sim::derivatives(inverse, batch, progress);
  ASSERT_FALSE(derivatives.ok());
  EXPECT_NE(derivatives.error().sentence().find("closed loops"), std::string::npos);
}

// --- controllers ---

class ClosedControl : public ClosedDynamicsTest {
 protected:
  recording::RecordingPtr simulate(const sim::ForwardRun& run) {
    const auto snapshot = bench_->document.now();
    const sim::Simulator simulator{bench_->registry, bench_->derived, *snapshot};
    return unwrap(sim::forward_dynamics(simulator, run, progress));
  }
  static sim::ForwardRun held_by(RobotId robot, const char* controller, Numbers q, double seconds) {
    sim::ForwardRun run;
    run.record = robot;
    run.duration = seconds;
    run.sample_time = 0.05;
    run.is_controlled = true;
    run.controller.name = controller;
    run.hold = std::move(q);
    return run;
  }
};

TEST_F(ClosedControl, ControllersHoldEveryMechanism) {
  for (const char* name : {"four_bar", "slider_crank", "delta"}) {
    const ClosedMechanism m(name);
    const RobotId id{bench_->load("robots/" + std::string(name) + ".rbt").number};
    for (const char* controller : {"computed_torque", "pd_gravity", "operational_space"}) {
      sim::ForwardRun run = held_by(id, controller, m.home, 0.25);
      run.q = m.home;
      const auto out = simulate(run);
      ASSERT_TRUE(out) << name << " by " << controller;
      EXPECT_LT(std::fabs(out->find("tip_error")->values.back()), 1e-6)
          << name << " by " << controller;
    }
  }
}

// From another place, with friction and a spring at joints without motors.
TEST_F(ClosedControl, ControllersBringADeltaToItsPlace) {
  const ClosedMechanism m("delta");
  const RobotId id{bench_->load("robots/delta.rbt").number};
  Numbers target = m.home;
  target[m.q_of("arm_one")] += 0.1;
  target[m.q_of("arm_three")] -= 0.08;
  const robotics::Closure c =
      robotics::close_loops(m.model, m.home, target, robotics::actuated_velocities(m.model));
  ASSERT_TRUE(c.is_closed);
  for (const char* controller : {"computed_torque", "operational_space"}) {
    sim::ForwardRun run = held_by(id, controller, c.q, 1);
    run.q = m.home;
    const auto out = simulate(run);
    ASSERT_TRUE(out);
    EXPECT_GT(out->find("tip_error")->values.front(), 0.01) << controller;
    EXPECT_LT(std::fabs(out->find("tip_error")->values.back()), 1e-5) << controller;
  }
}

// The motors of a delta swing to and fro; the controller feeds forward what that takes. Torques
// are held for 1 ms, which leaves errors of a few micrometres.
TEST_F(ClosedControl, AMovingReferenceIsFollowed) {
  const ClosedMechanism m("delta");
  const RobotId id{bench_->load("robots/delta.rbt").number};
  const std::vector<bool> motor = robotics::actuated_velocities(m.model);
  const std::size_t n = m.model.dof();
  ASSERT_EQ(n, m.model.coordinate_count());
  recording::Recording way;
  way.columns.push_back({"time", "s", "", {}});
  for (const char* stem : {"q", "qd", "qdd"})
    for (std::size_t k = 0; k < n; ++k)
      way.columns.push_back({stem + std::to_string(k + 1), "", "", {}});
  Numbers q = m.home;
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.004 * i, w = 8;
    Numbers target = m.home, qd(n, 0.0), qdd(n, 0.0);
    double size = 0.2;
    for (std::size_t v = 0; v < n; ++v) {
      if (!motor[v]) continue;
      target[v] += size * (1 - std::cos(w * t));
      qd[v] = size * w * std::sin(w * t), qdd[v] = size * w * w * std::cos(w * t);
      size *= -0.7;
    }
    const robotics::Closure c = robotics::close_loops(m.model, q, target, motor);
    ASSERT_TRUE(c.is_closed);
    q = c.q;
    follow(m.model, q, qd, qdd);
    way.columns[0].values.push_back(t);
    for (std::size_t k = 0; k < n; ++k) {
      way.columns[1 + k].values.push_back(q[k]);
      way.columns[1 + n + k].values.push_back(qd[k]);
      way.columns[1 + 2 * n + k].values.push_back(qdd[k]);
    }
  }
  const auto reference = std::make_shared<const recording::Recording>(std::move(way));
  for (const char* controller : {"computed_torque", "operational_space"}) {
    sim::ForwardRun run;
    run.record = id;
    run.is_controlled = true;
    run.controller.name = controller;
    run.recorded_q = reference;
    run.sample_time = 0.02;
    run.relative_tolerance = 1e-7, run.absolute_tolerance = 1e-9;
    const auto out = simulate(run);
    ASSERT_TRUE(out) << controller;
    double most = 0, moved = 0;
    for (const double e : out->find("tip_error")->values) most = std::max(most, std::fabs(e));
    const auto& z = out->find("z")->values;
    for (const double x : z) moved = std::max(moved, std::fabs(x - z.front()));
    EXPECT_GT(moved, 0.01);
    EXPECT_LT(most, 5e-5) << controller;
  }
}

// A motion that its motors made is found again from its rows.
TEST_F(ClosedControl, TorquesOfARecordingAreThoseThatMadeIt) {
  const RobotId id{bench_->load("robots/slider_crank.rbt").number};
  const ClosedMechanism m("slider_crank");
  sim::ForwardRun run;
  run.record = id;
  run.duration = 0.3;
  run.sample_time = 0.02;
  run.q = m.home;
  run.tau = {1.5, 0, 0};
  run.at_limit = sim::AtLimit::ignore;
  const auto out = simulate(run);
  ASSERT_TRUE(out);
  recording::Recording without = *out;
  std::erase_if(without.columns, [](const auto& c) { return c.name.starts_with("tau"); });
  const auto snapshot = bench_->document.now();
  const sim::Simulator simulator{bench_->registry, bench_->derived, *snapshot};
  const std::vector<std::string> wanted{"torque", "power"};
  const auto done = unwrap(sim::with_quantities(simulator, without, wanted, progress));
  ASSERT_TRUE(done);
  for (const double x : done->find("tau1")->values) EXPECT_NEAR(x, 1.5, 1e-7);
  for (const double x : done->find("tau3")->values) EXPECT_EQ(x, 0);
}

// --- generated code ---

using CodeOfThree = void (*)(const double*, const double*, const double*, double*);
using CodeOfOne = void (*)(const double*, double*);

/// Generated C of a mechanism, compiled and opened.
class CodeOf {
 public:
  CodeOf(const Registry& registry, const RobotModel& model) {
    const auto generator = unwrap(registry.create<RobotCodeGenerator>("c99"));
    const auto info = unwrap(registry.find(RobotCodeGenerator::kInterfaceId, "c99"));
    const auto params = unwrap(motion::checked_params(info, {}, "c99"));
    NoProgress none;
    std::string place = testing::TempDir() + "closed_code_XXXXXX";
    EXPECT_NE(mkdtemp(place.data()), nullptr);
    const std::filesystem::path folder = place;
    for (const CodeFile& f : unwrap(generator->generate(model, "closed", kCodeAll, *params, none)))
      std::ofstream(folder / f.name) << f.text;
    const std::string library = (folder / "closed.so").string();
    const std::string command = "cc -std=c99 -O1 -Wall -Wextra -Wpedantic -Werror -fPIC -shared '" +
                                (folder / "closed.c").string() + "' -o '" + library + "' -lm";
    EXPECT_EQ(std::system(command.c_str()), 0);
    void* const opened = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);
    std::filesystem::remove_all(folder);
    const auto take = [opened](const char* name) { return dlsym(opened, name); };
    inverse_dynamics = reinterpret_cast<CodeOfThree>(take("closed_inverse_dynamics"));
    forward_dynamics = reinterpret_cast<CodeOfThree>(take("closed_forward_dynamics"));
    inertia = reinterpret_cast<CodeOfOne>(take("closed_inertia"));
  }
  CodeOfThree inverse_dynamics = nullptr, forward_dynamics = nullptr;
  CodeOfOne inertia = nullptr;
};

TEST_F(ClosedDynamicsTest, GeneratedCodeAnswersForTheClosedMechanism) {
  for (const char* name : kMechanisms) {
    const ClosedMechanism m(name);
    RobotModel model = m.model;
    for (JointModel& j : model.joints)
      if (j.passive && coordinate_count(j.type) == 1) {
        j.friction = {0.05, 0.1, -0.2};
        j.spring = {1.5, -0.2};
      }
    if (std::string(name) == "five_bar")  // more motors than freedoms
      for (JointModel& j : model.joints) j.passive = false;
    if (std::string(name) == "four_bar")  // a motor that is missing
      for (JointModel& j : model.joints) j.passive = true;
    const CodeOf code(bench_->registry, model);
    ASSERT_TRUE(code.inverse_dynamics && code.forward_dynamics && code.inertia) << name;
    const auto forward = unwrap(sim::bind_forward_dynamics(bench_->registry, shared(model),
                                                           sim::forward_choice(model, {})));
    for (unsigned seed = 40; seed < 42; ++seed) {
      Numbers q, qd, qdd;
      some_motion(m, seed, q, qd, qdd);
      const std::size_t n = model.dof();
      Numbers tau(n), back(n), inertia(n * n);
      const auto expect_near = [&](const Numbers& got, const Numbers& expected, const char* what) {
        double size = 1;
        for (const double x : expected) size = std::max(size, std::fabs(x));
        for (std::size_t k = 0; k < got.size(); ++k)
          EXPECT_NEAR(got[k], expected[k], 1e-8 * size) << name << ", " << what << " " << k;
      };
      code.inverse_dynamics(q.data(), qd.data(), qdd.data(), tau.data());
      expect_near(tau, torques(model, q, qd, qdd, kAllTerms), "torque");
      DynamicsBatch batch;
      batch.count = 1, batch.q = q;
      code.inertia(q.data(), inertia.data());
      expect_near(inertia, unwrap(sim::inertia(inverse_of(model), batch, progress)), "inertia");
      Numbers push(n);
      for (std::size_t k = 0; k < n; ++k) push[k] = std::sin(static_cast<double>(3 * k + seed));
      code.forward_dynamics(q.data(), qd.data(), push.data(), back.data());
      batch.qd = qd, batch.tau = push;
      expect_near(back, unwrap(sim::accelerations(forward, batch, progress)), "acceleration");
    }
  }
}

TEST(WhyNotSingleJoints, NamesTheJointOrTheLoop) {
  EXPECT_EQ(robotics::why_not_single_joints(ClosedMechanism("gripper").model),
            "its joint \"left_tip\" follows joint \"left_finger\"");
  EXPECT_EQ(robotics::why_not_single_joints(ClosedMechanism("four_bar").model),
            "it has the closed loop \"pin\"");
  EXPECT_EQ(robotics::why_not_single_joints(ClosedMechanism("satellite_arm").model),
            "its joint \"body\" is a free joint");
  EXPECT_EQ(robotics::why_not_single_joints(ClosedMechanism("dual_arm").model), "");
}

}  // namespace
}  // namespace robomosp
