// SPDX-License-Identifier: Apache-2.0
// What dynamics are judged by, computed from the bodies' frames alone, by differences in time and
// along velocities, independently of any recursion: energies, momentum, torques by Kane's
// equations, closed loops (layer: contract helper for tests, header-only).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <robomosp/sdk/conformance/models.h>
#include <robomosp/sdk/dynamics.h>

namespace robomosp::conformance {

/// The configuration after the small motion `h` along entry k of the velocities.
[[nodiscard]] inline std::vector<double> nudged(const RobotModel& m, const std::vector<double>& q,
                                                std::size_t k, double h) {
  std::vector<double> unit(m.dof());
  unit[k] = 1;
  return advanced(m, q.data(), unit.data(), h);
}
/// The configuration at time t of a motion that has velocities qd and accelerations qdd at 0; exact
/// to the third order of t.
[[nodiscard]] inline std::vector<double> moved_on(const RobotModel& m, const std::vector<double>& q,
                                                  const std::vector<double>& qd,
                                                  const std::vector<double>& qdd, double t) {
  std::vector<double> v = qd;
  for (std::size_t k = 0; k < v.size(); ++k) v[k] += 0.5 * t * qdd[k];
  return advanced(m, q.data(), v.data(), t);
}
/// Central difference of order four of f(h) at 0.
template <class F>
[[nodiscard]] auto difference(F&& f, double h) {
  return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h);
}
/// The axial vector of the skew part of A^T B.
[[nodiscard]] inline Vec3 axial(const double* A, const double* B) {
  double W[9] = {};
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) W[3 * r + c] += A[3 * k + r] * B[3 * k + c];
  return {(W[7] - W[5]) / 2, (W[2] - W[6]) / 2, (W[3] - W[1]) / 2};
}
[[nodiscard]] inline Vec3 times(const Sym3& I, const Vec3& v) {
  return {I.xx * v[0] + I.xy * v[1] + I.xz * v[2], I.xy * v[0] + I.yy * v[1] + I.yz * v[2],
          I.xz * v[0] + I.yz * v[1] + I.zz * v[2]};
}
[[nodiscard]] inline Vec3 crossed(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
[[nodiscard]] inline double dotted(const Vec3& a, const Vec3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Motion of a body: velocity of its centre of mass in the base's axes, turning in its own.
struct BodyRate {
  Pose pose;  ///< base_T_joint moved to the centre of mass
  Vec3 velocity{}, turning{};
};
/// Of all bodies for velocities qd: by differences of order four along the motion.
[[nodiscard]] inline std::vector<BodyRate> body_rates(const RobotModel& m,
                                                      const std::vector<double>& q,
                                                      const std::vector<double>& qd) {
  const double h = 1e-3;
  const double steps[4] = {-2, -1, 1, 2}, weights[4] = {1.0 / 12, -8.0 / 12, 8.0 / 12, -1.0 / 12};
  std::vector<Pose> at[4];
  for (int s = 0; s < 4; ++s)
    at[s] = joint_frames(m, advanced(m, q.data(), qd.data(), steps[s] * h).data());
  const std::vector<Pose> now = joint_frames(m, q.data());
  std::vector<BodyRate> out(m.joints.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3& com = m.joints[i].body.com;
    double Rd[9] = {};
    out[i].pose = multiply(now[i], shift(com[0], com[1], com[2]));
    for (int s = 0; s < 4; ++s) {
      const Pose c = multiply(at[s][i], shift(com[0], com[1], com[2]));
      for (std::size_t k = 0; k < 3; ++k) out[i].velocity[k] += weights[s] * c.p[k] / h;
      for (std::size_t k = 0; k < 9; ++k) Rd[k] += weights[s] * c.R[k] / h;
    }
    out[i].turning = axial(now[i].R.data(), Rd);
  }
  return out;
}

/// Kinetic energy of bodies and motors, momentum about the base's origin and centre of mass.
[[nodiscard]] inline Energy energy_of_motion(const RobotModel& m, const std::vector<double>& q,
                                             const std::vector<double>& qd) {
  const std::vector<BodyRate> rates = body_rates(m, q, qd);
  Energy e;
  double mass = 0;
  for (std::size_t i = 0; i < rates.size(); ++i) {
    const JointModel& joint = m.joints[i];
    const MassProperties& b = joint.body;
    const BodyRate& r = rates[i];
    const Vec3 spin = times(b.inertia, r.turning), arm = crossed(r.pose.p, r.velocity);
    e.kinetic += 0.5 * (b.mass * dotted(r.velocity, r.velocity) + dotted(spin, r.turning));
    mass += b.mass;
    for (std::size_t k = 0; k < 3; ++k) {
      e.momentum[k] += b.mass * r.velocity[k];
      e.com[k] += b.mass * r.pose.p[k];
      e.angular_momentum[k] += b.mass * arm[k];
      for (std::size_t l = 0; l < 3; ++l) e.angular_momentum[k] += r.pose.R[3 * k + l] * spin[l];
    }
    if (robomosp::velocity_count(joint.type) == 1) {
      const double rate = (joint.is_coupled() ? joint.coupling.ratio : 1) *
                          qd[static_cast<std::size_t>(joint.v_index)];
      e.kinetic += 0.5 * joint.armature * rate * rate;
    }
  }
  for (double& x : e.com) x /= mass;
  return e;
}
[[nodiscard]] inline double kinetic_energy(const RobotModel& m, const std::vector<double>& q,
                                           const std::vector<double>& qd) {
  return energy_of_motion(m, q, qd).kinetic;
}

/// Potential energy of the bodies' weight [J].
[[nodiscard]] inline double potential_energy(const RobotModel& m, const std::vector<double>& q) {
  const std::vector<Pose> now = joint_frames(m, q.data());
  double energy = 0;
  for (std::size_t i = 0; i < m.joints.size(); ++i) {
    const MassProperties& b = m.joints[i].body;
    const Pose c = multiply(now[i], shift(b.com[0], b.com[1], b.com[2]));
    energy -= b.mass * dotted(m.gravity, c.p);
  }
  return energy;
}
/// Potential energy of the joints' springs [J].
[[nodiscard]] inline double spring_energy(const RobotModel& m, const std::vector<double>& q) {
  double energy = 0;
  for (const JointModel& j : m.joints) {
    if (robomosp::coordinate_count(j.type) != 1 || j.spring.stiffness == 0) continue;
    const double own = q[static_cast<std::size_t>(j.q_index)];
    const double x = j.is_coupled() ? j.coupling.ratio * own + j.coupling.offset : own;
    energy += 0.5 * j.spring.stiffness * (x - j.spring.rest) * (x - j.spring.rest);
  }
  return energy;
}
/// Derivatives of a function of the configuration by the velocities.
template <class F>
[[nodiscard]] std::vector<double> gradient(const RobotModel& m, const std::vector<double>& q,
                                           F&& f) {
  std::vector<double> g(m.dof());
  for (std::size_t j = 0; j < g.size(); ++j)
    g[j] = difference([&](double h) { return f(m, nudged(m, q, j, h)); }, 2e-3);
  return g;
}
/// dV of the weight by the velocities [N m or N].
[[nodiscard]] inline std::vector<double> potential_gradient(const RobotModel& m,
                                                            const std::vector<double>& q) {
  return gradient(m, q, potential_energy);
}

/// tau for weight, inertia, velocity and motors by Kane's equations: tau_k = sum over the bodies of
/// m (a_c - g) . dv_c/dqd_k + (I w' + w x I w) . dw/dqd_k, with accelerations by differences of
/// order eight in time of the frames. The base may move.
[[nodiscard]] inline std::vector<double> kane_torques(const RobotModel& m,
                                                      const std::vector<double>& q,
                                                      const std::vector<double>& qd,
                                                      const std::vector<double>& qdd,
                                                      const BaseMotion* base = nullptr) {
  const std::size_t n = m.dof(), bodies = m.joints.size();
  double fastest = 1;
  for (std::size_t k = 0; k < n; ++k)
    fastest = std::max({fastest, std::fabs(qd[k]), std::sqrt(std::fabs(qdd[k]) / 5)});
  const double h = 0.02 / fastest;
  const double first[5] = {0, 4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  const double second[5] = {-205.0 / 72, 8.0 / 5, -1.0 / 5, 8.0 / 315, -1.0 / 560};
  std::vector<Vec3> acceleration(bodies);
  std::vector<std::array<double, 9>> Rd(bodies), Rdd(bodies);
  std::vector<Pose> now;
  for (int s = -4; s <= 4; ++s) {
    const double t = s * h, sign = s < 0 ? -1 : 1;
    const auto at = static_cast<std::size_t>(std::abs(s));
    std::vector<Pose> frames = joint_frames(m, moved_on(m, q, qd, qdd, t).data());
    Pose world;
    if (base) {
      double turn[3], angle = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        turn[k] = t * base->angular_velocity[k] + 0.5 * t * t * base->angular_acceleration[k];
        angle += turn[k] * turn[k];
      }
      angle = std::sqrt(angle);
      const double half = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
      const double quaternion[4] = {std::cos(angle / 2), half * turn[0], half * turn[1],
                                    half * turn[2]};
      world = turn_quaternion(quaternion);
      for (std::size_t k = 0; k < 3; ++k) world.p[k] = 0.5 * t * t * base->acceleration[k];
    }
    for (std::size_t i = 0; i < bodies; ++i) {
      const Vec3& com = m.joints[i].body.com;
      frames[i] = multiply(world, multiply(frames[i], shift(com[0], com[1], com[2])));
      for (std::size_t k = 0; k < 3; ++k)
        acceleration[i][k] += second[at] * frames[i].p[k] / (h * h);
      for (std::size_t k = 0; k < 9; ++k) {
        Rd[i][k] += sign * first[at] * frames[i].R[k] / h;
        Rdd[i][k] += second[at] * frames[i].R[k] / (h * h);
      }
    }
    if (s == 0) now = frames;
  }
  const Vec3 gravity = base ? base->gravity : m.gravity;
  std::vector<double> tau(n), unit(n);
  for (std::size_t k = 0; k < n; ++k) {
    unit.assign(n, 0.0);
    unit[k] = 1;
    const std::vector<BodyRate> partial = body_rates(m, q, unit);
    for (std::size_t i = 0; i < bodies; ++i) {
      const MassProperties& b = m.joints[i].body;
      const Vec3 w = axial(now[i].R.data(), Rd[i].data()),
                 wd = axial(now[i].R.data(), Rdd[i].data());
      const Vec3 push = times(b.inertia, wd), spin = crossed(w, times(b.inertia, w));
      for (std::size_t c = 0; c < 3; ++c)
        tau[k] += b.mass * (acceleration[i][c] - gravity[c]) * partial[i].velocity[c] +
                  (push[c] + spin[c]) * partial[i].turning[c];
    }
  }
  for (const JointModel& j : m.joints)
    if (robomosp::velocity_count(j.type) == 1) {
      const double ratio = j.is_coupled() ? j.coupling.ratio : 1;
      const auto v = static_cast<std::size_t>(j.v_index);
      tau[v] += ratio * ratio * j.armature * qdd[v];
    }
  return tau;
}

/// Residuals of the loops in their fixed directions, in order of LoopDirection, loop after loop.
[[nodiscard]] inline std::vector<double> loop_residuals(const RobotModel& m,
                                                        const std::vector<double>& q) {
  const std::vector<Pose> frames = joint_frames(m, q.data());
  const auto frame = [&](std::int32_t joint, const Pose& in) {
    return joint < 0 ? in : multiply(frames[static_cast<std::size_t>(joint)], in);
  };
  std::vector<double> out;
  for (const LoopModel& l : m.loops) {
    const Pose a = frame(l.joint_a, l.in_a), b = frame(l.joint_b, l.in_b);
    double D[9] = {}, r[6] = {};  // R_a^T R_b
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < 3; ++k) D[3 * i + j] += a.R[3 * k + i] * b.R[3 * k + j];
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) r[i] += a.R[3 * k + i] * (b.p[k] - a.p[k]);
    const double s[3] = {(D[7] - D[5]) / 2, (D[2] - D[6]) / 2, (D[3] - D[1]) / 2};
    const double sine = std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    const double angle = std::atan2(sine, (D[0] + D[4] + D[8] - 1) / 2);
    for (std::size_t i = 0; i < 3; ++i) r[3 + i] = sine > 1e-12 ? s[i] * angle / sine : s[i];
    for (std::uint32_t d = 0; d < 6; ++d)
      if (l.fixed & (1U << d)) out.push_back(r[d]);
  }
  return out;
}
/// Derivatives of the residuals by the velocities: a row a residual.
[[nodiscard]] inline std::vector<std::vector<double>> loop_jacobian(const RobotModel& m,
                                                                    const std::vector<double>& q) {
  const std::size_t rows = loop_residuals(m, q).size();
  std::vector<std::vector<double>> J(rows, std::vector<double>(m.dof()));
  for (std::size_t k = 0; k < m.dof(); ++k) {
    const double h = 1e-3;
    const auto a = loop_residuals(m, nudged(m, q, k, h)),
               b = loop_residuals(m, nudged(m, q, k, -h)),
               c = loop_residuals(m, nudged(m, q, k, 2 * h)),
               d = loop_residuals(m, nudged(m, q, k, -2 * h));
    for (std::size_t i = 0; i < rows; ++i) J[i][k] = (8 * (a[i] - b[i]) - (c[i] - d[i])) / (12 * h);
  }
  return J;
}
/// How the loops' forces act on the velocities' entries: a row a fixed direction. Force and moment
/// on frame b in the axes of frame a; where one turn alone is fixed, what works on its residual.
[[nodiscard]] inline std::vector<std::vector<double>> loop_force_rows(
    const RobotModel& m, const std::vector<double>& q) {
  std::vector<std::vector<double>> rows = loop_jacobian(m, q);
  const auto relative = [&](const LoopModel& l, const std::vector<double>& at) {
    const std::vector<Pose> frames = joint_frames(m, at.data());
    const auto frame = [&](std::int32_t joint, const Pose& in) {
      return joint < 0 ? in : multiply(frames[static_cast<std::size_t>(joint)], in);
    };
    const Pose a = frame(l.joint_a, l.in_a), b = frame(l.joint_b, l.in_b);
    std::array<double, 9> D{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < 3; ++k) D[3 * i + j] += a.R[3 * k + i] * b.R[3 * k + j];
    return D;
  };
  std::size_t row = 0;
  for (const LoopModel& l : m.loops) {
    const std::uint32_t turns = l.fixed >> 3;
    const bool moments = turns == 3 || turns == 5 || turns == 6 || turns == 7;
    const auto now = relative(l, q);
    for (std::uint32_t d = 0; d < 6; ++d) {
      if (!(l.fixed & (1U << d))) continue;
      for (std::size_t k = 0; d >= 3 && moments && k < m.dof(); ++k)
        rows[row][k] = difference(
            [&](double h) {  // of the small turn D(h) D^T
              const auto D = relative(l, nudged(m, q, k, h));
              double S[9] = {};
              for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t j = 0; j < 3; ++j)
                  for (std::size_t c = 0; c < 3; ++c) S[3 * i + j] += D[3 * i + c] * now[3 * j + c];
              return (d == 3 ? S[7] - S[5] : d == 4 ? S[2] - S[6] : S[3] - S[1]) / 2;
            },
            1e-3);
      ++row;
    }
  }
  return rows;
}
/// The smallest x with J x = r in the least squares sense, slightly damped.
[[nodiscard]] inline std::vector<double> least_step(const std::vector<std::vector<double>>& J,
                                                    std::vector<double> r) {
  const std::size_t n = r.size();
  std::vector<std::vector<double>> A(n, std::vector<double>(n));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t k = 0; k < J[i].size(); ++k) A[i][j] += J[i][k] * J[j][k];
      if (i == j) A[i][j] += 1e-10;
    }
  for (std::size_t i = 0; i < n; ++i)  // A is positive definite
    for (std::size_t k = i + 1; k < n; ++k) {
      const double f = A[k][i] / A[i][i];
      for (std::size_t c = i; c < n; ++c) A[k][c] -= f * A[i][c];
      r[k] -= f * r[i];
    }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t c = i + 1; c < n; ++c) r[i] -= A[i][c] * r[c];
    r[i] /= A[i][i];
  }
  std::vector<double> x(J.empty() ? 0 : J[0].size());
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < x.size(); ++k) x[k] += J[i][k] * r[i];
  return x;
}
/// A configuration near q that closes the loops, by Gauss-Newton steps.
[[nodiscard]] inline std::vector<double> closed_near(const RobotModel& m, std::vector<double> q) {
  for (int i = 0; i < 60; ++i) {
    const std::vector<double> step = least_step(loop_jacobian(m, q), loop_residuals(m, q));
    double size = 0;
    for (const double x : step) size = std::max(size, std::fabs(x));
    q = advanced(m, q.data(), step.data(), -std::min(1.0, 0.3 / std::max(size, 1e-300)));
    if (size < 1e-14) break;
  }
  return q;
}
/// The part of the velocities that keeps the loops closed.
[[nodiscard]] inline std::vector<double> velocities_that_close(const RobotModel& m,
                                                               const std::vector<double>& q,
                                                               std::vector<double> qd) {
  const auto J = loop_jacobian(m, q);
  for (int i = 0; i < 3; ++i) {
    std::vector<double> r(J.size());
    for (std::size_t k = 0; k < r.size(); ++k)
      for (std::size_t c = 0; c < qd.size(); ++c) r[k] += J[k][c] * qd[c];
    const std::vector<double> step = least_step(J, r);
    for (std::size_t c = 0; c < qd.size(); ++c) qd[c] -= step[c];
  }
  return qd;
}

}  // namespace robomosp::conformance
