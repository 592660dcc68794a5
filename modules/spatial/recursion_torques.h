// SPDX-License-Identifier: Apache-2.0
// Recursive Newton-Euler in joint frames (paper eqs 2-6) for numbers T: one sample (double) or one
// a lane; for sources of robomosp_lanes() (layer: data processing, spatial).
#pragma once

#include "spatial/joint_resistance.h"
#include "spatial/recursion_scratch.h"

namespace robomosp::spatial::recursions::RMP_LANES {

// Motion of the base with gravity as an acceleration; `rests` when only that is not zero.
template <class T>
struct BaseState {
  Vec<T> w, wd, a;
  bool rests;
};

template <class T>
RMP_INLINE void fill_turning(Link<T>& o) {
  const Vec<T>& w = o.w;
  const T xx = w.x * w.x, yy = w.y * w.y, zz = w.z * w.z;
  const T xy = w.x * w.y, yz = w.y * w.z, xz = w.x * w.z;
  o.U[0] = -(yy + zz), o.U[1] = xy - o.wd.z, o.U[2] = xz + o.wd.y;
  o.U[3] = xy + o.wd.z, o.U[4] = -(xx + zz), o.U[5] = yz - o.wd.x;
  o.U[6] = xz - o.wd.y, o.U[7] = yz + o.wd.x, o.U[8] = -(xx + yy);
}

// Paper eqs 2 and 4 for one joint, and eq 5: the rate of its body's momentum about the origin.
template <Turn K, class T>
RMP_INLINE void outward(const Body& b, const Rotation<K, T>& turn, const Vec<T>& moved,
                        bool base_rests, const Link<T>& up, const T* qd, const T* qdd, Link<T>& o) {
  const spatial::JointConstants& k = b.joint;
  if (k.parent < 0 && base_rests) {
    o.w = o.wd = Vec<T>{};
    o.a = turn.back(up.a);
  } else {
    o.w = turn.back(up.w);
    o.wd = turn.back(up.wd);
    o.a = turn.back(moves(k) ? up.a + multiply(up.U, moved) : up.a + multiply(up.U, plain(k.p)));
  }
  if constexpr (K == Turn::ball) {
    Vec<T> s{qd[0], qd[1], qd[2]}, sd{qdd[0], qdd[1], qdd[2]};
    if (k.type == JointType::free) {
      const Vec<T> v = s;
      s = {qd[3], qd[4], qd[5]};
      o.a = o.a + (sd + cross(scaled(o.w, 2.0) + s, v));
      sd = {qdd[3], qdd[4], qdd[5]};
    }
    o.wd = o.wd + (sd + cross(o.w, s));
    o.w = o.w + s;
  } else {
    const T rate = qd[0] * k.ratio, acceleration = qdd[0] * k.ratio;
    if (k.type == JointType::prismatic) {
      o.a = Vec<T>{o.a.x + 2.0 * o.w.y * rate, o.a.y - 2.0 * o.w.x * rate, o.a.z + acceleration};
    } else {
      o.wd = {o.wd.x + o.w.y * rate, o.wd.y - o.w.x * rate, o.wd.z + acceleration};
      o.w.z += rate;
    }
  }
  fill_turning(o);
  const double* J = b.second;  // xx yy zz xy yz xz
  const T* U = o.U;
  const Vec<double> h = plain(b.first);
  o.f = scaled(o.a, b.mass) + multiply(U, h);
  // The moment of r x (U r) over the body is the skew part of U J.
  o.n =
      Vec<T>{
          (U[6] * J[3] + U[7] * J[1] + U[8] * J[4]) - (U[3] * J[5] + U[4] * J[4] + U[5] * J[2]),
          (U[0] * J[5] + U[1] * J[4] + U[2] * J[2]) - (U[6] * J[0] + U[7] * J[3] + U[8] * J[5]),
          (U[3] * J[0] + U[4] * J[3] + U[5] * J[5]) - (U[0] * J[3] + U[1] * J[1] + U[2] * J[4])} +
      cross(h, o.a);
}

// Gives a vector of forces on a joint to the entries of tau that do work with it.
template <class T, class Put>
RMP_INLINE void project(const spatial::JointConstants& k, const Vec<T>& f, const Vec<T>& n,
                        const Put& put) {
  auto i = static_cast<std::size_t>(k.v_index);
  if (k.type == JointType::revolute) return put(i, n.z * k.ratio);
  if (k.type == JointType::prismatic) return put(i, f.z * k.ratio);
  if (k.type == JointType::free) {
    put(i, f.x), put(i + 1, f.y), put(i + 2, f.z);
    i += 3;
  }
  put(i, n.x), put(i + 1, n.y), put(i + 2, n.z);
}

// Subtracts a force and moment at a tip, given in the base's axes.
template <class T>
void subtract_wrench(const Mechanism& m, const TipPath& tip, const T* wrench, const Scratch<T>& x) {
  if (tip.count == 0) return;
  Vec<T> f{wrench[0], wrench[1], wrench[2]}, n{wrench[3], wrench[4], wrench[5]};
  for (std::int32_t i = 0; i < tip.count; ++i) {
    const auto j = static_cast<std::size_t>(tip.joints[i]);
    by_turn(m.bodies[j].joint.turn, [&](auto kind) {
      const auto turn = rotation<kind.kTurn>(x, m.bodies[j], j);
      f = turn.back(f), n = turn.back(n);
    });
  }
  Link<T>& o = x.links[tip.joints[tip.count - 1] + 1];
  o.f = o.f - f;
  o.n = o.n - (n + cross(plain(tip.p), f));
}

// tau of the bodies alone, after place(). A null wrench is none.
template <class T>
void newton_euler(const Mechanism& m, const BaseState<T>& base, const T* qd, const T* qdd,
                  const TipPath* tip, const T* wrench, const Scratch<T>& x, T* tau) {
  Link<T>& ground = x.links[0];
  ground.a = base.a;
  if (!base.rests) {
    ground.w = base.w, ground.wd = base.wd;
    fill_turning(ground);
  }
  for (std::size_t j = 0; j < m.count; ++j) {
    const Body& b = m.bodies[j];
    by_turn(b.joint.turn, [&](auto kind) {
      outward(b, rotation<kind.kTurn>(x, b, j), x.places[j].p, base.rests,
              x.links[b.joint.parent + 1], qd + b.joint.v_index, qdd + b.joint.v_index,
              x.links[j + 1]);
    });
  }
  if (wrench) subtract_wrench(m, *tip, wrench, x);
  if (m.coupled)
    for (std::size_t i = 0; i < m.velocities; ++i) tau[i] = T{};
  for (std::size_t j = m.count; j-- > 0;) {
    const Body& b = m.bodies[j];
    const Link<T>& o = x.links[j + 1];
    project(b.joint, o.f, o.n, [&](std::size_t i, const T& value) {
      tau[i] = m.coupled ? tau[i] + value : value;  // paper eq 6
    });
    if (b.joint.parent < 0) continue;
    Link<T>& up = x.links[b.joint.parent + 1];
    by_turn(b.joint.turn, [&](auto kind) {
      const auto turn = rotation<kind.kTurn>(x, b, j);
      const Vec<T> f = turn.forth(o.f);
      up.n = up.n + (turn.forth(o.n) +
                     (moves(b.joint) ? cross(x.places[j].p, f) : cross(plain(b.joint.p), f)));
      up.f = up.f + f;
    });
  }
}

template <class T>
struct Inputs {
  const T *q, *qd, *qdd, *wrench;  // wrench may be null, the others not
};

// Motion of the base that the chosen terms see, of T samples `width` apart.
template <class T>
Vec<T> base_vector(const double* base, std::size_t width, std::size_t last, std::size_t at) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double);
  double of[3][kWide];
  for (std::size_t i = 0; i < kWide; ++i)
    for (std::size_t k = 0; k < 3; ++k) of[k][i] = base[(i < last ? i : last) * width + at + k];
  Vec<T> v;
  __builtin_memcpy(&v.x, of[0], sizeof(T));
  __builtin_memcpy(&v.y, of[1], sizeof(T));
  __builtin_memcpy(&v.z, of[2], sizeof(T));
  return v;
}
struct BaseRow {
  const double* first = nullptr;
  std::size_t width = 0, last = 0;  // 0 when one is for all
};
enum BaseRowPart : std::size_t { kGravity = 0, kAcceleration = 3, kTurning = 6, kTurnRate = 9 };

template <class T>
BaseState<T> base_state(const Mechanism& m, const BaseRow& row, bool gravity, bool turns,
                        bool accelerates) {
  BaseState<T> s{{}, {}, {}, row.first == nullptr};
  if (gravity)
    s.a = scaled(
        row.first ? base_vector<T>(row.first, row.width, row.last, kGravity) : vec<T>(m.gravity),
        -1.0);
  if (!row.first) return s;
  if (turns) s.w = base_vector<T>(row.first, row.width, row.last, kTurning);
  if (accelerates) {
    s.wd = base_vector<T>(row.first, row.width, row.last, kTurnRate);
    s.a = s.a + base_vector<T>(row.first, row.width, row.last, kAcceleration);
  }
  return s;
}

// tau of the chosen terms, after place(). A moving base counts as inertial by itself, and as
// velocity where it meets the joints' rates: without the inertial term its own part is taken off.
template <class T>
void torques(const Mechanism& m, const Task& task, const Inputs<T>& in, const BaseRow& row,
             bool always_inertial, const Scratch<T>& x, T* tau) {
  const bool gravity = task.terms & kGravityTerm, velocity = task.terms & kVelocityTerm;
  const bool inertial = always_inertial || (task.terms & kInertialTerm);
  const T* wrench = (task.terms & kExternalTerm) ? in.wrench : nullptr;
  const TipPath* tip = wrench ? m.tips + task.tip : nullptr;
  newton_euler(
      m, base_state<T>(m, row, gravity, velocity || inertial, inertial), velocity ? in.qd : x.zeros,
      (task.terms & kInertialTerm) && !always_inertial ? in.qdd : x.zeros, tip, wrench, x, tau);
  if (row.first && velocity && !inertial) {
    newton_euler<T>(m, base_state<T>(m, row, false, true, false), x.zeros, x.zeros, nullptr,
                    nullptr, x, x.diagonal);
    for (std::size_t i = 0; i < m.velocities; ++i) tau[i] -= x.diagonal[i];
  }
  if (m.resists)
    add_resistance(
        m, always_inertial ? task.terms & ~static_cast<std::uint32_t>(kInertialTerm) : task.terms,
        in.q, in.qd, in.qdd, tau);
}
}  // namespace robomosp::spatial::recursions::RMP_LANES
