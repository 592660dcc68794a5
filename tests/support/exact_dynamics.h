// SPDX-License-Identifier: Apache-2.0
// Inverse dynamics in 80-bit numbers with one derivative, by Newton's and Euler's laws for points
// in the base's axes: an independent computation of the derivatives of dynamics.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp::test {

/// f and f' along one direction.
struct Exact {
  long double v = 0, d = 0;
  Exact() = default;
  Exact(long double value) : v(value) {}  // NOLINT: numbers are constants
  Exact(long double value, long double rate) : v(value), d(rate) {}
  friend Exact operator+(const Exact& a, const Exact& b) { return {a.v + b.v, a.d + b.d}; }
  friend Exact operator-(const Exact& a, const Exact& b) { return {a.v - b.v, a.d - b.d}; }
  friend Exact operator*(const Exact& a, const Exact& b) {
    return {a.v * b.v, a.d * b.v + a.v * b.d};
  }
};

struct ExactVector {
  std::array<Exact, 3> x;
  ExactVector() = default;
  ExactVector(const Exact& a, const Exact& b, const Exact& c) : x{a, b, c} {}
  explicit ExactVector(const Vec3& v) : x{Exact(v[0]), Exact(v[1]), Exact(v[2])} {}
  friend ExactVector operator+(const ExactVector& a, const ExactVector& b) {
    return {a.x[0] + b.x[0], a.x[1] + b.x[1], a.x[2] + b.x[2]};
  }
  friend ExactVector operator-(const ExactVector& a, const ExactVector& b) {
    return {a.x[0] - b.x[0], a.x[1] - b.x[1], a.x[2] - b.x[2]};
  }
  friend ExactVector operator*(const ExactVector& a, const Exact& s) {
    return {a.x[0] * s, a.x[1] * s, a.x[2] * s};
  }
  friend ExactVector cross(const ExactVector& a, const ExactVector& b) {
    return {a.x[1] * b.x[2] - a.x[2] * b.x[1], a.x[2] * b.x[0] - a.x[0] * b.x[2],
            a.x[0] * b.x[1] - a.x[1] * b.x[0]};
  }
  friend Exact dot(const ExactVector& a, const ExactVector& b) {
    return a.x[0] * b.x[0] + a.x[1] * b.x[1] + a.x[2] * b.x[2];
  }
};
using ExactMatrix = std::array<ExactVector, 3>;  ///< rows
inline ExactVector operator*(const ExactMatrix& m, const ExactVector& v) {
  return {dot(m[0], v), dot(m[1], v), dot(m[2], v)};
}
inline ExactMatrix operator*(const ExactMatrix& a, const ExactMatrix& b) {
  ExactMatrix c;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      c[i].x[j] = a[i].x[0] * b[0].x[j] + a[i].x[1] * b[1].x[j] + a[i].x[2] * b[2].x[j];
  return c;
}
inline ExactVector column(const ExactMatrix& m, std::size_t i) {
  return {m[0].x[i], m[1].x[i], m[2].x[i]};
}
inline ExactMatrix exact_matrix(const std::array<double, 9>& R) {
  return {ExactVector(Vec3{R[0], R[1], R[2]}), ExactVector(Vec3{R[3], R[4], R[5]}),
          ExactVector(Vec3{R[6], R[7], R[8]})};
}

/// A state, and the direction of the derivative: by motion (as the derivatives of the SDK: for ball
/// and free joints by a small velocity) or by rate, entry k of tau's.
struct ExactState {
  const double *q, *qd, *qdd;
  BaseMotion base;
  const TipModel* tip = nullptr;
  TipWrench wrench{};
  bool by_rate = false;
  std::size_t k = 0;
};

/// tau of all terms but Coulomb friction, with its derivative.
inline std::vector<Exact> exact_torques(const RobotModel& m, const ExactState& s) {
  struct Body {
    ExactMatrix R;
    ExactVector p, w, wd, a, force, moment;
  };
  const auto seed = [&](bool rate, std::size_t entry) {
    return s.by_rate == rate && s.k == entry ? 1.0L : 0.0L;
  };
  std::vector<Body> bodies(m.joints.size());
  std::vector<Exact> tau(m.dof());
  Body ground;
  ground.R = exact_matrix(Pose{}.R);
  ground.w = ExactVector(s.base.angular_velocity);
  ground.wd = ExactVector(s.base.angular_acceleration);
  ground.a = ExactVector(s.base.acceleration) - ExactVector(s.base.gravity);
  for (std::size_t i = 0; i < m.joints.size(); ++i) {
    const JointModel& j = m.joints[i];
    const Body& up = j.parent < 0 ? ground : bodies[static_cast<std::size_t>(j.parent)];
    Body& b = bodies[i];
    const auto v = static_cast<std::size_t>(j.v_index);
    const double* own = s.q + j.q_index;
    const Exact ratio(j.is_coupled() ? j.coupling.ratio : 1.0);
    ExactMatrix turned = exact_matrix(Pose{}.R);
    ExactVector slid, moves, turns, pushes, spins;  // in the joint's frame after its motion
    const auto rate = [&](std::size_t k) { return Exact(s.qd[v + k], seed(true, v + k)); };
    const auto push = [&](std::size_t k) { return Exact(s.qdd[v + k]); };
    if (coordinate_count(j.type) == 1) {
      const Exact x =
          ratio * Exact(own[0], seed(false, v)) + Exact(j.is_coupled() ? j.coupling.offset : 0.0);
      if (j.type == JointType::revolute) {
        const long double sine = std::sin(x.v), cosine = std::cos(x.v);
        const Exact c(cosine, -sine * x.d), n(sine, cosine * x.d);
        turned = {ExactVector{c, Exact(0) - n, 0}, ExactVector{n, c, 0}, ExactVector{0, 0, 1}};
        turns.x[2] = ratio * rate(0), spins.x[2] = ratio * push(0);
      } else {
        slid.x[2] = x;
        moves.x[2] = ratio * rate(0), pushes.x[2] = ratio * push(0);
      }
    } else {
      const std::size_t slides = j.type == JointType::free ? 3 : 0;
      long double length = 0, w[4];
      for (std::size_t k = 0; k < 4; ++k) w[k] = own[slides + k], length += w[k] * w[k];
      for (long double& x : w) x /= std::sqrt(length);
      const long double a = w[0], x = w[1], y = w[2], z = w[3];
      turned = {ExactVector{1 - 2 * (y * y + z * z), 2 * (x * y - z * a), 2 * (x * z + y * a)},
                ExactVector{2 * (x * y + z * a), 1 - 2 * (x * x + z * z), 2 * (y * z - x * a)},
                ExactVector{2 * (x * z - y * a), 2 * (y * z + x * a), 1 - 2 * (x * x + y * y)}};
      const auto nudge = [&](std::size_t k) { return Exact(0, seed(false, v + k)); };
      if (slides > 0)
        slid = ExactVector(Vec3{own[0], own[1], own[2]}) +
               turned * ExactVector{nudge(0), nudge(1), nudge(2)};
      const Exact dx = nudge(slides), dy = nudge(slides + 1), dz = nudge(slides + 2);
      turned =
          turned * ExactMatrix{ExactVector{1, Exact(0) - dz, dy}, ExactVector{dz, 1, Exact(0) - dx},
                               ExactVector{Exact(0) - dy, dx, 1}};
      for (std::size_t k = 0; k < 3; ++k) {
        if (slides > 0) moves.x[k] = rate(k), pushes.x[k] = push(k);
        turns.x[k] = rate(slides + k), spins.x[k] = push(slides + k);
      }
    }
    const ExactMatrix fixed = exact_matrix(j.placement.R);
    const ExactVector arm = up.R * (ExactVector(j.placement.p) + fixed * slid);
    b.R = up.R * fixed * turned;
    b.p = up.p + arm;
    const ExactVector w = b.R * turns, v_own = b.R * moves;
    b.w = up.w + w;
    b.wd = up.wd + b.R * spins + cross(up.w, w);
    b.a = up.a + cross(up.wd, arm) + cross(up.w, cross(up.w, arm)) + cross(up.w, v_own) * Exact(2) +
          b.R * pushes + cross(w, v_own);
    const MassProperties& mass = j.body;
    const ExactVector c = b.R * ExactVector(mass.com);
    b.force = (b.a + cross(b.wd, c) + cross(b.w, cross(b.w, c))) * Exact(mass.mass);
    const Sym3& I = mass.inertia;
    const ExactMatrix own_inertia = {ExactVector(Vec3{I.xx, I.xy, I.xz}),
                                     ExactVector(Vec3{I.xy, I.yy, I.yz}),
                                     ExactVector(Vec3{I.xz, I.yz, I.zz})};
    const ExactMatrix back = {column(b.R, 0), column(b.R, 1), column(b.R, 2)};
    const ExactMatrix inertia = b.R * own_inertia * back;
    b.moment = inertia * b.wd + cross(b.w, inertia * b.w) + cross(c, b.force);
  }
  if (s.tip && s.tip->joint >= 0) {
    Body& b = bodies[static_cast<std::size_t>(s.tip->joint)];
    const ExactVector f(s.wrench.force);
    b.force = b.force - f;
    b.moment = b.moment - ExactVector(s.wrench.moment) - cross(b.R * ExactVector(s.tip->tool.p), f);
  }
  for (std::size_t i = m.joints.size(); i-- > 0;) {
    const JointModel& j = m.joints[i];
    const Body& b = bodies[i];
    const auto v = static_cast<std::size_t>(j.v_index);
    const double ratio = j.is_coupled() ? j.coupling.ratio : 1.0;
    const auto add = [&](std::size_t k, const Exact& x) { tau[v + k] = tau[v + k] + x; };
    if (coordinate_count(j.type) == 1) {
      const ExactVector z = column(b.R, 2);
      add(0, dot(z, j.type == JointType::revolute ? b.moment : b.force) * Exact(ratio));
      add(0, Exact(s.qdd[v]) * Exact(ratio * ratio * j.armature));
      const Exact x = Exact(s.q[j.q_index], seed(false, v)) * Exact(ratio) +
                      Exact((j.is_coupled() ? j.coupling.offset : 0.0) - j.spring.rest);
      add(0, x * Exact(ratio * j.spring.stiffness));
      add(0, Exact(s.qd[v], seed(true, v)) * Exact(ratio * ratio * j.friction.viscous));
    } else {
      const std::size_t slides = j.type == JointType::free ? 3 : 0;
      for (std::size_t k = 0; k < 3; ++k) {
        if (slides > 0) add(k, dot(column(b.R, k), b.force));
        add(slides + k, dot(column(b.R, k), b.moment));
      }
    }
    if (j.parent < 0) continue;
    Body& up = bodies[static_cast<std::size_t>(j.parent)];
    up.force = up.force + b.force;
    up.moment = up.moment + b.moment + cross(b.p - up.p, b.force);
  }
  return tau;
}

}  // namespace robomosp::test
