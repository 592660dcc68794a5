// SPDX-License-Identifier: Apache-2.0
// Partial derivatives of inverse dynamics with composite bodies in the base frame (Singh, Russell,
// Wensing, Efficient Analytical Derivatives of Rigid-Body Dynamics using Spatial Vector Algebra,
// RA-L 2022) for numbers T: one sample (double), with rows computed in vectors, or one per lane;
// for sources of robomosp_lanes() (layer: data processing, spatial).
//
// Force by velocity, x -> I (x cross v) + x cross* I v + v cross* I x, is for a rigid body twice
// the sum of the moments and forces m w' cross (velocity of the point) over its points: it depends
// on the angular part w' of x alone, and is G = sum m (velocity) r^T and the momentum P, twelve
// numbers that add up over bodies: (2 (tr G - G) w', 2 w' cross P).
#pragma once

#include "spatial/recursion_inertia.h"

namespace robomosp::spatial::recursions::RMP_LANES {

/// A motion or a force about the base's origin in the base's axes.
template <class T>
struct Spatial {
  Vec<T> n, f;  ///< angular and linear, or moment and force
};
template <class T>
RMP_INLINE Spatial<T> operator+(const Spatial<T>& a, const Spatial<T>& b) {
  return {a.n + b.n, a.f + b.f};
}
template <class T>
RMP_INLINE Spatial<T> scaled(const Spatial<T>& a, const T& s) {
  return {scaled(a.n, s), scaled(a.f, s)};
}
/// v cross m of motions.
template <class T>
RMP_INLINE Spatial<T> cross(const Spatial<T>& v, const Spatial<T>& m) {
  return {cross(v.n, m.n), cross(v.n, m.f) + cross(v.f, m.n)};
}

/// A body and, after gather(), all bodies it carries; in the base frame.
template <class T>
struct Moving {
  T R[9];
  Vec<T> p;
  Spatial<T> v, a, force;
  Vec<T> first;
  Sym<T> inertia;
  T G[9];
  Vec<T> P;
};
/// For an entry of tau: products of its motion column with the bodies it moves.
template <class T>
struct RowOf {
  Spatial<T> inertial;  ///< I s
  Vec<T> turning;       ///< of the transposed map of velocities, its angular part
  Vec<T> wrench;        ///< the same of a wrench that keeps its direction
};
/// Layout of a column's data for motion s, one array each: s, the angular part of v_up x s, a_up x
/// s + v_up x (v_up x s), (v_up + v) x s, and the derivatives of force by q and by qd.
enum ColumnPart : std::size_t { kS = 0, kPsi = 6, kPsi2 = 9, kSum = 15, kByQ = 21, kByRate = 27 };
inline constexpr std::size_t kColumnParts = 33;
/// Rows computed before they are passed on, since reading them at once would stall.
inline constexpr std::size_t kRowsHeld = 8;

template <class T>
struct DerivativeScratch {
  Scratch<T> own;
  Moving<T>* bodies;
  RowOf<T>* rows;       // one a column
  double* columns;      // kColumnParts arrays
  std::size_t stride;   // doubles from one to the next
  double* row;          // kRowsHeld rows of by_q and of by_rate, padded by one vector
  T *by_q, *by_rate;    // n * n, of Lanes
  T* m;                 // n * n padded by one vector, of forward dynamics
  double* right_sides;  // n rows of `width` doubles: by q, by qd, unit matrix
  std::size_t width;

  RMP_INLINE T* column(std::size_t part) const {
    return reinterpret_cast<T*>(columns + part * stride);
  }
};

template <class T>
std::size_t lay_out(const Mechanism& m, const Task& task, bool forward, double* at,
                    DerivativeScratch<T>& x) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double);
  std::size_t used = lay_out(m, task, at, x.own);
  used = (used + 7) / 8 * 8;
  if (at) at += (64 - reinterpret_cast<std::uintptr_t>(at) % 64) % 64 / sizeof(double);
  const auto take = [&](std::size_t doubles) {
    double* here = at ? at + used : nullptr;
    used += (doubles + 7) / 8 * 8;
    return here;
  };
  const std::size_t n = m.velocities, c = m.columns;
  x.bodies = reinterpret_cast<Moving<T>*>(take(m.count * sizeof(Moving<T>) / 8));
  x.rows = reinterpret_cast<RowOf<T>*>(take(c * sizeof(RowOf<T>) / 8));
  x.stride = padded(c * kWide) + kLanes;
  x.columns = take(kColumnParts * x.stride);
  x.row = take(2 * kRowsHeld * x.stride);
  x.by_q = reinterpret_cast<T*>(take(kWide == 1 ? 0 : n * n * kWide));
  x.by_rate = reinterpret_cast<T*>(take(kWide == 1 ? 0 : n * n * kWide));
  x.m = reinterpret_cast<T*>(take(forward ? n * n * kWide + kLanes : 0));
  x.width = padded(3 * n * kWide);
  x.right_sides = take(forward ? n * x.width : 0);
  return used + 8;
}

/// A `double` coefficient for vectors of kLanes columns, and for one Lanes.
RMP_INLINE Lanes widened(double x) { return splat<Lanes>(x); }
RMP_INLINE Lanes widened(const Lanes& x) { return x; }

template <class T>
RMP_INLINE Spatial<T> column_of(const DerivativeScratch<T>& x, std::size_t part, std::size_t c) {
  const auto at = [&](std::size_t k) { return x.column(part + k)[c]; };
  return {{at(0), at(1), at(2)}, {at(3), at(4), at(5)}};
}
template <class T>
RMP_INLINE void put_column(const DerivativeScratch<T>& x, std::size_t part, std::size_t c,
                           const Spatial<T>& s) {
  x.column(part)[c] = s.n.x, x.column(part + 1)[c] = s.n.y, x.column(part + 2)[c] = s.n.z;
  x.column(part + 3)[c] = s.f.x, x.column(part + 4)[c] = s.f.y, x.column(part + 5)[c] = s.f.z;
}

/// Positions, motions and forces of one body, and the data of its columns before their forces.
template <Turn K, class T>
RMP_INLINE void sweep_one(const Mechanism& m, std::size_t j, const Spatial<T>& base_v,
                          const Spatial<T>& base_a, const T* qd, const T* qdd,
                          const DerivativeScratch<T>& x) {
  const Body& b = m.bodies[j];
  const spatial::JointConstants& k = b.joint;
  Moving<T>& o = x.bodies[j];
  const auto turn = rotation<K>(x.own, b, j);
  const bool has_own_place = moves(k);
  Spatial<T> v = base_v, a = base_a;
  const T one = splat<T>(1), none{};
  Vec<T> rows[3] = {{one, none, none}, {none, one, none}, {none, none, one}};
  const Vec<T> moved = has_own_place ? x.own.places[j].p : vec<T>(k.p);
  if (k.parent >= 0) {
    const Moving<T>& up = x.bodies[k.parent];
    for (int r = 0; r < 3; ++r) rows[r] = {up.R[3 * r], up.R[3 * r + 1], up.R[3 * r + 2]};
    o.p = up.p + Vec<T>{dot(rows[0], moved), dot(rows[1], moved), dot(rows[2], moved)};
    v = up.v, a = up.a;
  } else {
    o.p = moved;
  }
  for (int r = 0; r < 3; ++r) {
    const Vec<T> row = turn.back(rows[r]);
    o.R[3 * r] = row.x, o.R[3 * r + 1] = row.y, o.R[3 * r + 2] = row.z;
  }
  const auto axis = [&](std::size_t i) { return Vec<T>{o.R[i], o.R[3 + i], o.R[6 + i]}; };
  const std::size_t first = b.column;
  const Spatial<T> v_up = v, a_up = a;
  const auto before = [&](std::size_t c, const Spatial<T>& s) {
    const Spatial<T> psi = cross(v_up, s);
    put_column(x, kS, c, s);
    put_column(x, kPsi2, c, cross(a_up, s) + cross(v_up, psi));
    x.column(kPsi)[c] = psi.n.x, x.column(kPsi + 1)[c] = psi.n.y, x.column(kPsi + 2)[c] = psi.n.z;
    return psi;
  };
  if constexpr (K == Turn::ball) {
    const bool is_free = k.type == JointType::free;
    const std::size_t slides = is_free ? 3 : 0, count = slides + 3;
    Spatial<T> rate{}, push{};
    Spatial<T> psi[6];
    for (std::size_t i = 0; i < count; ++i) {
      const Vec<T> z = axis(i % 3);
      const Spatial<T> s = i < slides ? Spatial<T>{Vec<T>{}, z} : Spatial<T>{z, cross(o.p, z)};
      psi[i] = before(first + i, s);
      rate = rate + scaled(s, qd[i]);
      push = push + scaled(s, qdd[i]);
    }
    v = v + rate;
    a = a + push + cross(v, rate);
    for (std::size_t i = 0; i < count; ++i)
      put_column(x, kSum, first + i, psi[i] + cross(v, column_of(x, kS, first + i)));
  } else {
    const Vec<T> z = scaled(axis(2), k.ratio);
    const Spatial<T> s =
        k.type == JointType::prismatic ? Spatial<T>{Vec<T>{}, z} : Spatial<T>{z, cross(o.p, z)};
    const Spatial<T> psi = before(first, s);
    put_column(x, kSum, first, psi + psi);  // v x s is v_up x s
    v = v + scaled(s, qd[0]);
    a = a + scaled(s, qdd[0]) + scaled(psi, qd[0]);
  }
  o.v = v, o.a = a;
  // About the base's origin, as in add_carried().
  const double* I = b.inertia;
  const Vec<T> h = multiply(o.R, plain(b.first)), g = h + scaled(o.p, 0.5 * b.mass);
  const Sym<T> turned_inertia = turned(o.R, Sym<T>{splat<T>(I[0]), splat<T>(I[1]), splat<T>(I[2]),
                                                   splat<T>(I[3]), splat<T>(I[4]), splat<T>(I[5])});
  const T xx = o.p.x * g.x, yy = o.p.y * g.y, zz = o.p.z * g.z;
  Sym<T>& J = o.inertia;
  J.xx = turned_inertia.xx + 2.0 * (yy + zz);
  J.yy = turned_inertia.yy + 2.0 * (xx + zz);
  J.zz = turned_inertia.zz + 2.0 * (xx + yy);
  J.xy = turned_inertia.xy - (o.p.x * g.y + g.x * o.p.y);
  J.yz = turned_inertia.yz - (o.p.y * g.z + g.y * o.p.z);
  J.xz = turned_inertia.xz - (o.p.x * g.z + g.x * o.p.z);
  o.first = h + scaled(o.p, b.mass);
  const Vec<T>&w = v.n, &u = v.f;
  const Vec<T> L = multiply(J, w) + cross(o.first, u);
  o.P = scaled(u, b.mass) + cross(w, o.first);
  o.force.n = multiply(J, a.n) + cross(o.first, a.f) + cross(w, L) + cross(u, o.P);
  o.force.f = scaled(a.f, b.mass) + cross(a.n, o.first) + cross(w, o.P);
  // G = u first^T + [w] S with the second moments S = tr(J) / 2 - J.
  const T half = 0.5 * (J.xx + J.yy + J.zz), none_xy = -J.xy, none_yz = -J.yz, none_xz = -J.xz;
  const Vec<T> c0 = cross(w, Vec<T>{half - J.xx, none_xy, none_xz}),
               c1 = cross(w, Vec<T>{none_xy, half - J.yy, none_yz}),
               c2 = cross(w, Vec<T>{none_xz, none_yz, half - J.zz});
  o.G[0] = u.x * o.first.x + c0.x, o.G[1] = u.x * o.first.y + c1.x, o.G[2] = u.x * o.first.z + c2.x;
  o.G[3] = u.y * o.first.x + c0.y, o.G[4] = u.y * o.first.y + c1.y, o.G[5] = u.y * o.first.z + c2.y;
  o.G[6] = u.z * o.first.x + c0.z, o.G[7] = u.z * o.first.y + c1.z, o.G[8] = u.z * o.first.z + c2.z;
}

template <class T>
RMP_INLINE void add(Moving<T>& to, const Moving<T>& c) {
  to.force = to.force + c.force;
  to.first = to.first + c.first;
  to.inertia.xx += c.inertia.xx, to.inertia.yy += c.inertia.yy, to.inertia.zz += c.inertia.zz;
  to.inertia.xy += c.inertia.xy, to.inertia.yz += c.inertia.yz, to.inertia.xz += c.inertia.xz;
  for (int i = 0; i < 9; ++i) to.G[i] += c.G[i];
  to.P = to.P + c.P;
}

/// The force of an acceleration, and that of a velocity in addition to the body's own motion.
template <class T>
RMP_INLINE Spatial<T> inertial(const Moving<T>& o, double mass, const Spatial<T>& y) {
  return {multiply(o.inertia, y.n) + cross(o.first, y.f), scaled(y.f, mass) + cross(y.n, o.first)};
}
template <class T>
RMP_INLINE Spatial<T> turning(const Moving<T>& o, const T& trace, const Vec<T>& w) {
  return {scaled(scaled(w, trace) - multiply(o.G, w), 2.0), scaled(cross(w, o.P), 2.0)};
}

/// A wrench at a tip: moment and force in the base's axes, and its point of application.
template <class T>
struct Acting {
  Vec<T> moment, force, at;
};

/// All of the columns. A null wrench means none.
template <class T>
void derivative_columns(const Mechanism& m, const BaseState<T>& base, const T* qd, const T* qdd,
                        const TipPath* tip, const T* wrench, const DerivativeScratch<T>& x) {
  const Spatial<T> v{base.rests ? Vec<T>{} : base.w, Vec<T>{}},
      a{base.rests ? Vec<T>{} : base.wd, base.a};
  for (std::size_t j = 0; j < m.count; ++j) {
    const spatial::JointConstants& k = m.bodies[j].joint;
    by_turn(k.turn, [&](auto kind) {
      sweep_one<kind.kTurn>(m, j, v, a, qd + k.v_index, qdd + k.v_index, x);
    });
  }
  Acting<T> acting{};
  if (wrench && tip->count > 0) {
    Moving<T>& o = x.bodies[tip->joints[tip->count - 1]];
    acting.force = {wrench[0], wrench[1], wrench[2]};
    acting.moment = {wrench[3], wrench[4], wrench[5]};
    acting.at = o.p + multiply(o.R, plain(tip->p));
    o.force.n = o.force.n - (acting.moment + cross(acting.at, acting.force));
    o.force.f = o.force.f - acting.force;
  }
  for (std::size_t j = m.count; j-- > 0;) {
    const Body& b = m.bodies[j];
    const Moving<T>& o = x.bodies[j];
    if (b.joint.parent >= 0) add(x.bodies[b.joint.parent], o);
    const T trace = o.G[0] + o.G[4] + o.G[8];
    const std::size_t first = b.column;
    for (std::size_t c = first; c < first + static_cast<std::size_t>(b.joint.velocity_count); ++c) {
      const Spatial<T> s = column_of(x, kS, c);
      const Vec<T> psi{x.column(kPsi)[c], x.column(kPsi + 1)[c], x.column(kPsi + 2)[c]};
      RowOf<T>& row = x.rows[c];
      row.inertial = inertial(o, b.carried, s);
      row.turning = scaled(scaled(s.n, trace) - multiply_back(o.G, s.n) + cross(o.P, s.f), 2.0);
      // The bodies before the joint carry its rotated forces.
      put_column(
          x, kByQ, c,
          inertial(o, b.carried, column_of(x, kPsi2, c)) + turning(o, trace, psi) +
              Spatial<T>{cross(s.n, o.force.n) + cross(s.f, o.force.f), cross(s.n, o.force.f)});
      put_column(x, kByRate, c,
                 inertial(o, b.carried, column_of(x, kSum, c)) + turning(o, trace, s.n));
    }
  }
  if (!wrench) return;
  // The wrench keeps its direction when preceding joints rotate.
  for (std::size_t c = 0; c < m.columns; ++c) x.rows[c].wrench = Vec<T>{};
  const Vec<T>&M = acting.moment, &F = acting.force;
  for (std::int32_t i = 0; i < tip->count; ++i) {
    const Body& b = m.bodies[tip->joints[i]];
    const std::size_t first = b.column;
    for (std::size_t c = first; c < first + static_cast<std::size_t>(b.joint.velocity_count); ++c) {
      const Spatial<T> s = column_of(x, kS, c);
      x.rows[c].wrench = cross(M, s.n) + cross(F, s.f + cross(s.n, acting.at));
      const Vec<T> turned_force = cross(s.n, F);
      put_column(x, kByQ, c,
                 column_of(x, kByQ, c) +
                     Spatial<T>{cross(s.n, M) + cross(acting.at, turned_force), turned_force});
    }
  }
}

/// Products of six numbers of a row with those of the columns.
template <class T>
struct Coefficients {
  Lanes k[6];
  RMP_INLINE explicit Coefficients(const Spatial<T>& s)
      : k{widened(s.n.x), widened(s.n.y), widened(s.n.z),
          widened(s.f.x), widened(s.f.y), widened(s.f.z)} {}
  RMP_INLINE Lanes operator()(const double* columns, std::size_t stride) const {
    return (k[0] * load(columns) + k[1] * load(columns + stride)) +
           (k[2] * load(columns + 2 * stride) + k[3] * load(columns + 3 * stride)) +
           (k[4] * load(columns + 4 * stride) + k[5] * load(columns + 5 * stride));
  }
};

/// Output matrices, rows of `width` T: `sign` times the result, added to or replacing the content.
template <class T>
struct Target {
  T *by_q, *by_rate;  ///< by_rate null = not requested
  std::size_t width;
  double sign = 1;
  bool adds = false;
};

/// The matrices of a chain with columns in the order of the entries of tau, row by row. A null m is
/// not requested; its rows may be written up to a vector beyond their end.
template <class T>
void ordered_matrices(const Mechanism& m, bool wrench, const DerivativeScratch<T>& x,
                      const Target<T>& to, T* inertia) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double);
  const std::size_t n = m.columns, stride = x.stride;
  const double* const all = x.columns;
  std::size_t held = 0;
  const bool rates = to.by_rate != nullptr;
  const auto hand_on = [&](const double* row, T* there) {
    auto* const at = reinterpret_cast<double*>(there);
    if (to.adds)
      for (std::size_t i = 0; i < n * kWide; ++i) at[i] += to.sign * row[i];
    else if (to.sign == 1) __builtin_memcpy(at, row, n * kWide * sizeof(double));
    else
      for (std::size_t i = 0; i < n * kWide; ++i) at[i] = to.sign * row[i];
  };
  const auto flush = [&](std::size_t behind) {
    for (std::size_t i = 0; i < held; ++i) {
      const std::size_t r = behind - held + i;
      hand_on(x.row + 2 * i * stride, to.by_q + r * to.width);
      if (rates) hand_on(x.row + (2 * i + 1) * stride, to.by_rate + r * to.width);
    }
    held = 0;
  };
  for (std::size_t j = 0; j < m.count; ++j) {
    const Body& b = m.bodies[j];
    const std::size_t first = b.column;
    const std::size_t end = (first + static_cast<std::size_t>(b.joint.velocity_count)) * kWide;
    for (std::size_t r = first; r < end / kWide; ++r) {
      const RowOf<T>& row = x.rows[r];
      double *const to_q = x.row + 2 * held * stride, *const to_rate = to_q + stride;
      const Coefficients<T> force(row.inertial), motion(column_of(x, kS, r));
      const Lanes u[3] = {widened(row.turning.x), widened(row.turning.y), widened(row.turning.z)};
      const Vec<T> bent = wrench ? row.wrench : Vec<T>{};
      const Lanes e[3] = {widened(bent.x), widened(bent.y), widened(bent.z)};
      const auto three = [&](const Lanes* t, const double* from) {
        return t[0] * load(from) + t[1] * load(from + stride) + t[2] * load(from + 2 * stride);
      };
      for (std::size_t at = 0; at < end; at += kLanes) {
        const double* const here = all + at;
        Lanes q = force(here + kPsi2 * stride, stride) + three(u, here + kPsi * stride);
        if (wrench) q += three(e, here + kS * stride);
        store(to_q + at, q);
        if (rates)
          store(to_rate + at, force(here + kSum * stride, stride) + three(u, here + kS * stride));
      }
      for (std::size_t at = end; at < n * kWide; at += kLanes) {
        const double* const here = all + at;
        store(to_q + at, motion(here + kByQ * stride, stride));
        if (rates) store(to_rate + at, motion(here + kByRate * stride, stride));
      }
      if (++held == kRowsHeld) flush(r + 1);
      if (!inertia) continue;
      double* const to_m = reinterpret_cast<double*>(inertia) + r * n * kWide;
      for (std::size_t at = 0; at < end; at += kLanes)
        store(to_m + at, force(all + at + kS * stride, stride));
    }
  }
  flush(n);
}

template <class T>
RMP_INLINE T product(const Spatial<T>& a, const Spatial<T>& b) {
  return dot(a.n, b.n) + dot(a.f, b.f);
}
/// The same for any tree: sums over pairs of columns of which one moves the other.
template <class T>
void matrices_of_tree(const Mechanism& m, bool wrench, const DerivativeScratch<T>& x,
                      const Target<T>& to, T* inertia) {
  const std::size_t n = m.velocities;
  const bool rates = to.by_rate != nullptr;
  for (std::size_t r = 0; r < n; ++r)
    for (std::size_t c = 0; c < n; ++c) {
      if (!to.adds) to.by_q[r * to.width + c] = T{};
      if (!to.adds && rates) to.by_rate[r * to.width + c] = T{};
      if (inertia) inertia[r * n + c] = T{};
    }
  for (std::size_t j = 0; j < m.count; ++j) {
    const spatial::JointConstants& own = m.bodies[j].joint;
    for (std::int32_t k = 0; k < own.velocity_count; ++k) {
      const std::size_t r = m.bodies[j].column + static_cast<std::size_t>(k),
                        entry = static_cast<std::size_t>(own.v_index + k);
      const RowOf<T> row = x.rows[r];
      const Spatial<T> by_turn = column_of(x, kByQ, r), by_speed = column_of(x, kByRate, r);
      for (auto i = static_cast<std::int32_t>(j); i >= 0; i = m.bodies[i].joint.parent) {
        const spatial::JointConstants& other = m.bodies[i].joint;
        const bool is_other = i != static_cast<std::int32_t>(j);
        for (std::int32_t l = 0; l < other.velocity_count; ++l) {
          const std::size_t c = m.bodies[i].column + static_cast<std::size_t>(l),
                            from = static_cast<std::size_t>(other.v_index + l);
          const std::size_t below = entry * to.width + from, above = from * to.width + entry;
          const Spatial<T> s = column_of(x, kS, c);
          const Vec<T> psi{x.column(kPsi)[c], x.column(kPsi + 1)[c], x.column(kPsi + 2)[c]};
          T q = product(row.inertial, column_of(x, kPsi2, c)) + dot(row.turning, psi);
          if (wrench) q += dot(row.wrench, s.n);
          to.by_q[below] += to.sign * q;
          if (is_other) to.by_q[above] += to.sign * product(s, by_turn);
          if (rates) {
            to.by_rate[below] +=
                to.sign * (product(row.inertial, column_of(x, kSum, c)) + dot(row.turning, s.n));
            if (is_other) to.by_rate[above] += to.sign * product(s, by_speed);
          }
          if (inertia) {
            const T mass = product(row.inertial, s);
            inertia[entry * n + from] += mass;
            if (is_other) inertia[from * n + entry] += mass;
          }
        }
      }
    }
  }
}

/// Motors, springs and friction, on the diagonals.
template <class T>
void add_resistance_rates(const Mechanism& m, std::uint32_t terms, const Target<T>& to,
                          T* inertia) {
  for (std::size_t j = 0; j < m.count; ++j) {
    const Body& b = m.bodies[j];
    if (!b.resists) continue;  // joints of several coordinates do not
    const double square = b.joint.ratio * b.joint.ratio;
    const auto v = static_cast<std::size_t>(b.joint.v_index);
    if (inertia) inertia[v * m.velocities + v] += square * b.armature;
    if (terms & kSpringTerm) to.by_q[v * to.width + v] += to.sign * square * b.stiffness;
    if (terms & kFrictionTerm) to.by_rate[v * to.width + v] += to.sign * square * b.viscous;
  }
}

/// The derivatives of the selected terms' tau, after place(), times the target's sign; `inertia` (n
/// * n, its lower triangle at least) unless null. `forward`: of the forces for constant qdd.
template <class T>
void torque_derivatives(const Mechanism& m, const Task& task, const Inputs<T>& in,
                        const BaseRow& row, bool forward, const DerivativeScratch<T>& x,
                        const Target<T>& to, T* inertia) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double);
  const bool gravity = task.terms & kGravityTerm, velocity = task.terms & kVelocityTerm;
  const bool inertial = forward || (task.terms & kInertialTerm);
  const T* wrench = (task.terms & kExternalTerm) ? in.wrench : nullptr;
  const TipPath* tip = wrench ? m.tips + task.tip : nullptr;
  if (tip && tip->count == 0) wrench = nullptr;
  const std::size_t n = m.velocities;
  const auto matrices = [&](bool bends, const Target<T>& target, T* mass) {
    if (m.ordered) ordered_matrices(m, bends, x, target, mass);
    else matrices_of_tree(m, bends, x, target, mass);
  };
  // Vectors read beyond the last column.
  for (std::size_t part = 0; part < kColumnParts && m.ordered; ++part)
    for (std::size_t at = m.columns * kWide; at < x.stride; ++at)
      x.columns[part * x.stride + at] = 0;
  derivative_columns(m, base_state<T>(m, row, gravity, velocity || inertial, inertial),
                     velocity ? in.qd : x.own.zeros, inertial ? in.qdd : x.own.zeros, tip, wrench,
                     x);
  Target<T> first = to;
  if (!velocity) {
    first.by_rate = nullptr;
    for (std::size_t r = 0; r < n; ++r)
      for (std::size_t c = 0; c < n; ++c) to.by_rate[r * to.width + c] = T{};
  }
  matrices(wrench != nullptr, first, inertia);
  // A rotating base contributes inertial terms.
  if (row.first && velocity && !inertial) {
    derivative_columns(m, base_state<T>(m, row, false, true, false), x.own.zeros, x.own.zeros,
                       nullptr, static_cast<const T*>(nullptr), x);
    matrices(false, {to.by_q, nullptr, to.width, -to.sign, true}, nullptr);
  }
  if (m.resists) add_resistance_rates(m, task.terms, to, inertia);
}

template <std::size_t N>
struct CountOf {
  static constexpr std::size_t kCount = N;
};
/// Solves M X = B for all columns of B at once with a factored M; rows of `width` doubles, a
/// multiple of kLanes. From column `unit` on B is the unit matrix.
template <class T>
void solve_all(const Mechanism& m, const T* M, double* B, std::size_t width, std::size_t unit) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double);
  const std::size_t n = m.velocities;
  const auto strip = [&](auto count, std::size_t at) {
    constexpr std::size_t kVectors = decltype(count)::kCount;
    Lanes sum[kVectors];
    const auto read = [&](std::size_t row) {
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kVectors; ++i) sum[i] = load(B + row * width + at + i * kLanes);
    };
    const auto write = [&](std::size_t row) {
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kVectors; ++i) store(B + row * width + at + i * kLanes, sum[i]);
    };
    const auto take_off = [&](const T& factor, std::size_t row) {
      const Lanes f = widened(factor);
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kVectors; ++i)
        sum[i] -= f * load(B + row * width + at + i * kLanes);
    };
    // Rows of the unit matrix behind its diagonal are zero, and stay so here.
    const std::size_t first = at / kWide, end = (at + kVectors * kLanes - 1) / kWide + 1;
    const std::size_t rows = first < unit || end - unit > n ? n : end - unit;
    if (m.dense) {
      for (std::size_t k = rows; k-- > 0;) {  // L^T Y = B
        read(k);
        for (std::size_t i = k + 1; i < rows; ++i) take_off(M[i * n + k], i);
        write(k);
      }
    } else {
      for (std::size_t k = rows; k-- > 0;) {
        Lanes from[kVectors];
        for (std::size_t i = 0; i < kVectors; ++i) from[i] = load(B + k * width + at + i * kLanes);
        for (std::int32_t e = m.entry_parent[k]; e >= 0; e = m.entry_parent[e]) {
          const auto to = static_cast<std::size_t>(e);
          const Lanes f = widened(M[k * n + to]);
          read(to);
          for (std::size_t i = 0; i < kVectors; ++i) sum[i] -= f * from[i];
          write(to);
        }
      }
    }
    for (std::size_t k = 0; k < n; ++k) {  // L X = D^-1 Y
      read(k);
      const Lanes inverse = widened(M[k * n + k]);
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kVectors; ++i) sum[i] *= inverse;
      if (m.dense) {
        for (std::size_t i = 0; i < k; ++i) take_off(M[k * n + i], i);
      } else {
        for (std::int32_t e = m.entry_parent[k]; e >= 0; e = m.entry_parent[e])
          take_off(M[k * n + static_cast<std::size_t>(e)], static_cast<std::size_t>(e));
      }
      write(k);
    }
  };
  std::size_t at = 0;
  for (; at + 8 * kLanes <= width; at += 8 * kLanes) strip(CountOf<8>{}, at);
  for (; at + 4 * kLanes <= width; at += 4 * kLanes) strip(CountOf<4>{}, at);
  for (; at < width; at += kLanes) strip(CountOf<1>{}, at);
}

}  // namespace robomosp::spatial::recursions::RMP_LANES
