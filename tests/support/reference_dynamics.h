// SPDX-License-Identifier: Apache-2.0
// Inverse dynamics by virtual power (Kane): tau_j = sum over bodies of m (a_c - g) . dv_c/dqd_j +
// (I alpha + w x I w) . dw/dqd_j, everything in the base frame from geometric Jacobians. Shares no
// recursion, frame or formula with the solvers it checks.
#pragma once

#include <cmath>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::test {

inline std::vector<double> reference_torques(const RobotModel& model, const std::vector<double>& q,
                                             const std::vector<double>& qd,
                                             const std::vector<double>& qdd) {
  using M = std::array<double, 9>;
  const auto mul = [](const M& a, const M& b) {
    M c{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < 3; ++k) c[3 * i + j] += a[3 * i + k] * b[3 * k + j];
    return c;
  };
  const auto apply = [](const M& a, const Vec3& v) {
    return Vec3{a[0] * v[0] + a[1] * v[1] + a[2] * v[2], a[3] * v[0] + a[4] * v[1] + a[5] * v[2],
                a[6] * v[0] + a[7] * v[1] + a[8] * v[2]};
  };
  const auto plus = [](const Vec3& a, const Vec3& b) {
    return Vec3{a[0] + b[0], a[1] + b[1], a[2] + b[2]};
  };
  const auto minus = [](const Vec3& a, const Vec3& b) {
    return Vec3{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  };
  const auto times = [](double s, const Vec3& a) { return Vec3{s * a[0], s * a[1], s * a[2]}; };
  const auto cross = [](const Vec3& a, const Vec3& b) {
    return Vec3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
  };
  const auto dot = [](const Vec3& a, const Vec3& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  };

  const std::size_t n = model.dof();
  std::vector<M> R(n);
  std::vector<Vec3> p(n), z(n);
  for (std::size_t i = 0; i < n; ++i) {
    const JointModel& j = model.joints[i];
    const M parent =
        j.parent < 0 ? M{1, 0, 0, 0, 1, 0, 0, 0, 1} : R[static_cast<std::size_t>(j.parent)];
    const Vec3 origin = j.parent < 0 ? Vec3{} : p[static_cast<std::size_t>(j.parent)];
    R[i] = mul(parent, j.placement.R);
    p[i] = plus(origin, apply(parent, j.placement.p));
    if (j.type == JointType::revolute)
      R[i] = mul(R[i],
                 {std::cos(q[i]), -std::sin(q[i]), 0, std::sin(q[i]), std::cos(q[i]), 0, 0, 0, 1});
    z[i] = {R[i][2], R[i][5], R[i][8]};
    if (j.type == JointType::prismatic) p[i] = plus(p[i], times(q[i], z[i]));
  }
  std::vector<double> tau(n, 0.0);
  for (std::size_t b = 0; b < n; ++b) {
    std::vector<std::size_t> chain;  // from the body to the base
    for (std::int32_t i = static_cast<std::int32_t>(b); i >= 0;
         i = model.joints[static_cast<std::size_t>(i)].parent)
      chain.push_back(static_cast<std::size_t>(i));
    const MassProperties& body = model.joints[b].body;
    const Vec3 c = plus(p[b], apply(R[b], body.com));
    // Partial velocities of the body and their rates of change.
    Vec3 w{}, w_dot{}, acceleration{};
    for (auto it = chain.rbegin(); it != chain.rend(); ++it)
      if (model.joints[*it].type == JointType::revolute) w = plus(w, times(qd[*it], z[*it]));
    // Velocity of any point of joint i's parent side: sum over the chain below it.
    const auto omega_before = [&](std::size_t i) {
      Vec3 s{};
      for (std::int32_t k = model.joints[i].parent; k >= 0;
           k = model.joints[static_cast<std::size_t>(k)].parent)
        if (model.joints[static_cast<std::size_t>(k)].type == JointType::revolute)
          s = plus(s, times(qd[static_cast<std::size_t>(k)], z[static_cast<std::size_t>(k)]));
      return s;
    };
    const auto velocity = [&](const Vec3& x,
                              std::size_t last) {  // of point x fixed to joint `last`
      Vec3 v{};
      for (std::int32_t k = static_cast<std::int32_t>(last); k >= 0;
           k = model.joints[static_cast<std::size_t>(k)].parent) {
        const auto i = static_cast<std::size_t>(k);
        v = plus(v, times(qd[i], model.joints[i].type == JointType::revolute
                                     ? cross(z[i], minus(x, p[i]))
                                     : z[i]));
      }
      return v;
    };
    const Vec3 vc = velocity(c, b);
    for (const std::size_t i : chain) {
      const Vec3 z_dot = cross(omega_before(i), z[i]);
      if (model.joints[i].type == JointType::revolute) {
        w_dot = plus(w_dot, plus(times(qdd[i], z[i]), times(qd[i], z_dot)));
        const Vec3 r = minus(c, p[i]);
        const Vec3 r_dot = minus(vc, velocity(p[i], i));
        acceleration =
            plus(acceleration, plus(times(qdd[i], cross(z[i], r)),
                                    times(qd[i], plus(cross(z_dot, r), cross(z[i], r_dot)))));
      } else {
        acceleration = plus(acceleration, plus(times(qdd[i], z[i]), times(qd[i], z_dot)));
      }
    }
    const Sym3& s = body.inertia;
    const M inertia =
        mul(mul(R[b], {s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz}),
            {R[b][0], R[b][3], R[b][6], R[b][1], R[b][4], R[b][7], R[b][2], R[b][5], R[b][8]});
    const Vec3 force = times(body.mass, minus(acceleration, model.gravity));
    const Vec3 moment = plus(apply(inertia, w_dot), cross(w, apply(inertia, w)));
    for (const std::size_t i : chain)
      tau[i] += model.joints[i].type == JointType::revolute
                    ? dot(force, cross(z[i], minus(c, p[i]))) + dot(moment, z[i])
                    : dot(force, z[i]);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const JointFriction& f = model.joints[i].friction;
    tau[i] += model.joints[i].armature * qdd[i] + f.viscous * qd[i];
    if (qd[i] > 0) tau[i] += f.coulomb_positive;
    if (qd[i] < 0) tau[i] += f.coulomb_negative;
  }
  return tau;
}

}  // namespace robomosp::test
