// SPDX-License-Identifier: Apache-2.0
// Motions of mechanisms against closed forms and against an integration of their own.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include <robomosp/sdk/conformance/mechanisms.h>

#include "robotics/kinematics.h"
#include "sim/base_motion.h"
#include "sim/forward_simulation.h"
#include "sim/mechanism_motion.h"
#include "support/workbench.h"

namespace robomosp {
namespace {

using conformance::add_joint;
using conformance::body;
using test::unwrap;
using test::Workbench;

constexpr double kGravity = 9.81;

/// Keeps every state it is given.
struct Kept final : OdeSink {
  bool sample(double t, std::span<const double> x) override {
    times.push_back(t);
    states.emplace_back(x.begin(), x.end());
    return true;
  }
  std::vector<double> times;
  std::vector<std::vector<double>> states;
};

class Motion : public ::testing::Test {
 protected:
  Workbench bench;
  NoProgress progress;

  std::unique_ptr<sim::MechanismMotion> make(RobotModel m, sim::MotionOptions options = {},
                                             const std::string& forward = {}) {
    model = std::make_shared<const RobotModel>(std::move(m));
    model::ProviderChoice choice;
    choice.name = forward;
    return std::make_unique<sim::MechanismMotion>(
        unwrap(sim::bind_forward_dynamics(bench.registry, model, choice)), std::move(options));
  }
  /// Runs from x0 and gives the state at the end.
  std::vector<double> run(sim::MechanismMotion& motion, std::vector<double> x0, double end,
                          const std::string& integrator = "dormand_prince") {
    model::ProviderChoice choice;
    choice.name = integrator;
    const auto bound = unwrap(sim::bind_integrator(bench.registry, model, choice));
    motion.project(x0);
    const auto settled = motion.settle(0, x0);
    EXPECT_TRUE(settled.ok()) << (settled.ok() ? "" : settled.error().sentence());
    OdeRun ode;
    const std::vector<double> times{end};
    ode.end = end, ode.x0 = x0, ode.sample_times = times;
    kept = {};
    auto done = bound.solver->run(motion, ode, kept, progress);
    EXPECT_TRUE(done.ok()) << (done.ok() ? "" : done.error().sentence());
    EXPECT_FALSE(motion.failure()) << motion.failure()->sentence();
    if (kept.states.empty()) return x0;
    return kept.states.back();
  }
  /// Kinetic and potential energy from the inertia matrix and the frames.
  double energy(const std::vector<double>& x, const std::string& inverse = {}) {
    const std::size_t c = model->coordinate_count(), n = model->dof();
    model::ProviderChoice choice;
    choice.name = inverse;
    const auto dynamics = unwrap(sim::bind_inverse_dynamics(bench.registry, model, choice));
    const std::vector<double> q(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(c));
    DynamicsBatch batch;
    batch.count = 1, batch.q = q;
    const auto m = unwrap(sim::inertia(dynamics, batch, progress));
    double sum = 0;
    for (std::size_t r = 0; r < n; ++r)
      for (std::size_t k = 0; k < n; ++k) sum += 0.5 * x[c + r] * m[r * n + k] * x[c + k];
    const auto frames = conformance::joint_frames(*model, q.data());
    for (std::size_t j = 0; j < model->joints.size(); ++j) {
      const MassProperties& b = model->joints[j].body;
      const Pose p =
          conformance::multiply(frames[j], conformance::shift(b.com[0], b.com[1], b.com[2]));
      for (std::size_t k = 0; k < 3; ++k) sum -= b.mass * model->gravity[k] * p.p[k];
    }
    return sum;
  }
  std::shared_ptr<const RobotModel> model;
  Kept kept;
};

/// A block of 2 kg on a horizontal rail along x.
RobotModel rail() {
  RobotModel m;
  m.name = "rail";
  add_joint(m, "slide", -1, JointType::prismatic, conformance::turn_y(conformance::kPi / 2),
            body(2, 0, 0, 0, 0.01, 0.01, 0.01));
  m.tips = {{"tip", 0, Pose{}}};
  m.number_coordinates();
  return m;
}
/// A mass of 1 kg that falls along z.
RobotModel drop() {
  RobotModel m;
  m.name = "drop";
  add_joint(m, "fall", -1, JointType::prismatic, Pose{}, body(1, 0, 0, 0, 0.01, 0.01, 0.01));
  m.tips = {{"tip", 0, Pose{}}};
  m.number_coordinates();
  return m;
}

/// Two rods of planar_rods() by their closed form (Spong, Robot Modeling and Control, 7.3), with
/// the classical Runge-Kutta method in steps of 20 us.
std::vector<double> rods_after(std::vector<double> x, double end) {
  const double l1 = 0.7, m1 = 2.5, l2 = 0.45, m2 = 1.2, c1 = l1 / 2, c2 = l2 / 2, g = kGravity;
  const double i1 = m1 * l1 * l1 / 12, i2 = m2 * l2 * l2 / 12;
  const auto rate = [&](const std::vector<double>& s) {
    const double c = std::cos(s[1]), h = -m2 * l1 * c2 * std::sin(s[1]);
    const double d11 = m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2 + 2 * l1 * c2 * c) + i1 + i2;
    const double d12 = m2 * (c2 * c2 + l1 * c2 * c) + i2, d22 = m2 * c2 * c2 + i2;
    const double g2 = m2 * c2 * g * std::cos(s[0] + s[1]),
                 g1 = (m1 * c1 + m2 * l1) * g * std::cos(s[0]) + g2;
    const double r1 = -(h * (2 * s[2] * s[3] + s[3] * s[3]) + g1), r2 = h * s[2] * s[2] - g2;
    const double det = d11 * d22 - d12 * d12;
    return std::vector<double>{s[2], s[3], (d22 * r1 - d12 * r2) / det,
                               (d11 * r2 - d12 * r1) / det};
  };
  const int steps = static_cast<int>(std::lround(end / 2e-5));
  const double h = end / steps;
  const auto ahead = [](std::vector<double> s, const std::vector<double>& d, double f) {
    for (std::size_t i = 0; i < 4; ++i) s[i] += f * d[i];
    return s;
  };
  for (int i = 0; i < steps; ++i) {
    const auto a = rate(x), b = rate(ahead(x, a, h / 2)), c = rate(ahead(x, b, h / 2)),
               d = rate(ahead(x, c, h));
    for (std::size_t k = 0; k < 4; ++k) x[k] += h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]);
  }
  return x;
}

RobotModel bare(RobotModel m) {
  for (JointModel& j : m.joints) j.friction = {};
  return m;
}
sim::MotionOptions free_of_limits() {
  sim::MotionOptions o;
  o.at_limit = sim::AtLimit::ignore;
  return o;
}

TEST_F(Motion, TheDoublePendulumFollowsAnIntegrationOfItsClosedFormAndKeepsItsEnergy) {
  auto motion = make(bare(conformance::planar_rods()), free_of_limits());
  const std::vector<double> x0{0.4, 0.9, 0, 0};
  const double before = energy(x0);
  const auto x = run(*motion, x0, 1);
  const auto expected = rods_after(x0, 1);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(x[i], expected[i], 1e-8);
  EXPECT_NEAR(energy(x), before, 1e-9 * std::fabs(before));
}

TEST_F(Motion, AFreeSwingOfThePumaKeepsItsEnergyWithEveryIntegrator) {
  auto motion = make(bare(conformance::puma560()), free_of_limits());
  const std::vector<double> x0{0.1, 0.5, -0.3, 0.2, 0.8, 0, 0, 0, 0, 0, 0, 0};
  const double before = energy(x0);
  EXPECT_NEAR(energy(run(*motion, x0, 1)), before, 1e-9 * std::fabs(before));
  EXPECT_NEAR(energy(run(*motion, x0, 1, "runge_kutta4")), before, 1e-6 * std::fabs(before));
  EXPECT_NEAR(energy(run(*motion, x0, 1, "symplectic")), before, 1e-3 * std::fabs(before));
}

TEST_F(Motion, FrictionStopsABlockWhereTheClosedFormSaysAndHoldsIt) {
  RobotModel m = rail();
  m.joints[0].friction = {0, 3, -5};  // to the right it is braked by 3 N, to the left by 5 N
  auto motion = make(m);
  for (const double v : {1.5, -1.5}) {
    const double force = v > 0 ? 3 : 5, stop = 2 * std::fabs(v) / force;
    const auto x = run(*motion, {0, v}, 2 * stop);
    EXPECT_NEAR(x[0], v * stop / 2, 1e-10);
    EXPECT_EQ(x[1], 0);
    EXPECT_NEAR(motion->happened().back().time, stop, 1e-10);
    EXPECT_EQ(motion->happened().back().kind, sim::MotionEvent::Kind::sticks);
  }
}

TEST_F(Motion, StaticFrictionHoldsUpToItsBreakawayForce) {
  RobotModel m = rail();
  m.joints[0].friction = {0, 4, -4};
  sim::MotionOptions o;
  o.breakaway = 1.5;
  o.torques = [](double t, std::span<double> tau) { tau[0] = 2 * t; };  // reaches 6 N at 3 s
  auto motion = make(m, o);
  const auto held = run(*motion, {0, 0}, 2.999);
  EXPECT_EQ(held[0], 0);
  EXPECT_EQ(held[1], 0);
  const auto x = run(*motion, {0, 0}, 4);
  // From 3 s on 2 kg are moved by 2 t - 4.
  EXPECT_NEAR(x[1], (16 - 9 - 4) / 2.0, 1e-8);
  ASSERT_FALSE(motion->happened().empty());
  EXPECT_NEAR(motion->happened().back().time, 3, 1e-9);
}

// The sign of rounding would brake it in one direction and let it be pushed in the other.
TEST_F(Motion, APlannedRestWithRoundingInItIsARest) {
  RobotModel m = rail();
  m.joints[0].friction = {0, 4, -4};
  sim::MotionOptions o;
  o.torques = [](double, std::span<double> tau) { tau[0] = 3; };  // less than holds it
  auto motion = make(m, o);
  for (const double v : {1e-30, -1e-30, 1e-14, -1e-14}) {
    std::vector<double> x{0, v};
    motion->bring_to_rest(x);
    EXPECT_EQ(x[1], 0);
    EXPECT_EQ(run(*motion, x, 1)[0], 0);
    for (const auto& e : motion->happened()) EXPECT_EQ(e.time, 0);  // it sticks at once
  }
  std::vector<double> moving{0, 1e-6};
  motion->bring_to_rest(moving);
  EXPECT_EQ(moving[1], 1e-6);
}

TEST_F(Motion, AMassOnADrivenSpringSticksAndSlipsWithTheClosedPeriod) {
  // A block is pulled at speed v by a spring of stiffness k: it sticks until the spring pulls Fs,
  // then slides against Fk. From rest with stretch Fs / k the slip is, with w^2 = k / m and r = v
  // w / ((Fs - Fk) / m) ... , the free oscillation until the speed is zero again.
  RobotModel m = rail();
  const double k = 50, mass = 2, fk = 4, fs = 8, v = 0.1;
  m.joints[0].friction = {0, fk, -fk};
  sim::MotionOptions o;
  o.breakaway = fs / fk;
  // The spring's force depends on the position, so it stands in the model; its end moves.
  m.joints[0].spring = {k, 0};
  o.torques = [=](double t, std::span<double> tau) { tau[0] = k * v * t; };
  auto motion = make(m, o);
  run(*motion, {0, 0}, 12);
  std::vector<double> slips, sticks;
  for (const auto& e : motion->happened())
    (e.kind == sim::MotionEvent::Kind::slides ? slips : sticks).push_back(e.time);
  ASSERT_GE(slips.size(), 3U);
  EXPECT_NEAR(slips[0], fs / (k * v), 1e-8);
  // Stretch s' = v - x', m x'' = k s - fk: with u = s - fk / k and w^2 = k / m, u = a cos + b sin,
  // a = (fs - fk) / k, b = v / w; x' = v - u' is zero again at the angle 2 (pi - atan(a w / v)).
  const double w = std::sqrt(k / mass), a = (fs - fk) / k;
  const double slip = 2 * (conformance::kPi - std::atan(a * w / v)) / w;
  EXPECT_NEAR(sticks[1 - (sticks[0] < slips[0] ? 0 : 1)] - slips[0], slip, 1e-7);
  // Then the spring is stretched again by 2 a at the speed v.
  EXPECT_NEAR(slips[1] - slips[0], slip + 2 * a / v, 1e-7);
  EXPECT_NEAR(slips[2] - slips[1], slip + 2 * a / v, 1e-7);
}

TEST_F(Motion, SeveralJointsStickAtOnceAndTheWeightSetsFreeOnlyTheOneThatCannotHold) {
  RobotModel m = conformance::planar_rods();
  // Weight asks for 2.5 * 0.35 * g + 1.2 * (0.7 + 0.225) * g = 19.47 N m and 2.65 N m.
  m.joints[0].friction = {0, 25, -25};
  m.joints[1].friction = {0, 5, -5};
  auto both = make(m);
  const auto rest = run(*both, {0, 0, 0, 0}, 1);
  EXPECT_EQ(rest, (std::vector<double>{0, 0, 0, 0}));
  m.joints[1].friction = {0, 1, -1};
  auto one = make(m);
  const auto x = run(*one, {0, 0, 0, 0}, 0.05);
  EXPECT_EQ(x[0], 0);
  EXPECT_LT(x[1], 0);
  EXPECT_EQ(x[2], 0);
}

TEST_F(Motion, AStopReboundsAtItsTimesAndThenHolds) {
  RobotModel m = drop();
  m.joints[0].lower = -1;
  sim::MotionOptions o;
  o.restitution = 0.5;
  auto motion = make(m, o);
  const auto x = run(*motion, {0, 0}, 3);
  EXPECT_EQ(x[0], -1);
  EXPECT_EQ(x[1], 0);
  double expected = std::sqrt(2 / kGravity), hop = expected;
  std::size_t bounces = 0;
  for (const auto& e : motion->happened()) {
    if (e.kind != sim::MotionEvent::Kind::limit) continue;
    EXPECT_NEAR(e.time, expected, 1e-9) << "bounce " << bounces;
    expected += hop;
    hop /= 2;
    ++bounces;
  }
  EXPECT_GT(bounces, 8U);
  // What holds it is its weight, and a pull beyond that lifts it.
  sim::MechanismMotion::Forces f;
  ASSERT_TRUE(motion->forces(3, x, f).ok());
  EXPECT_NEAR(f.stop[0], kGravity, 1e-9);
  const std::vector<double> lift{12};
  motion->set_torques(lift);
  const auto up = run(*motion, x, 1);
  EXPECT_NEAR(up[0], -1 + (12 - kGravity) / 2, 1e-8);
}

TEST_F(Motion, AStopOfOneJointKicksTheOthersSoThatMomentumIsKept) {
  // Two blocks, the second slides on the first: the stop between them acts on both.
  RobotModel m = rail();
  add_joint(m, "upper", 0, JointType::prismatic, Pose{}, body(1, 0, 0, 0, 0.01, 0.01, 0.01));
  m.joints[1].upper = 0.5;
  m.number_coordinates();
  sim::MotionOptions o;
  o.restitution = 0.4;
  auto motion = make(m, o);
  const auto x = run(*motion, {0, 0, 0, 1}, 1);
  // Relative speed 1 becomes -0.4; 2 kg and 1 kg share the momentum 1.
  EXPECT_NEAR(x[3], -0.4, 1e-12);
  EXPECT_NEAR(2 * x[2] + 1 * (x[2] + x[3]), 1, 1e-12);
}

TEST_F(Motion, AFourBarKeepsItsLoopClosedAndItsEnergy) {
  auto motion = make(conformance::four_bar(1, 0.3, 0.9, 0.7), free_of_limits(), "constrained");
  const double crank = 1.2;
  // The rocker's angle where the loop closes, by the law of cosines.
  const double ax = 0.3 * std::cos(crank), ay = 0.3 * std::sin(crank);
  const double d = std::hypot(1 - ax, ay), to = std::atan2(ay, ax - 1);
  const double rocker = to - std::acos((d * d + 0.7 * 0.7 - 0.9 * 0.9) / (2 * d * 0.7));
  const double bx = 1 + 0.7 * std::cos(rocker), by = 0.7 * std::sin(rocker);
  std::vector<double> x0{crank, std::atan2(by - ay, bx - ax) - crank, rocker, 0, 0, 0};
  const double before = energy(x0, "newton_euler");
  const auto x = run(*motion, x0, 1);
  EXPECT_LT(motion->loop_error(std::span(x).first(3)), 1e-12);
  EXPECT_GT(std::fabs(x[0] - crank), 0.3) << "it has moved";
  EXPECT_NEAR(energy(x, "newton_euler"), before, 1e-8 * (1 + std::fabs(before)));
}

TEST_F(Motion, AFloatingBodyFallsFreelyAndItsQuaternionStaysOfLengthOne) {
  RobotModel m;
  m.name = "floater";
  add_joint(m, "body", -1, JointType::free, Pose{}, body(3, 0, 0, 0, 0.2, 0.3, 0.4));
  m.tips = {{"tip", 0, Pose{}}};
  m.number_coordinates();
  auto motion = make(m);
  // Spun about its middle axis, with a little about the others: it tumbles.
  const auto x = run(*motion, {0, 0, 0, 1, 0, 0, 0, 1, 0, 2, 0.05, 3, 0.02}, 2);
  EXPECT_NEAR(x[0], 2, 1e-8);
  EXPECT_NEAR(x[2], 4 - kGravity * 2, 1e-8);
  EXPECT_NEAR(x[3] * x[3] + x[4] * x[4] + x[5] * x[5] + x[6] * x[6], 1, 1e-14);
  // The angular momentum in the world is that of the start.
  const Pose turned = conformance::turn_quaternion(&x[3]);
  const double l[3] = {0.2 * x[10], 0.3 * x[11], 0.4 * x[12]};
  const double expected[3] = {0.2 * 0.05, 0.3 * 3, 0.4 * 0.02};
  for (std::size_t i = 0; i < 3; ++i) {
    const double world =
        turned.R[3 * i] * l[0] + turned.R[3 * i + 1] * l[1] + turned.R[3 * i + 2] * l[2];
    EXPECT_NEAR(world, expected[i], 1e-8);
  }
}

TEST_F(Motion, OnAnAcceleratedBaseAPendulumHangsAslant) {
  RobotModel m;
  m.name = "pendulum";
  add_joint(m, "pivot", -1, JointType::revolute, conformance::turn_x(conformance::kPi / 2),
            body(1, 0, -0.5, 0, 0.01, 0.01, 0.01));
  m.tips = {{"tip", 0, Pose{}}};
  m.number_coordinates();
  sim::MotionOptions o;
  const double a = 4;
  o.base = [=](double) -> Result<BaseMotion> {
    BaseMotion b;
    b.gravity = {0, 0, -kGravity};
    b.acceleration = {a, 0, 0};
    return b;
  };
  auto motion = make(m, o);
  // The mass stays where it hangs against a backward pull: at the angle -atan(a / g) about y.
  sim::MechanismMotion::Forces f;
  for (const double q : {-std::atan(a / kGravity), std::atan(a / kGravity)}) {
    const std::vector<double> x{q, 0};
    ASSERT_TRUE(motion->forces(0, x, f).ok());
    const auto frames = conformance::joint_frames(*model, x.data());
    const double hangs_at = conformance::multiply(frames[0], conformance::shift(0, -0.5, 0)).p[0];
    if (hangs_at < 0) EXPECT_NEAR(f.qdd[0], 0, 1e-10);
    else EXPECT_GT(std::fabs(f.qdd[0]), 1);
  }
}

TEST_F(Motion, ABaseWhoseMotionHasNoValueStopsTheRunWithTheReasonOfThat) {
  const auto base = sim::BasePath::by_expressions(
      {"1 m * sqrt(1 - time / 1 s)", "", "", "", "", ""}, Pose{}, 0, 0.9);
  ASSERT_TRUE(base.ok()) << base.error().sentence();
  EXPECT_TRUE(base->felt(0.5, Pose{}, {0, 0, -kGravity}).ok());
  sim::MotionOptions o;
  o.base = [&](double t) { return base->felt(t, Pose{}, {0, 0, -kGravity}); };
  auto motion = make(bare(conformance::planar_rods()), o);
  sim::MechanismMotion::Forces f;
  const std::vector<double> x(4, 0.0);
  EXPECT_TRUE(motion->forces(0.5, x, f).ok());
  const auto late = motion->forces(1.1, x, f);
  ASSERT_FALSE(late.ok());
  EXPECT_NE(late.error().sentence().find("base_motion.x"), std::string::npos)
      << late.error().sentence();
}

}  // namespace
}  // namespace robomosp
