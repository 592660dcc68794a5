// SPDX-License-Identifier: Apache-2.0
// Accelerations by articulated bodies in O(n) (Featherstone, Rigid Body Dynamics Algorithms, 7.3)
// of mechanisms at rest without weight: Newton-Euler has taken all other forces off before. Trees
// of revolute and prismatic joints; for sources of robomosp_lanes() (layer: data processing,
// spatial).
#pragma once

#include "spatial/recursion_torques.h"

namespace robomosp::spatial::recursions::RMP_LANES {

template <class T>
RMP_INLINE void add(Sym<T>& to, const Sym<T>& m) {
  to.xx += m.xx, to.yy += m.yy, to.zz += m.zz;
  to.xy += m.xy, to.yz += m.yz, to.xz += m.xz;
}
template <class T>
RMP_INLINE void add(ArticulatedBody<T>& to, const ArticulatedBody<T>& c) {
  add(to.A, c.A), add(to.M, c.M);
  for (int r = 0; r < 3; ++r) to.B[r] = to.B[r] + c.B[r];
  to.n = to.n + c.n, to.f = to.f + c.f;
}
template <class T>
RMP_INLINE void add_rigid(ArticulatedBody<T>& to, const Body& b) {
  const double *I = b.inertia, *h = b.first;
  to.A.xx += I[0], to.A.yy += I[1], to.A.zz += I[2];
  to.A.xy += I[3], to.A.yz += I[4], to.A.xz += I[5];
  to.M.xx += b.mass, to.M.yy += b.mass, to.M.zz += b.mass;
  to.B[0].y -= h[2], to.B[0].z += h[1], to.B[1].x += h[2];
  to.B[1].z -= h[0], to.B[2].x -= h[1], to.B[2].y += h[0];
}
// Takes k u^T away.
template <class T>
RMP_INLINE void subtract(Sym<T>& m, const Vec<T>& k, const Vec<T>& u) {
  m.xx -= k.x * u.x, m.yy -= k.y * u.y, m.zz -= k.z * u.z;
  m.xy -= k.x * u.y, m.yz -= k.y * u.z, m.xz -= k.x * u.z;
}

// The same body seen from the parent's frame, where the joint's is turned and at p.
template <Turn K, class T, class P>
RMP_INLINE ArticulatedBody<T> moved(const ArticulatedBody<T>& c, const Rotation<K, T>& turn,
                                    const Vec<P>& p) {
  ArticulatedBody<T> o;
  const Sym<T> A = turn.forth(c.A);
  const Sym<T>& M = o.M = turn.forth(c.M);
  const Vec<T> r0 = turn.forth(c.B[0]), r1 = turn.forth(c.B[1]), r2 = turn.forth(c.B[2]);
  const Vec<T> x = turn.forth(Vec<T>{r0.x, r1.x, r2.x}), y = turn.forth(Vec<T>{r0.y, r1.y, r2.y}),
               z = turn.forth(Vec<T>{r0.z, r1.z, r2.z});
  // B + [p] M, by columns.
  const Vec<T> X = x + cross(p, Vec<T>{M.xx, M.xy, M.xz}),
               Y = y + cross(p, Vec<T>{M.xy, M.yy, M.yz}),
               Z = z + cross(p, Vec<T>{M.xz, M.yz, M.zz});
  o.B[0] = {X.x, Y.x, Z.x}, o.B[1] = {X.y, Y.y, Z.y}, o.B[2] = {X.z, Y.z, Z.z};
  // A + [p] (B before)^T - (B after) [p].
  o.A.xx = A.xx + (p.y * z.x - p.z * y.x) + (p.y * Z.x - p.z * Y.x);
  o.A.yy = A.yy + (p.z * x.y - p.x * z.y) + (p.z * X.y - p.x * Z.y);
  o.A.zz = A.zz + (p.x * y.z - p.y * x.z) + (p.x * Y.z - p.y * X.z);
  o.A.xy = A.xy + (p.y * z.y - p.z * y.y) + (p.z * X.x - p.x * Z.x);
  o.A.yz = A.yz + (p.z * x.z - p.x * z.z) + (p.x * Y.y - p.y * X.y);
  o.A.xz = A.xz + (p.y * z.z - p.z * y.z) + (p.x * Y.x - p.y * X.x);
  o.f = turn.forth(c.f);
  o.n = turn.forth(c.n) + cross(p, o.f);
  return o;
}

// Takes joint forces in `v` to accelerations, after place(). `pivots`: below it the resistance of a
// joint is rounding, one a joint. Returns a number that is not positive where one is.
template <class T>
T articulated_solve(const Mechanism& m, const double* pivots, const Scratch<T>& x, T* v) {
  T least = splat<T>(1);
  for (std::size_t j = 0; j < m.count; ++j)
    if (m.bodies[j].branches) x.branches[j] = ArticulatedBody<T>{};
  ArticulatedBody<T> c{};
  for (std::size_t j = m.count; j-- > 0;) {
    const Body& b = m.bodies[j];
    if (b.branches) add(c, x.branches[j]);
    add_rigid(c, b);
    const bool slides = b.joint.type == JointType::prismatic;
    Resistance<T>& r = x.resistances[j];
    r.n = slides ? Vec<T>{c.B[0].z, c.B[1].z, c.B[2].z} : Vec<T>{c.A.xz, c.A.yz, c.A.zz};
    r.f = slides ? Vec<T>{c.M.xz, c.M.yz, c.M.zz} : c.B[2];
    const T d = (slides ? c.M.zz : c.A.zz) + b.armature;
    least = select(d > pivots[j], least, splat<T>(-1));
    r.inverse = 1.0 / d;
    r.force = v[b.joint.v_index] - (slides ? c.f.z : c.n.z);
    const bool goes_on = b.joint.parent >= 0 && static_cast<std::size_t>(b.joint.parent) + 1 == j;
    if (b.joint.parent >= 0) {
      const Vec<T> n = scaled(r.n, r.inverse), f = scaled(r.f, r.inverse);
      subtract(c.A, n, r.n), subtract(c.M, f, r.f);
      c.B[0] = c.B[0] - scaled(r.f, n.x);
      c.B[1] = c.B[1] - scaled(r.f, n.y);
      c.B[2] = c.B[2] - scaled(r.f, n.z);
      c.n = c.n + scaled(n, r.force), c.f = c.f + scaled(f, r.force);
      by_turn(b.joint.turn, [&](auto kind) {
        if constexpr (kind.kTurn != Turn::ball) {
          const auto turn = rotation<kind.kTurn>(x, b, j);
          c = slides ? moved(c, turn, x.places[j].p) : moved(c, turn, plain(b.joint.p));
        }
      });
      if (!goes_on) add(x.branches[b.joint.parent], c);
    }
    if (!goes_on) c = ArticulatedBody<T>{};
  }
  x.links[0].wd = x.links[0].a = Vec<T>{};
  for (std::size_t j = 0; j < m.count; ++j) {
    const Body& b = m.bodies[j];
    const Link<T>& up = x.links[b.joint.parent + 1];
    Link<T>& o = x.links[j + 1];
    by_turn(b.joint.turn, [&](auto kind) {
      if constexpr (kind.kTurn != Turn::ball) {
        const auto turn = rotation<kind.kTurn>(x, b, j);
        o.wd = turn.back(up.wd);
        o.a = turn.back(up.a + (b.joint.type == JointType::prismatic
                                    ? cross(up.wd, x.places[j].p)
                                    : cross(up.wd, plain(b.joint.p))));
      }
    });
    const Resistance<T>& r = x.resistances[j];
    const T way = (r.force - (dot(r.n, o.wd) + dot(r.f, o.a))) * r.inverse;
    v[b.joint.v_index] = way;
    (b.joint.type == JointType::revolute ? o.wd.z : o.a.z) += way;
  }
  return least;
}

}  // namespace robomosp::spatial::recursions::RMP_LANES
