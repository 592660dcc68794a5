// SPDX-License-Identifier: Apache-2.0
// Mechanisms for conformance suites, filled by hand from published tables, and a forward
// kinematics implementation to judge solvers by (layer: contract helper for tests, header-only).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp::conformance {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kDeg = kPi / 180;

/// a_T_c = a_T_b b_T_c, element by element.
[[nodiscard]] inline Pose multiply(const Pose& a, const Pose& b) {
  Pose c;
  for (std::size_t i = 0; i < 3; ++i) {
    c.p[i] = a.p[i];
    for (std::size_t j = 0; j < 3; ++j) {
      c.R[3 * i + j] = 0;
      for (std::size_t k = 0; k < 3; ++k) c.R[3 * i + j] += a.R[3 * i + k] * b.R[3 * k + j];
      c.p[i] += a.R[3 * i + j] * b.p[j];
    }
  }
  return c;
}
[[nodiscard]] inline Pose turn_x(double t) {
  Pose a;
  a.R = {1, 0, 0, 0, std::cos(t), -std::sin(t), 0, std::sin(t), std::cos(t)};
  return a;
}
[[nodiscard]] inline Pose turn_y(double t) {
  Pose a;
  a.R = {std::cos(t), 0, std::sin(t), 0, 1, 0, -std::sin(t), 0, std::cos(t)};
  return a;
}
[[nodiscard]] inline Pose turn_z(double t) {
  Pose a;
  a.R = {std::cos(t), -std::sin(t), 0, std::sin(t), std::cos(t), 0, 0, 0, 1};
  return a;
}
[[nodiscard]] inline Pose shift(double x, double y, double z) {
  Pose a;
  a.p = {x, y, z};
  return a;
}

/// Rotation by a quaternion w x y z of any length.
[[nodiscard]] inline Pose turn_quaternion(const double* q) {
  const double w = q[0], x = q[1], y = q[2], z = q[3];
  const double n = w * w + x * x + y * y + z * z;
  Pose a;
  a.R = {(w * w + x * x - y * y - z * z) / n,
         2 * (x * y - w * z) / n,
         2 * (x * z + w * y) / n,
         2 * (x * y + w * z) / n,
         (w * w - x * x + y * y - z * z) / n,
         2 * (y * z - w * x) / n,
         2 * (x * z - w * y) / n,
         2 * (y * z + w * x) / n,
         (w * w - x * x - y * y + z * z) / n};
  return a;
}

/// How a joint has moved from rest, J(q).
[[nodiscard]] inline Pose joint_motion(const JointModel& j, const double* q) {
  const double* own = q + j.q_index;
  const double x = j.is_coupled() ? j.coupling.ratio * own[0] + j.coupling.offset : own[0];
  switch (j.type) {
    case JointType::revolute: return turn_z(x);
    case JointType::prismatic: return shift(0, 0, x);
    case JointType::spherical: return turn_quaternion(own);
    case JointType::free: return multiply(shift(own[0], own[1], own[2]), turn_quaternion(own + 3));
  }
  return {};
}

/// The configuration after moving for `seconds` with constant velocities qd.
[[nodiscard]] inline std::vector<double> advanced(const RobotModel& m, const double* q,
                                                  const double* qd, double seconds) {
  std::vector<double> out(q, q + m.coordinate_count());
  // a := a * exp(w seconds / 2), the velocity being in the moving frame.
  const auto turn = [&](double* a, const double* w) {
    const double speed = std::sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    const double half = speed * seconds / 2;
    const double s = speed > 0 ? std::sin(half) / speed : 0, c = std::cos(half);
    const double b[4] = {c, s * w[0], s * w[1], s * w[2]};
    const double r[4] = {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                         a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                         a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
                         a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
    std::copy(r, r + 4, a);
  };
  for (const JointModel& j : m.joints) {
    if (j.is_coupled()) continue;
    double* own = out.data() + j.q_index;
    const double* v = qd + j.v_index;
    switch (j.type) {
      case JointType::revolute:
      case JointType::prismatic: own[0] += seconds * v[0]; break;
      case JointType::spherical: turn(own, v); break;
      case JointType::free: {
        // v is constant in the moving frame: the origin follows a screw, integrated by Gauss
        // points.
        const double x[3] = {0.5 - std::sqrt(0.15), 0.5, 0.5 + std::sqrt(0.15)};
        const double weight[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
        Vec3 way{};
        for (std::size_t g = 0; g < 3; ++g) {
          double at[4] = {own[3], own[4], own[5], own[6]};
          const double whole = seconds;
          seconds = whole * x[g];
          turn(at, v + 3);
          seconds = whole;
          const Pose t = turn_quaternion(at);
          for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 3; ++c)
              way[r] += weight[g] * seconds * t.R[3 * r + c] * v[c];
        }
        for (std::size_t r = 0; r < 3; ++r) own[r] += way[r];
        turn(own + 3, v + 3);
        break;
      }
    }
  }
  return out;
}

/// base_T_joint of all joints, plainly.
[[nodiscard]] inline std::vector<Pose> joint_frames(const RobotModel& m, const double* q) {
  std::vector<Pose> f(m.joints.size());
  for (std::size_t i = 0; i < m.joints.size(); ++i) {
    const JointModel& j = m.joints[i];
    const Pose motion = joint_motion(j, q);
    const Pose local = multiply(j.placement, motion);
    f[i] = j.parent < 0 ? local : multiply(f[static_cast<std::size_t>(j.parent)], local);
  }
  return f;
}
/// base_T_tip.
[[nodiscard]] inline Pose tip_pose(const RobotModel& m, const double* q, std::size_t tip = 0) {
  const std::int32_t j = m.tips[tip].joint;
  return j < 0 ? m.tips[tip].tool
               : multiply(joint_frames(m, q)[static_cast<std::size_t>(j)], m.tips[tip].tool);
}
/// Distance of the origins [m].
[[nodiscard]] inline double position_gap(const Pose& a, const Pose& b) {
  return std::hypot(a.p[0] - b.p[0], a.p[1] - b.p[1], a.p[2] - b.p[2]);
}
/// Angle between two orientations, from the distance of the matrices: accurate for small and
/// large angles alike [rad].
[[nodiscard]] inline double rotation_gap(const Pose& a, const Pose& b) {
  double s = 0;
  for (std::size_t i = 0; i < 9; ++i) s += (a.R[i] - b.R[i]) * (a.R[i] - b.R[i]);
  return 2 * std::asin(std::min(1.0, std::sqrt(s / 8)));
}

/// One row of a published table: lengths in m, angles in rad, drive at the motor.
struct Row {
  double theta = 0, d = 0, a = 0, alpha = 0;
  double lower_deg = -180, upper_deg = 180;
  MassProperties mass;
  double Jm = 0, G = 0, B = 0, Tc_plus = 0, Tc_minus = 0;
  bool slides = false;  ///< limits are then in m
};

[[nodiscard]] inline MassProperties body(double m, double x, double y, double z, double xx,
                                         double yy, double zz, double xy = 0, double yz = 0,
                                         double xz = 0) {
  return {m, {x, y, z}, {xx, yy, zz, xy, yz, xz}};
}

/// R s R^T by triple sums.
[[nodiscard]] inline MassProperties moved(const MassProperties& m, const Pose& t) {
  const double s[9] = {m.inertia.xx, m.inertia.xy, m.inertia.xz, m.inertia.xy, m.inertia.yy,
                       m.inertia.yz, m.inertia.xz, m.inertia.yz, m.inertia.zz};
  double r[9] = {};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t l = 0; l < 3; ++l)
          r[3 * i + j] += t.R[3 * i + k] * s[3 * k + l] * t.R[3 * j + l];
  const Pose c = multiply(t, shift(m.com[0], m.com[1], m.com[2]));
  return {m.mass, c.p, {r[0], r[4], r[8], r[1], r[5], r[2]}};
}

/// A serial model from rows of either convention.
[[nodiscard]] inline RobotModel serial(std::string name, bool modified,
                                       const std::vector<Row>& rows, const Pose& tool = {}) {
  RobotModel m;
  m.name = std::move(name);
  Pose parent_link;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Row& r = rows[i];
    JointModel j;
    j.name = "joint " + std::to_string(i + 1);
    j.type = r.slides ? JointType::prismatic : JointType::revolute;
    j.parent = static_cast<std::int32_t>(i) - 1;
    const Pose along = multiply(turn_z(r.theta), shift(0, 0, r.d));
    const Pose across = multiply(shift(r.a, 0, 0), turn_x(r.alpha));
    j.placement = modified ? multiply(across, along) : multiply(parent_link, along);
    if (!modified) j.link = across;
    parent_link = j.link;
    j.body = moved(r.mass, j.link);
    const double unit = r.slides ? 1 : kDeg;
    j.lower = r.lower_deg * unit;
    j.upper = r.upper_deg * unit;
    j.armature = r.G * r.G * r.Jm;
    j.friction = {r.G * r.G * r.B, std::fabs(r.G) * r.Tc_plus, std::fabs(r.G) * r.Tc_minus};
    m.joints.push_back(j);
  }
  m.tips.push_back(
      {"tool", static_cast<std::int32_t>(rows.size()) - 1, multiply(parent_link, tool)});
  m.number_coordinates();
  return m;
}

/// PUMA 560, standard DH (Corke & Armstrong 1994, Robotics Toolbox mdl_puma560).
[[nodiscard]] inline RobotModel puma560() {
  const double r = kPi / 2;
  return serial(
      "puma560", false,
      {{0, 0, 0, r, -160, 160, body(0, 0, 0, 0, 0, 0.35, 0), 200e-6, -62.6111, 1.48e-3, 0.395,
        -0.435},
       {0, 0, 0.4318, 0, -45, 225, body(17.4, -0.3638, 0.006, 0.2275, 0.13, 0.524, 0.539), 200e-6,
        107.815, 0.817e-3, 0.126, -0.071},
       {0, 0.15005, 0.0203, -r, -225, 45, body(4.8, -0.0203, -0.0141, 0.07, 0.066, 0.086, 0.0125),
        200e-6, -53.7063, 1.38e-3, 0.132, -0.105},
       {0, 0.4318, 0, r, -110, 170, body(0.82, 0, 0.019, 0, 1.8e-3, 1.3e-3, 1.8e-3), 33e-6, 76.0364,
        71.2e-6, 11.2e-3, -16.9e-3},
       {0, 0, 0, -r, -100, 100, body(0.34, 0, 0, 0, 0.3e-3, 0.4e-3, 0.3e-3), 33e-6, 71.923, 82.6e-6,
        9.26e-3, -14.5e-3},
       {0, 0, 0, 0, -266, 266, body(0.09, 0, 0, 0.032, 0.15e-3, 0.15e-3, 0.04e-3), 33e-6, 76.686,
        36.7e-6, 3.96e-3, -10.5e-3}});
}

/// PUMA 560, modified DH (Armstrong, Khatib & Burdick 1986, mdl_puma560akb).
[[nodiscard]] inline RobotModel puma560_modified() {
  const double r = kPi / 2;
  return serial(
      "puma560akb", true,
      {{0, 0, 0, 0, -160, 160, body(0, 0, 0, 0, 0, 0, 0.35), 291e-6, -62.6111},
       {0, 0.2435, 0, -r, -225, 45, body(17.4, 0.068, 0.006, -0.016, 0.13, 0.524, 0.539), 409e-6,
        107.815},
       {0, -0.0934, 0.4318, 0, -45, 225, body(4.8, 0, -0.07, 0.014, 0.066, 0.0125, 0.066), 299e-6,
        -53.7063},
       {0, 0.4331, -0.0203, r, -110, 170, body(0.82, 0, 0, -0.019, 1.8e-3, 1.8e-3, 1.3e-3), 35e-6,
        76.0364},
       {0, 0, 0, -r, -100, 100, body(0.34, 0, 0, 0, 0.3e-3, 0.3e-3, 0.4e-3), 35e-6, 71.923},
       {0, 0, 0, r, -266, 266, body(0.09, 0, 0, 0.032, 0.15e-3, 0.15e-3, 0.04e-3), 35e-6, 76.686}});
}

/// Mitsubishi PA-10, modified DH, 317/450/480/70 mm (manual; INRIA HuMAnS 2005).
[[nodiscard]] inline RobotModel pa10() {
  const double r = kPi / 2;
  return serial(
      "pa10_7ce", true,
      {{0, 0.317, 0, 0, -177, 177, body(9.22, 0, 0, -0.01, 0.122706, 0.122706, 0.0530564), 0, 1,
        10},
       {0, 0, 0, -r, -94, 94, body(4.51, 0, -0.2, 0, 0.055035, 0.055035, 0.018144), 0, 1, 10},
       {0, 0.45, 0, r, -174, 174, body(5.64, 0, 0, -0.035, 0.008124, 0.008124, 0.00572413), 0, 1,
        5},
       {0, 0, 0, -r, -137, 137, body(2.04, 0, -0.115, 0, 0.008124, 0.008124, 0.00572413), 0, 1, 5},
       {0, 0.48, 0, r, -255, 255, body(2.61, 0, 0, -0.084, 0.00254601, 0.00254601, 0.00274735), 0,
        1, 2},
       {0, 0, 0, -r, -165, 165, body(2.07, 0, -0.042, 0, 0.002977, 0.002977, 0.001141), 0, 1, 2},
       {0, 0.07, 0, r, -360, 360, body(1.05, 0, 0, -0.048, 0.0005294, 0.0005294, 0.0004), 0, 1,
        2}});
}

/// Mitsubishi PA-10, standard DH, 315/450/500/80 mm (NUS; point masses, link-side motor inertia).
[[nodiscard]] inline RobotModel pa10_nus() {
  const double r = kPi / 2;
  return serial("pa10_nus", false,
                {{0, 0.315, 0, -r, -177, 177, body(9.78, 0, 0, 0, 0, 0, 0), 0.75, 1},
                 {0, 0, 0, r, -94, 94, body(8.41, 0, 0, 0.06325, 0, 0, 0), 0.75, 1},
                 {0, 0.45, 0, -r, -174, 174, body(3.51, 0, 0.08944, 0, 0, 0, 0), 0.2125, 1},
                 {0, 0, 0, r, -137, 137, body(4.31, 0, 0, 0.04609, 0, 0, 0), 0.2125, 1},
                 {0, 0.5, 0, -r, -255, 255, body(3.45, 0, 0.1647, 0, 0, 0, 0), 0.00575, 1},
                 {0, 0, 0, r, -165, 165, body(1.46, 0, 0, -0.03, 0, 0, 0), 0.00575, 1},
                 {0, 0.08, 0, 0, -360, 360, body(0.24, 0, 0, -0.029, 0, 0, 0), 0.00575, 1}});
}

/// Franka Panda, modified DH (Gaz et al., RA-L 2019, as in mdl_panda).
[[nodiscard]] inline RobotModel panda() {
  const double r = kPi / 2;
  return serial("panda", true,
                {{0, 0.333, 0, 0, -166, 166,
                  body(4.97068, 0.003875, 0.002081, 0, 0.70337, 0.70661, 0.009117, -0.000139,
                       0.019169, 0.006772)},
                 {0, 0, 0, -r, -101, 101,
                  body(0.646926, -0.003141, -0.02872, 0.003495, 0.007962, 0.02811, 0.025995,
                       -0.003925, 0.000704, 0.010254)},
                 {0, 0.316, 0, r, -166, 166,
                  body(3.2286, 0.027518, 0.039252, -0.066502, 0.037242, 0.036155, 0.01083,
                       -0.004761, -0.012805, -0.011396)},
                 {0, 0, 0.0825, r, -176, -4,
                  body(3.5879, -0.05317, 0.104419, 0.027454, 0.025853, 0.019552, 0.028323, 0.007796,
                       0.008641, -0.001332)},
                 {0, 0.384, -0.0825, -r, -166, 166,
                  body(1.22595, -0.011953, 0.041065, -0.038437, 0.035549, 0.029474, 0.008627,
                       -0.002117, 0.000229, -0.004037)},
                 {0, 0, 0, r, -1, 215,
                  body(1.66656, 0.060149, -0.014117, -0.010517, 0.001964, 0.004354, 0.005433,
                       0.000109, 0.000341, -0.001158)},
                 {0, 0.107, 0.088, r, -166, 166,
                  body(0.735522, 0.010517, -0.004252, 0.061597, 0.012516, 0.010027, 0.004815,
                       -0.000428, -0.000741, -0.001196)}},
                shift(0, 0, 0.11));
}

/// Two slender uniform rods in a vertical plane: l = 0.7, 0.45 m, m = 2.5, 1.2 kg, I = m l^2 / 12.
/// Joint axes are horizontal; gravity acts along -y of the base.
[[nodiscard]] inline RobotModel planar_rods() {
  const double l1 = 0.7, m1 = 2.5, l2 = 0.45, m2 = 1.2;
  const double i1 = m1 * l1 * l1 / 12, i2 = m2 * l2 * l2 / 12;
  RobotModel m = serial("planar2rods", false,
                        {{0, 0, l1, 0, -180, 180, body(m1, -l1 / 2, 0, 0, 0, i1, i1)},
                         {0, 0, l2, 0, -180, 180, body(m2, -l2 / 2, 0, 0, 0, i2, i2)}});
  m.gravity = {0, -9.81, 0};
  return m;
}

/// Adept Cobra 600 SCARA (mdl_cobra600; masses are test data, none are published).
[[nodiscard]] inline RobotModel scara() {
  return serial(
      "cobra600", false,
      {{0, 0.387, 0.325, 0, -50, 50,
        body(8.5, -0.17, 0.01, 0.02, 0.03, 0.11, 0.12, 0.002, -0.001, 0.003), 3e-5, 50},
       {0, 0, 0.275, kPi, -88, 88,
        body(6.2, -0.12, -0.008, 0.015, 0.02, 0.05, 0.06, 0.001, 0.0015, -0.002), 2e-5, 40},
       {0, 0, 0, 0, 0, 0.21, body(1.4, 0.002, 0.001, -0.1, 0.008, 0.008, 0.0006, 0, 0.0001, 0.0002),
        1e-5, 200, 0, 0, 0, true},
       {0, 0, 0, 0, -180, 180, body(0.6, 0.003, -0.002, 0.02, 0.0006, 0.0007, 0.0004), 5e-6, 20}});
}

/// A trunk that turns and carries two arms, one of 6 joints with a slide, one of 3.
[[nodiscard]] inline RobotModel tree() {
  RobotModel m;
  m.name = "two arms";
  const auto add = [&](std::int32_t parent, JointType type, const Pose& placement, double low,
                       double high, const MassProperties& mass) {
    JointModel j;
    j.name = "joint " + std::to_string(m.joints.size() + 1);
    j.type = type;
    j.parent = parent;
    j.placement = placement;
    j.lower = low;
    j.upper = high;
    j.body = mass;
    j.armature = 0.01;
    j.friction = {0.2, 0.1, -0.15};
    m.joints.push_back(j);
  };
  const auto turns = JointType::revolute;
  add(-1, turns, shift(0, 0, 0.5), -2, 2,
      body(10, 0.01, 0.02, 0.2, 0.4, 0.3, 0.2, 0.01, 0.02, -0.01));
  add(0, turns, multiply(shift(0, 0.2, 0.4), turn_x(-kPi / 2)), -2.5, 2.5,
      body(3, 0.1, 0, 0.02, 0.02, 0.05, 0.04));
  add(1, turns, multiply(shift(0.3, 0, 0), turn_x(0.4)), -2, 2,
      body(2, 0.15, 0.01, 0, 0.01, 0.02, 0.02, 0, 0.001, 0));
  add(2, JointType::prismatic, multiply(shift(0.2, 0, 0), turn_y(kPi / 2)), 0, 0.3,
      body(1, 0, 0, 0.1, 0.01, 0.01, 0.004));
  add(3, turns, shift(0, 0, 0.1), -3, 3, body(0.5, 0, 0.01, 0.05, 0.002, 0.002, 0.001));
  add(4, turns, turn_x(kPi / 2), -2, 2, body(0.4, 0, 0.02, 0, 0.001, 0.0012, 0.001));
  add(5, turns, multiply(turn_x(-kPi / 2), shift(0, 0, 0.08)), -3, 3,
      body(0.2, 0.01, 0, 0.03, 0.0004, 0.0004, 0.0002));
  add(0, turns, multiply(shift(0, -0.2, 0.4), turn_x(kPi / 2)), -2.5, 2.5,
      body(2.5, 0.1, 0.01, 0, 0.02, 0.04, 0.04));
  add(7, turns, shift(0.25, 0, 0), -2, 2, body(1.5, 0.1, 0, 0, 0.005, 0.01, 0.01));
  add(8, turns, multiply(shift(0.2, 0, 0), turn_y(kPi / 2)), -2, 2,
      body(0.6, 0.01, 0, 0.1, 0.002, 0.002, 0.001));
  m.tips = {{"left", 6, shift(0, 0, 0.05)}, {"right", 9, shift(0, 0, 0.12)}};
  m.number_coordinates();
  return m;
}

/// The same numbers on every machine: SplitMix64.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform(double low, double high) {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return low + (high - low) * static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1.0p-53;
  }
  /// A configuration within the limits (within one turn if it has none; free joints within
  /// 1 m). Limits of coupled joints are not looked at.
  std::vector<double> configuration(const RobotModel& m) {
    std::vector<double> q;
    for (const JointModel& j : m.joints) {
      if (j.is_coupled()) continue;
      if (j.type == JointType::revolute || j.type == JointType::prismatic) {
        q.push_back(uniform(std::max(j.lower, -2 * kPi), std::min(j.upper, 2 * kPi)));
        continue;
      }
      if (j.type == JointType::free)
        for (int k = 0; k < 3; ++k) q.push_back(uniform(-1, 1));
      double turn[4], length = 0;
      do {
        length = 0;
        for (double& x : turn) x = uniform(-1, 1), length += x * x;
      } while (length > 1 || length < 0.01);
      for (const double x : turn) q.push_back(x / std::sqrt(length));
    }
    return q;
  }
  std::vector<double> vector(std::size_t n, double low, double high) {
    std::vector<double> v(n);
    for (double& x : v) x = uniform(low, high);
    return v;
  }

 private:
  std::uint64_t state_;
};

/// Progress that counts questions and is cancelled from the start.
class CancelledProgress final : public Progress {
 public:
  void report(double, std::string_view) override {}
  [[nodiscard]] bool cancelled() const override { return true; }
};

}  // namespace robomosp::conformance
