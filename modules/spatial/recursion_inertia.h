// SPDX-License-Identifier: Apache-2.0
// Joint-space inertia by composite rigid bodies and its factorization M = L^T D L (Featherstone,
// Rigid Body Dynamics Algorithms, ch. 6) for numbers T: one sample (double) or one a lane; for
// sources of robomosp_lanes() (layer: data processing, spatial).
#pragma once

#include "spatial/recursion_torques.h"

namespace robomosp::spatial::recursions::RMP_LANES {

template <class T>
RMP_INLINE Composite<T> alone(const Body& b) {
  const double* I = b.inertia;
  return {vec<T>(b.first),
          {splat<T>(I[0]), splat<T>(I[1]), splat<T>(I[2]), splat<T>(I[3]), splat<T>(I[4]),
           splat<T>(I[5])}};
}

// Adds a body and all bodies it carries to its parent, with p and the rotation as its placement
// there.
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

// Composite bodies of a simple chain: the forces for unit accelerations of all joints after one are
// propagated together. Uses the memory of links.
template <class T>
void serial_inertia(const Mechanism& m, const Scratch<T>& x, bool lower_only, T* out) {
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

// Joint-space inertia by composite bodies, after place(): forces for unit accelerations, propagated
// to the joints nearer the base.
template <class T>
void composite_inertia(const Mechanism& m, const Scratch<T>& x, T* out) {
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
          // Joints of one entry of qd meet on the diagonal, from both sides.
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

// The same column by column from Newton-Euler, as in the paper; uses the memory of qd and diagonal.
template <class T>
void column_inertia(const Mechanism& m, const Scratch<T>& x, T* out) {
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
void inertia(const Mechanism& m, const Task& task, const Scratch<T>& x, T* out) {
  if (task.columns) column_inertia(m, x, out);
  else if (m.simple_chain) serial_inertia(m, x, task.what == Task::What::accelerations, out);
  else composite_inertia(m, x, out);
}

// Factors M = L^T D L in place (lower triangle), from the tips to the base, so that zeros between
// branches stay zeros; D as its inverse. Returns the least margin of a pivot over rounding, which
// is not positive if M is not positive definite.
template <class T>
T factor(const Mechanism& m, T* M, T* diagonal) {
  const std::size_t n = m.velocities;
  for (std::size_t k = 0; k < n; ++k) diagonal[k] = M[k * n + k];
  T least = splat<T>(1);
  for (std::size_t k = n; k-- > 0;) {
    const T* row = M + k * n;
    const T pivot = row[k];
    const T excess = pivot - kPivot * diagonal[k], floor = pivot - m.least_inertia[k];
    const T margin = select(excess < floor, excess, floor);
    least = select(margin > 0, least, splat<T>(-1));
    const T inverse = 1.0 / pivot;
    M[k * n + k] = inverse;
    for (std::int32_t i = m.entry_parent[k]; i >= 0; i = m.entry_parent[i]) {
      const auto r = static_cast<std::size_t>(i);
      T* to = M + r * n;
      const T a = row[r] * inverse;
      if (m.dense) {
#if defined(__clang__)
#pragma clang loop vectorize(assume_safety)
#else
#pragma GCC ivdep
#endif
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
}  // namespace robomosp::spatial::recursions::RMP_LANES
