// SPDX-License-Identifier: Apache-2.0
// Recursive Newton-Euler in joint frames (paper eqs 2-6), composite rigid bodies and the
// factorization M = L^T D L (Featherstone, Rigid Body Dynamics Algorithms, ch. 5 and 6), for
// numbers T: one sample (double) or one a lane. Compiled by robomosp_lanes().
#include "kernels.h"

#include <robomosp/sdk/dynamics.h>

#include "spatial/lane_math.h"

namespace robomosp::newton_euler::RMP_LANES {
namespace {

using namespace spatial::RMP_LANES;
using spatial::Turn;

// What the outward pass leaves for the joints behind and for the inward pass, in the joint's frame.
template <class T>
struct Link {
  Vec<T> w, wd, a;  // angular velocity, angular and linear acceleration of the origin
  T U[9];           // [wd x] + [w x][w x]: acceleration by place in the body
  Vec<T> f, n;      // force and moment about the origin
};
template <class T>
struct Composite {
  Vec<T> first;
  Sym<T> inertia;
};
template <class T>
struct Place {
  Vec<T> p;  // parent_p_joint, of joints that move it
  T R[9];    // parent_R_joint, of Turn::ball
};

// The scratch of one evaluation.
template <class T>
struct Room {
  double *angle, *sine, *cosine;  // joints * lanes of T
  T *q, *qd, *qdd, *tau, *zeros, *m, *diagonal, *wrench;
  Link<T>* links;  // [0] is the base
  Place<T>* places;
  Composite<T>* composites;
};
constexpr std::size_t padded(std::size_t n) { return (n + kLanes - 1) / kLanes * kLanes; }

// Lays the room out from `at` and returns the doubles that it takes, alignment included. A null
// pointer is only measured.
template <class T>
std::size_t furnish(const Mechanism& m, const Task& task, double* at, Room<T>& room) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double), kAlignment = 64;
  if (at) {
    const auto address = reinterpret_cast<std::uintptr_t>(at);
    at += ((kAlignment - address % kAlignment) % kAlignment) / sizeof(double);
  }
  std::size_t used = 0;
  const auto take = [&](std::size_t doubles) {
    double* here = at ? at + used : nullptr;
    used += (doubles + 7) / 8 * 8;
    return here;
  };
  const auto numbers = [&](std::size_t n) { return reinterpret_cast<T*>(take(n * kWide)); };
  const std::size_t angles = padded(m.count * kWide), n = m.velocities;
  room.angle = take(angles), room.sine = take(angles), room.cosine = take(angles);
  room.q = numbers(m.coordinates);
  room.qd = numbers(n), room.qdd = numbers(n);
  room.tau = numbers(n), room.zeros = numbers(n);
  room.diagonal = numbers(n), room.wrench = numbers(6);
  room.links = reinterpret_cast<Link<T>*>(take((m.count + 1) * sizeof(Link<T>) / 8));
  room.places = reinterpret_cast<Place<T>*>(take(m.count * sizeof(Place<T>) / 8));
  room.composites = reinterpret_cast<Composite<T>*>(take(m.count * sizeof(Composite<T>) / 8));
  room.m = numbers(task.what != Task::What::torques ? n * n : 0);
  return used + kAlignment / sizeof(double);
}

template <Turn K, class T>
RMP_INLINE Rotation<K, T> rotation(const Room<T>& x, const Body& b, std::size_t j) {
  if constexpr (K == Turn::ball) return {b.joint, T{}, T{}, x.places[j].R};
  T s, c;
  __builtin_memcpy(&s, x.sine + j * (sizeof(T) / 8), sizeof(T));
  __builtin_memcpy(&c, x.cosine + j * (sizeof(T) / 8), sizeof(T));
  return {b.joint, s, c, nullptr};
}
RMP_INLINE bool moves(const spatial::JointConstants& k) {
  return k.type == JointType::prismatic || k.type == JointType::free;
}

// Sines, cosines and places of all joints.
template <class T>
void place(const Mechanism& m, const T* q, const Room<T>& x) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double);
  for (std::size_t j = 0; j < m.count; ++j) {
    const spatial::JointConstants& k = m.bodies[j].joint;
    T angle = splat<T>(k.angle);
    if (k.type == JointType::revolute) {
      angle += q[k.q_index] * k.ratio + k.offset;
    } else if (k.type == JointType::prismatic) {
      const T way = q[k.q_index] * k.ratio + k.offset;
      x.places[j].p = {k.p[0] + way * k.R[2], k.p[1] + way * k.R[5], k.p[2] + way * k.R[8]};
    } else {
      const T* own = q + k.q_index;
      if (k.type == JointType::free) {
        x.places[j].p = plain(k.p) + multiply(k.R, Vec<T>{own[0], own[1], own[2]});
        own += 3;
      }
      ball_rotation(k.R, own, x.places[j].R);
    }
    __builtin_memcpy(x.angle + j * kWide, &angle, sizeof angle);
  }
  const std::size_t used = m.count * kWide;
  for (std::size_t i = used; i < padded(used); ++i) x.angle[i] = 0;
  sin_cos<RightAngles::exact>(x.angle, used, x.sine, x.cosine);
}

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
void subtract_wrench(const Mechanism& m, const TipPath& tip, const T* wrench, const Room<T>& x) {
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
                  const TipPath* tip, const T* wrench, const Room<T>& x, T* tau) {
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

// Motor inertia, friction and springs.
template <class T>
void add_resistance(const Mechanism& m, std::uint32_t terms, const T* q, const T* qd, const T* qdd,
                    T* tau) {
  for (std::size_t j = 0; j < m.count; ++j) {
    const Body& b = m.bodies[j];
    if (!b.resists) continue;
    const spatial::JointConstants& k = b.joint;
    T force{};
    if (terms & kInertialTerm) force += qdd[k.v_index] * (k.ratio * b.armature);
    if (terms & kFrictionTerm) {
      const T rate = qd[k.v_index] * k.ratio, none{};
      force += rate * b.viscous;
      force += select(rate > 0, splat<T>(b.coulomb_positive), none);
      force += select(rate < 0, splat<T>(b.coulomb_negative), none);
    }
    if (terms & kSpringTerm) force += (q[k.q_index] * k.ratio + (k.offset - b.rest)) * b.stiffness;
    tau[k.v_index] += force * k.ratio;
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
             bool always_inertial, const Room<T>& x, T* tau) {
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

template <class T>
RMP_INLINE Composite<T> alone(const Body& b) {
  const double* I = b.inertia;
  return {vec<T>(b.first),
          {splat<T>(I[0]), splat<T>(I[1]), splat<T>(I[2]), splat<T>(I[3]), splat<T>(I[4]),
           splat<T>(I[5])}};
}

// Adds a body and all that it carries to its parent, p and the turn being its place there.
template <class T, class R, class P>
RMP_INLINE void add_carried(const Composite<T>& c, double mass, const R& turn, const Vec<P>& p,
                            Composite<T>& up) {
  const Vec<T> h = turn.forth(c.first);
  const Sym<T> I = turn.forth(c.inertia);
  // For r' = R r + p with first moment h: 2 (p.g) 1 - p g^T - g p^T with g = h + m p / 2.
  const Vec<T> g = h + scaled(p, 0.5 * mass);
  const T xx = p.x * g.x, yy = p.y * g.y, zz = p.z * g.z;
  up.inertia.xx += I.xx + 2.0 * (yy + zz);
  up.inertia.yy += I.yy + 2.0 * (xx + zz);
  up.inertia.zz += I.zz + 2.0 * (xx + yy);
  up.inertia.xy += I.xy - (p.x * g.y + g.x * p.y);
  up.inertia.yz += I.yz - (p.y * g.z + g.y * p.z);
  up.inertia.xz += I.xz - (p.x * g.z + g.x * p.z);
  up.first = up.first + (h + scaled(p, mass));
}

// Composite bodies of a simple chain: the forces of unit accelerations of all joints behind one
// pass it together. Takes the room of links.
template <class T>
void serial_inertia(const Mechanism& m, const Room<T>& x, bool lower_only, T* out) {
  const std::size_t n = m.count;
  for (std::size_t j = 0; j < n; ++j) x.composites[j] = alone<T>(m.bodies[j]);
  for (std::size_t j = n; j-- > 0;) {
    const Body& b = m.bodies[j];
    const bool slides = b.joint.type == JointType::prismatic;
    const Composite<T>& c = x.composites[j];
    Link<T>& own = x.links[j];
    const T zero{};
    if (slides) {
      own.f = Vec<T>{zero, zero, splat<T>(b.carried)};
      own.n = Vec<T>{c.first.y, -c.first.x, zero};
    } else {
      own.f = Vec<T>{-c.first.y, c.first.x, zero};
      own.n = Vec<T>{c.inertia.xz, c.inertia.yz, c.inertia.zz};
    }
    for (std::size_t k = j; k < n; ++k) {
      const T value = slides ? x.links[k].f.z : x.links[k].n.z;
      out[k * n + j] = value;
      if (!lower_only) out[j * n + k] = value;
    }
    out[j * n + j] += b.armature;
    if (j == 0) break;
    by_turn(b.joint.turn, [&](auto kind) {
      const auto turn = rotation<kind.kTurn>(x, b, j);
      const auto pass = [&](const auto& p) {
        add_carried(c, b.carried, turn, p, x.composites[j - 1]);
        for (std::size_t k = j; k < n; ++k) {
          Link<T>& o = x.links[k];
          o.f = turn.forth(o.f);
          o.n = turn.forth(o.n) + cross(p, o.f);
        }
      };
      if (slides) pass(x.places[j].p);
      else pass(plain(b.joint.p));
    });
  }
}

// Joint-space inertia by composite bodies, after place(): forces of unit accelerations, passed on
// to the joints nearer the base.
template <class T>
void composite_inertia(const Mechanism& m, const Room<T>& x, T* out) {
  const std::size_t n = m.velocities;
  if (!m.dense || m.coupled)
    for (std::size_t i = 0; i < n * n; ++i) out[i] = T{};
  for (std::size_t j = 0; j < m.count; ++j) x.composites[j] = alone<T>(m.bodies[j]);
  for (std::size_t j = m.count; j-- > 0;) {
    const Body& b = m.bodies[j];
    if (b.joint.parent < 0) continue;
    Composite<T>& up = x.composites[b.joint.parent];
    by_turn(b.joint.turn, [&](auto kind) {
      const auto turn = rotation<kind.kTurn>(x, b, j);
      if (moves(b.joint)) add_carried(x.composites[j], b.carried, turn, x.places[j].p, up);
      else add_carried(x.composites[j], b.carried, turn, plain(b.joint.p), up);
    });
  }
  for (std::size_t j = 0; j < m.count; ++j) {
    const Body& b = m.bodies[j];
    const Composite<T>& c = x.composites[j];
    const Vec<T>& h = c.first;
    const Sym<T>& I = c.inertia;
    const auto column = [&](std::size_t entry, Vec<T> f, Vec<T> n_) {
      const auto put = [&](std::size_t i, const T& value, bool own) {
        if (m.coupled) {
          // Joints that move with one entry of qd meet in the diagonal, from both sides.
          if (own) out[i * n + entry] += value;
          else if (i == entry) out[i * n + i] += value + value;
          else out[i * n + entry] += value, out[entry * n + i] += value;
        } else {
          out[i * n + entry] = out[entry * n + i] = value;
        }
      };
      const double ratio = b.joint.ratio;
      const bool single = b.joint.velocity_count == 1;
      project(b.joint, f, n_, [&](std::size_t i, const T& value) {
        put(i, single ? value * ratio + ratio * ratio * b.armature : value, true);
      });
      std::size_t at = j;
      while (m.bodies[at].joint.parent >= 0) {
        const Body& from = m.bodies[at];
        by_turn(from.joint.turn, [&](auto kind) {
          const auto turn = rotation<kind.kTurn>(x, from, at);
          f = turn.forth(f);
          n_ = turn.forth(n_) +
               (moves(from.joint) ? cross(x.places[at].p, f) : cross(plain(from.joint.p), f));
        });
        at = static_cast<std::size_t>(from.joint.parent);
        project(m.bodies[at].joint, f, n_,
                [&](std::size_t i, const T& value) { put(i, value * ratio, false); });
      }
    };
    auto entry = static_cast<std::size_t>(b.joint.v_index);
    const T zero{}, mass = splat<T>(b.carried);
    switch (b.joint.type) {
      case JointType::revolute: column(entry, {-h.y, h.x, zero}, {I.xz, I.yz, I.zz}); break;
      case JointType::prismatic: column(entry, {zero, zero, mass}, {h.y, -h.x, zero}); break;
      case JointType::free:
        column(entry++, {mass, zero, zero}, {zero, h.z, -h.y});
        column(entry++, {zero, mass, zero}, {-h.z, zero, h.x});
        column(entry++, {zero, zero, mass}, {h.y, -h.x, zero});
        [[fallthrough]];
      case JointType::spherical:
        column(entry++, {zero, -h.z, h.y}, {I.xx, I.xy, I.xz});
        column(entry++, {h.z, zero, -h.x}, {I.xy, I.yy, I.yz});
        column(entry, {-h.y, h.x, zero}, {I.xz, I.yz, I.zz});
        break;
    }
  }
}

// The same column by column from Newton-Euler, as in the paper; takes the rooms of qd and diagonal.
template <class T>
void column_inertia(const Mechanism& m, const Room<T>& x, T* out) {
  const std::size_t n = m.velocities;
  const BaseState<T> rest{{}, {}, {}, true};
  T *unit = x.diagonal, *tau = x.qd;
  for (std::size_t i = 0; i < n; ++i) unit[i] = T{};
  for (std::size_t i = 0; i < n; ++i) {
    unit[i] = splat<T>(1);
    newton_euler<T>(m, rest, x.zeros, unit, nullptr, nullptr, x, tau);
    add_resistance<T>(m, kInertialTerm, x.zeros, x.zeros, unit, tau);
    unit[i] = T{};
    for (std::size_t k = 0; k <= i; ++k) out[i * n + k] = out[k * n + i] = tau[k];
  }
}

template <class T>
void inertia(const Mechanism& m, const Task& task, const Room<T>& x, T* out) {
  if (task.columns) column_inertia(m, x, out);
  else if (m.simple_chain) serial_inertia(m, x, task.what == Task::What::accelerations, out);
  else composite_inertia(m, x, out);
}

// Factors M = L^T D L in place (lower triangle), from the tips to the base, so that zeros between
// branches stay zeros; D as its inverse. Returns the least excess of a pivot over rounding, which
// is not positive where M is not positive definite.
template <class T>
T factor(const Mechanism& m, T* M, T* diagonal) {
  const std::size_t n = m.velocities;
  T greatest{};
  for (std::size_t k = 0; k < n; ++k) {
    diagonal[k] = M[k * n + k];
    greatest = select(diagonal[k] > greatest, diagonal[k], greatest);
  }
  T least = splat<T>(1);
  for (std::size_t k = n; k-- > 0;) {
    const T* row = M + k * n;
    const T pivot = row[k];
    const T excess = pivot - kPivot * diagonal[k], floor = pivot - kDiagonal * greatest;
    const T margin = select(excess < floor, excess, floor);
    least = select(margin > 0, least, splat<T>(-1));
    const T inverse = 1.0 / pivot;
    M[k * n + k] = inverse;
    for (std::int32_t i = m.entry_parent[k]; i >= 0; i = m.entry_parent[i]) {
      const auto r = static_cast<std::size_t>(i);
      T* to = M + r * n;
      const T a = row[r] * inverse;
      if (m.dense) {
#pragma GCC ivdep
        for (std::size_t j = 0; j <= r; ++j) to[j] -= a * row[j];
      } else {
        for (std::int32_t j = i; j >= 0; j = m.entry_parent[j]) to[j] -= a * row[j];
      }
      M[k * n + r] = a;
    }
  }
  return least;
}

template <class T>
void solve(const Mechanism& m, const T* M, T* v) {
  const std::size_t n = m.velocities;
  for (std::size_t k = n; k-- > 0;)  // L^T y = b
    for (std::int32_t i = m.entry_parent[k]; i >= 0; i = m.entry_parent[i])
      v[i] -= M[k * n + static_cast<std::size_t>(i)] * v[k];
  for (std::size_t k = 0; k < n; ++k) {  // L x = D^-1 y
    T sum = v[k] * M[k * n + k];
    for (std::int32_t i = m.entry_parent[k]; i >= 0; i = m.entry_parent[i])
      sum -= M[k * n + static_cast<std::size_t>(i)] * v[i];
    v[k] = sum;
  }
}

// One evaluation; results in out (torques, inertia, accelerations). Returns a number that is
// positive when all is well, lane by lane.
template <class T>
T evaluate(const Mechanism& m, const Task& task, const Inputs<T>& in, const BaseRow& row,
           const T* tau, const Room<T>& x, T* out) {
  place(m, in.q, x);
  std::size_t count = m.velocities;
  T least = splat<T>(1);
  switch (task.what) {
    case Task::What::torques: torques(m, task, in, row, false, x, out); break;
    case Task::What::inertia:
      inertia(m, task, x, out);
      count *= count;
      break;
    case Task::What::accelerations:
      torques(m, task, in, row, true, x, out);
      for (std::size_t i = 0; i < count; ++i) out[i] = tau[i] - out[i];
      inertia(m, task, x, x.m);
      least = factor(m, x.m, x.diagonal);
      solve(m, x.m, out);
      break;
  }
  T none{};  // 0 * v is NaN for infinities and NaN, else 0
  for (std::size_t i = 0; i < count; ++i) none += 0.0 * out[i];
  return least + none;
}

template <class T>
std::size_t output_width(const Mechanism& m, const Task& task) {
  return task.what == Task::What::inertia ? m.velocities * m.velocities : m.velocities;
}

std::size_t run_single(const Mechanism& m, const Task& task, std::size_t first, std::size_t last,
                       double* scratch) {
  Room<double> x;
  furnish(m, task, scratch, x);
  const std::size_t n = m.velocities, width = output_width<double>(m, task);
  for (std::size_t i = 0; i < n; ++i) x.zeros[i] = 0;
  for (std::size_t i = first; i < last; ++i) {
    const auto of = [&](const double* all) { return all ? all + i * n : x.zeros; };
    Inputs<double> in{task.q + i * m.coordinates, of(task.qd), of(task.qdd), nullptr};
    if (task.wrench) in.wrench = task.wrench + (task.one_wrench ? 0 : 6 * i);
    BaseRow row;
    if (task.base) row.first = task.base + (task.one_base ? 0 : 12 * i);
    if (!(evaluate(m, task, in, row, of(task.tau), x, task.out + i * width) > 0)) return i;
  }
  return last;
}

template <class T>
std::size_t run_lanes(const Mechanism& m, const Task& task, std::size_t samples, std::size_t first,
                      std::size_t last, double* scratch) {
  constexpr std::size_t kSamples = sizeof(T) / sizeof(double);
  Room<T> x;
  furnish(m, task, scratch, x);
  const std::size_t n = m.velocities, width = output_width<T>(m, task);
  for (std::size_t i = 0; i < n; ++i) x.zeros[i] = T{};
  // tau of forward dynamics shares the room of qdd, which forward dynamics does not read.
  T* out = task.what == Task::What::inertia ? x.m : x.tau;
  if (task.wrench && task.one_wrench)
    for (std::size_t k = 0; k < 6; ++k) x.wrench[k] = splat<T>(task.wrench[k]);
  for (std::size_t i = first; i < last; i += kSamples) {
    const std::size_t left = samples - i, here = last - i < kSamples ? last - i : kSamples;
    const auto loaded = [&](const double* all, T* to) -> const T* {
      if (!all) return x.zeros;
      load_samples(all + i * n, n, left, to);
      return to;
    };
    load_samples(task.q + i * m.coordinates, m.coordinates, left, x.q);
    Inputs<T> in{x.q, loaded(task.qd, x.qd), x.zeros, nullptr};
    const T* tau = x.zeros;
    if (task.what == Task::What::accelerations) tau = loaded(task.tau, x.qdd);
    else if (task.what == Task::What::torques) in.qdd = loaded(task.qdd, x.qdd);
    if (task.wrench) {
      if (!task.one_wrench) load_samples(task.wrench + 6 * i, 6, left, x.wrench);
      in.wrench = x.wrench;
    }
    BaseRow row;
    if (task.base && task.one_base) row = {task.base, 0, 0};
    else if (task.base) row = {task.base + 12 * i, 12, left - 1};
    const T well = evaluate(m, task, in, row, tau, x, out);
    store_samples(out, width, here, task.out + i * width);
    if (__builtin_expect(any(~(well > 0)), 0)) {
      double each[kSamples];
      __builtin_memcpy(each, &well, sizeof well);
      for (std::size_t k = 0; k < here; ++k)
        if (!(each[k] > 0)) return i + k;
    }
  }
  return last;
}

// Two vectors pay where there are registers for them and the matrix stays in the nearest cache.
bool side_by_side(const Mechanism& m, const Task& task) {
  return kLanes == 8 && (task.what == Task::What::torques || m.velocities <= 10);
}

std::size_t run(const Mechanism& m, const Task& task, std::size_t samples, std::size_t first,
                std::size_t last, double* scratch) {
  if (!task.lanes) return run_single(m, task, first, last, scratch);
  return side_by_side(m, task) ? run_lanes<Wide>(m, task, samples, first, last, scratch)
                               : run_lanes<Lanes>(m, task, samples, first, last, scratch);
}

std::size_t scratch_size(const Mechanism& m, const Task& task) {
  Room<double> one;
  Room<Lanes> several;
  Room<Wide> many;
  if (!task.lanes) return furnish(m, task, nullptr, one);
  return side_by_side(m, task) ? furnish(m, task, nullptr, many)
                               : furnish(m, task, nullptr, several);
}

constexpr Kernels kTable{run, scratch_size, kLanes};

}  // namespace

const Kernels& kernels() { return kTable; }

}  // namespace robomosp::newton_euler::RMP_LANES
