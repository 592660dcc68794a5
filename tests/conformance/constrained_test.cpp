// SPDX-License-Identifier: Apache-2.0
// Provider "constrained": the SDK's suite of trees and of closed loops, and mechanisms whose
// equations are known in closed form.
#include <robomosp/sdk/conformance/dynamics_suite_loops.h>
#include <robomosp/sdk/conformance/mechanisms.h>

namespace robomosp::conformance {
namespace {

const std::string kFile = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_articulated.so";
const std::string kInverse = std::string(ROBOMOSP_PLUGIN_DIR) + "/dynamics_newton_euler.so";

/// A slider-crank in the xy plane: a crank of 0.2 m, a rod of 0.5 m whose end slides along x.
RobotModel slider_crank() {
  const auto rod = [](double l) { return body(l, l / 2, 0, 0, 0, l * l * l / 12, l * l * l / 12); };
  RobotModel m;
  m.name = "slider-crank";
  m.gravity = {0, -9.81, 0};
  add_joint(m, "crank", -1, JointType::revolute, Pose{}, rod(0.2));
  add_joint(m, "rod", 0, JointType::revolute, shift(0.2, 0, 0), rod(0.5));
  add_joint(m, "piston", -1, JointType::prismatic, turn_y(kPi / 2), body(0.8, 0, 0, 0, 0, 0, 0));
  m.loops = {{"pin", 1, 2, shift(0.5, 0, 0), Pose{}, kLoopX | kLoopY}};
  m.tips = {{"pin", 1, shift(0.5, 0, 0)}};
  m.number_coordinates();
  return m;
}

/// The four-bar whose loop is closed by a hinge in space: three of its five directions are implied
/// by the joints.
RobotModel redundant_four_bar() {
  RobotModel m = four_bar(1, 0.3, 0.9, 0.7);
  m.name = "redundant four-bar";
  m.loops[0].fixed = kLoopRevolute;
  m.joints[0].spring = {3, 0.4};
  return m;
}

/// A floating body with two arms whose hands hold each other: a weld, a ball, or one fixed turn.
RobotModel hands_together(const char* name, std::uint32_t fixed) {
  RobotModel m = floating_manipulator();
  m.name = name;
  add_joint(m, "second elbow", 6, JointType::spherical, shift(0.4, 0, 0),
            body(0.7, 0.1, 0.02, 0, 0.004, 0.01, 0.01));
  add_joint(m, "second wrist", 7, JointType::spherical, shift(0.3, 0, 0),
            body(0.5, 0.1, 0, 0.03, 0.002, 0.004, 0.004));
  m.loops = {{"hands", 3, 8, shift(0, 0, 0.15), multiply(shift(0.2, 0, 0), turn_x(0.3)), fixed}};
  m.number_coordinates();
  return m;
}

INSTANTIATE_TEST_SUITE_P(Constrained, DynamicsConformance,
                         testing::ValuesIn(with_inverse_of(
                             kInverse, dynamics_cases(kFile, "newton_euler", "constrained",
                                                      {puma560(), pa10_nus(), scara(), tree(),
                                                       floating_manipulator(), long_chain(30)}))),
                         dynamics_case_name);
INSTANTIATE_TEST_SUITE_P(Constrained, LoopConformance,
                         testing::ValuesIn(dynamics_cases(
                             kFile, "", "constrained",
                             {four_bar(1, 0.3, 0.9, 0.7), redundant_four_bar(), slider_crank(),
                              hands_together("hands welded", kLoopWeld),
                              hands_together("hands hinged", kLoopRevolute),
                              hands_together("hands at a point", kLoopPoint),
                              hands_together("hands with one turn", kLoopPoint | kLoopRotY)})),
                         dynamics_case_name);

struct Answer {
  std::vector<double> qdd, forces;
};
Answer solved(const RobotModel& m, const std::vector<double>& q, const std::vector<double>& qd,
              const std::vector<double>& tau, const std::vector<TipWrench>& tip = {}) {
  const rmp_provider* provider = *find_provider<ForwardDynamics>(kFile, "constrained");
  auto solver = create<ForwardDynamics>(*provider);
  const auto prepared = solver->prepare(m, TableParams(*provider));
  EXPECT_TRUE(prepared.ok()) << prepared.error().sentence();
  std::vector<double> scratch(solver->scratch_size());
  DynamicsBatch b;
  b.count = 1, b.q = q, b.qd = qd, b.tau = tau, b.tip = tip, b.scratch = scratch;
  Answer a{std::vector<double>(m.dof()), std::vector<double>(loop_residuals(m, q).size())};
  NoProgress none;
  const auto r = solver->constrained(b, a.qdd, a.forces, none);
  EXPECT_TRUE(r.ok()) << r.error().sentence();
  return a;
}

/// Uniform slender rods of 1 kg/m under weight along -y: what the angle of the first says of all.
struct OneFreedom {
  std::vector<double> q, rate;  ///< coordinates, and their derivatives by the angle
  double inertia = 0, potential = 0;
};
/// Eksergian's equation of a machine of one freedom: J a + J' w^2 / 2 + V' = tau (Eksergian,
/// Dynamical Analysis of Machines, J. Franklin Inst. 1930).
template <class Linkage>
double acceleration_of(const Linkage& at, double angle, double speed, double torque) {
  const double J = at(angle).inertia;
  const double Jd = difference([&](double h) { return at(angle + h).inertia; }, 1e-3);
  const double Vd = difference([&](double h) { return at(angle + h).potential; }, 1e-3);
  return (torque - Vd - 0.5 * Jd * speed * speed) / J;
}

OneFreedom four_bar_at(double g, double a, double b, double c, double t) {
  // Freudenstein's triangle: crank's end, rocker's pivot, the pin.
  const double x = g - a * std::cos(t), y = -a * std::sin(t), d = std::hypot(x, y);
  const double u = std::atan2(y, x) + std::acos((d * d + b * b - c * c) / (2 * d * b));
  const double v = std::atan2(b * std::sin(u) - y, b * std::cos(u) - x);
  const double ku = -a * std::sin(v - t) / (b * std::sin(v - u)),
               kv = a * std::sin(u - t) / (c * std::sin(u - v));
  const double gx = -a * std::sin(t) - b / 2 * std::sin(u) * ku,
               gy = a * std::cos(t) + b / 2 * std::cos(u) * ku;
  OneFreedom o;
  o.q = {t, u - t, v};
  o.rate = {1, ku - 1, kv};
  o.inertia =
      a * a * a / 3 + b * (gx * gx + gy * gy) + b * b * b / 12 * ku * ku + c * c * c / 3 * kv * kv;
  o.potential = 9.81 * (a * a / 2 * std::sin(t) + b * (a * std::sin(t) + b / 2 * std::sin(u)) +
                        c * c / 2 * std::sin(v));
  return o;
}

OneFreedom slider_crank_at(double t) {
  const double r = 0.2, l = 0.5, piston = 0.8;
  const double u = std::asin(-r * std::sin(t) / l), k = -r * std::cos(t) / (l * std::cos(u));
  const double gx = -r * std::sin(t) - l / 2 * std::sin(u) * k,
               gy = r * std::cos(t) + l / 2 * std::cos(u) * k,
               x = -r * std::sin(t) - l * std::sin(u) * k;
  OneFreedom o;
  o.q = {t, u - t, r * std::cos(t) + l * std::cos(u)};
  o.rate = {1, k - 1, x};
  o.inertia = r * r * r / 3 + l * (gx * gx + gy * gy) + l * l * l / 12 * k * k + piston * x * x;
  o.potential = 9.81 * (r * r / 2 * std::sin(t) + l * (r * std::sin(t) + l / 2 * std::sin(u)));
  return o;
}

template <class Linkage>
void expect_motion(const RobotModel& m, const Linkage& at) {
  for (const double angle : {0.3, 1.2, 2.2, 4.0, 5.5})
    for (const double speed : {0.0, 3.0}) {
      const OneFreedom o = at(angle);
      for (const double gap : loop_residuals(m, o.q)) ASSERT_NEAR(gap, 0, 1e-14);
      std::vector<double> qd = o.rate;
      for (double& x : qd) x *= speed;
      const auto a = solved(m, o.q, qd, {0.7, 0, 0});
      const double expected = acceleration_of(at, angle, speed, 0.7);
      EXPECT_NEAR(a.qdd[0], expected, 1e-9 * (1 + std::fabs(expected)))
          << m.name << " at " << angle;
    }
}

TEST(ClosedForms, TheFourBarFollowsItsEquation) {
  expect_motion(four_bar(1, 0.3, 0.9, 0.7),
                [](double t) { return four_bar_at(1, 0.3, 0.9, 0.7, t); });
}
TEST(ClosedForms, TheSliderCrankFollowsItsEquation) {
  expect_motion(slider_crank(), [](double t) { return slider_crank_at(t); });
}

TEST(ClosedForms, ALoadedStewartPlatformStandsOnItsLegsForces) {
  RobotModel m;
  m.name = "stewart platform";
  m.gravity = {0, 0, 0};
  add_joint(m, "platform", -1, JointType::free, Pose{}, body(8, 0, 0, 0, 0.4, 0.4, 0.7));
  const Pose stand = multiply(shift(0.05, -0.03, 0.7), multiply(turn_x(0.15), turn_z(0.1)));
  const double half = std::cos(0.15 / 2), quarter = std::cos(0.05);
  std::vector<double> q{0.05,
                        -0.03,
                        0.7,
                        half * quarter,
                        std::sin(0.15 / 2) * quarter,
                        -std::sin(0.15 / 2) * std::sin(0.05),
                        half * std::sin(0.05)};
  std::vector<Vec3> way, point;
  for (std::int32_t i = 0; i < 6; ++i) {
    const double low = kPi / 3 * (i / 2 * 2) + (i % 2 ? 0.9 : 0.15),
                 high = kPi / 3 * (i / 2 * 2) + (i % 2 ? 0.65 : 0.4);
    const Vec3 b{0.6 * std::cos(low), 0.6 * std::sin(low), 0};
    const Pose p = shift(0.35 * std::cos(high), 0.35 * std::sin(high), -0.02);
    const Vec3 end = multiply(stand, p).p;
    const Vec3 along{end[0] - b[0], end[1] - b[1], end[2] - b[2]};
    const double l = std::sqrt(dotted(along, along));
    const std::int32_t first = 1 + 3 * i;
    // A universal joint, x then y, and a slide along z.
    add_joint(m, "x", -1, JointType::revolute, multiply(shift(b[0], b[1], 0), turn_y(kPi / 2)),
              body(0.1, 0, 0, 0, 1e-3, 1e-3, 1e-3));
    add_joint(m, "y", first, JointType::revolute, multiply(turn_y(-kPi / 2), turn_x(-kPi / 2)),
              body(0.1, 0, 0, 0, 1e-3, 1e-3, 1e-3));
    add_joint(m, "leg", first + 1, JointType::prismatic, turn_x(kPi / 2),
              body(0.5, 0, 0, -0.2, 5e-3, 5e-3, 1e-4));
    m.loops.push_back({"ball", first + 2, 0, Pose{}, p, kLoopPoint});
    q.push_back(std::atan2(-along[1], along[2]));
    q.push_back(std::asin(along[0] / l));
    q.push_back(l);
    way.push_back({along[0] / l, along[1] / l, along[2] / l});
    point.push_back(end);
  }
  m.tips = {{"table", 0, shift(0, 0, 0.1)}};
  m.number_coordinates();
  for (const double gap : loop_residuals(m, q)) ASSERT_NEAR(gap, 0, 1e-14);
  // Balance of the platform: the legs' forces against the load.
  const TipWrench load{{30, -20, -150}, {4, 5, -3}};
  const Vec3 arm = crossed(multiply(stand, shift(0, 0, 0.1)).p, load.force);
  double A[6][7];
  for (std::size_t i = 0; i < 6; ++i) {
    const Vec3 moment = crossed(point[i], way[i]);
    for (std::size_t k = 0; k < 3; ++k) A[k][i] = way[i][k], A[k + 3][i] = moment[k];
  }
  for (std::size_t k = 0; k < 3; ++k)
    A[k][6] = -load.force[k], A[k + 3][6] = -(load.moment[k] + arm[k]);
  for (std::size_t k = 0; k < 6; ++k) {
    std::size_t p = k;
    for (std::size_t i = k; i < 6; ++i)
      if (std::fabs(A[i][k]) > std::fabs(A[p][k])) p = i;
    std::swap(A[k], A[p]);
    for (std::size_t i = 0; i < 6; ++i) {
      const double f = i == k ? 0 : A[i][k] / A[k][k];
      for (std::size_t j = k; j < 7; ++j) A[i][j] -= f * A[k][j];
    }
  }
  std::vector<double> tau(m.dof());
  for (std::size_t i = 0; i < 6; ++i) tau[6 + 3 * i + 2] = A[i][6] / A[i][i];
  const auto a = solved(m, q, std::vector<double>(m.dof()), tau, {load});
  for (const double x : a.qdd) EXPECT_NEAR(x, 0, 1e-9);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(a.forces[3 * i], 0, 1e-9) << "leg " << i + 1;
    EXPECT_NEAR(a.forces[3 * i + 1], 0, 1e-9) << "leg " << i + 1;
    EXPECT_NEAR(a.forces[3 * i + 2], tau[6 + 3 * i + 2], 1e-9) << "leg " << i + 1;
  }
}

}  // namespace
}  // namespace robomosp::conformance
