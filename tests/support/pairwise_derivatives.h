// SPDX-License-Identifier: Apache-2.0
// The slower path that derivatives of dynamics are held against: 6 x 6 maps of composite bodies,
// multiplied for every pair of joints of which one carries the other. A second implementation of
// what modules/spatial/recursion_derivatives.h computes; it shares no formula of the maps with it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "spatial/body_tree.h"

namespace robomosp::test {

using namespace spatial;

/// A 6 x 6 matrix from motions to forces: blocks of (angular, linear), row-major each.
struct Map6 {
  std::array<double, 36> m{};
  [[nodiscard]] Screw operator*(const Screw& v) const {
    const double x[6] = {v.angular[0], v.angular[1], v.angular[2],
                         v.linear[0],  v.linear[1],  v.linear[2]};
    double y[6];
    for (std::size_t i = 0; i < 6; ++i) {
      y[i] = 0;
      for (std::size_t j = 0; j < 6; ++j) y[i] += m[6 * i + j] * x[j];
    }
    return {{y[0], y[1], y[2]}, {y[3], y[4], y[5]}};
  }
};
static_assert(sizeof(Map6) == 36 * sizeof(double));

/// How a body's force changes with its velocity: x -> I (x cross v) + x cross* I v + v cross* I x.
inline Map6 velocity_map(const RigidInertia& inertia, const Screw& v) {
  Map6 out;
  const Screw h = multiply(inertia, v);
  for (std::size_t j = 0; j < 6; ++j) {
    Screw x;
    (j < 3 ? x.angular[j] : x.linear[j - 3]) = 1;
    const Screw y = add(multiply(inertia, cross_motion(x, v)),
                        add(cross_force(x, h), cross_force(v, multiply(inertia, x))));
    for (std::size_t i = 0; i < 3; ++i) {
      out.m[6 * i + j] = y.angular[i];
      out.m[6 * (i + 3) + j] = y.linear[i];
    }
  }
  return out;
}

inline std::size_t pairwise_scratch(const BodyTree& tree) {
  return tree_scratch(tree) + tree.bodies.size() * 36 + tree.velocities;
}

/// Partial derivatives of one sample's tau by small joint motions and by qd: dof * dof each,
/// row-major, row = entry of tau, for the chosen terms. `qdd` replaces the batch's when not null.
inline void pairwise_derivatives(const BodyTree& tree, const DynamicsBatch& batch,
                                 std::size_t sample, const double* qdd, bool forward,
                                 double* scratch, std::span<double> by_q, std::span<double> by_qd) {
  const std::size_t n = tree.velocities;
  const std::uint32_t terms = forward ? batch.terms | kInertialTerm : batch.terms;
  const TreeScratch s = take_scratch(tree, scratch);
  const std::span<Map6> maps(reinterpret_cast<Map6*>(s.rest), tree.bodies.size());
  std::fill(by_q.begin(), by_q.end(), 0.0);
  std::fill(by_qd.begin(), by_qd.end(), 0.0);

  const auto add_motion = [&](TreeState state, double sign) {
    sweep(tree, state, s.bodies, s.columns);
    for (std::size_t i = 0; i < tree.bodies.size(); ++i)
      maps[i] = velocity_map(s.bodies[i].inertia, s.bodies[i].velocity);
    gather(tree, s.bodies, true);
    for (std::size_t i = tree.bodies.size(); i-- > 0;)
      if (const std::int32_t parent = tree.bodies[i].parent; parent >= 0)
        for (std::size_t k = 0; k < 36; ++k)
          maps[static_cast<std::size_t>(parent)].m[k] += maps[i].m[k];
    for (std::size_t d = 0; d < tree.bodies.size(); ++d) {
      const TreeBody& row = tree.bodies[d];
      for (auto i = static_cast<std::int32_t>(d); i >= 0;
           i = tree.bodies[static_cast<std::size_t>(i)].parent) {
        const TreeBody& b = tree.bodies[static_cast<std::size_t>(i)];
        const auto up = static_cast<std::size_t>(b.parent);
        const Screw v_up = b.parent < 0 ? state.base_velocity : s.bodies[up].velocity;
        const Screw a_up = b.parent < 0 ? state.base_acceleration : s.bodies[up].acceleration;
        for (std::int32_t k = 0; k < b.columns; ++k) {
          const Screw column = s.columns[static_cast<std::size_t>(b.column + k)];
          // What the bodies carried feel beyond turning with the joint.
          const Screw psi = cross_motion(v_up, column);
          const Screw psi2 = add(cross_motion(a_up, column), cross_motion(v_up, psi));
          const Screw phi = cross_motion(s.bodies[static_cast<std::size_t>(i)].velocity, column);
          const auto entry = static_cast<std::size_t>(b.v_index + k);
          const Screw f_q = add(multiply(s.bodies[d].inertia, psi2), maps[d] * psi);
          const Screw f_qd = add(multiply(s.bodies[d].inertia, add(phi, psi)), maps[d] * column);
          const auto put = [&](const TreeBody& to, const Screw& q_part) {
            for (std::int32_t l = 0; l < to.columns; ++l) {
              const Screw& c = s.columns[static_cast<std::size_t>(to.column + l)];
              const std::size_t at = static_cast<std::size_t>(to.v_index + l) * n + entry;
              by_q[at] += sign * dot(c, q_part);
              if (state.qd) by_qd[at] += sign * dot(c, f_qd);
            }
          };
          put(row, f_q);
          if (i != static_cast<std::int32_t>(d)) continue;
          // The bodies before the joint carry its forces turned.
          const Screw f_up = add(f_q, cross_force(column, s.bodies[d].force));
          for (std::int32_t a = b.parent; a >= 0;
               a = tree.bodies[static_cast<std::size_t>(a)].parent)
            put(tree.bodies[static_cast<std::size_t>(a)], f_up);
        }
      }
    }
  };

  TreeState state = state_of(tree, batch, sample, terms, false);
  if (qdd) state.qdd = qdd;
  if (!(terms & kInertialTerm)) {
    if (!(terms & kVelocityTerm)) {
      state.base_velocity = {};
    } else if (norm(state.base_velocity.angular) > 0) {
      TreeState still;
      still.q = state.q;
      still.base_velocity = state.base_velocity;
      add_motion(still, -1);
    }
  }
  add_motion(state, 1);

  if ((terms & kExternalTerm) && !batch.tip.empty() &&
      tree.tips[static_cast<std::size_t>(batch.tip_index)].joint >= 0) {
    const TipModel& tip = tree.tips[static_cast<std::size_t>(batch.tip_index)];
    const TipWrench& w = batch.tip[batch.tip.size() == 1 ? 0 : sample];
    const Vec3 at = transform(s.bodies[static_cast<std::size_t>(tip.joint)].pose, tip.tool.p);
    const Screw f{add(w.moment, cross(at, w.force)), w.force};
    for (std::int32_t k = tip.joint; k >= 0; k = tree.bodies[static_cast<std::size_t>(k)].parent) {
      const TreeBody& by = tree.bodies[static_cast<std::size_t>(k)];
      for (std::int32_t c = 0; c < by.columns; ++c) {
        const Screw& column = s.columns[static_cast<std::size_t>(by.column + c)];
        const Vec3 moved = add(column.linear, cross(column.angular, at));
        const Screw df{cross(moved, w.force), {}};
        for (std::int32_t i = tip.joint; i >= 0;
             i = tree.bodies[static_cast<std::size_t>(i)].parent) {
          const TreeBody& row = tree.bodies[static_cast<std::size_t>(i)];
          for (std::int32_t l = 0; l < row.columns; ++l) {
            const Screw& r = s.columns[static_cast<std::size_t>(row.column + l)];
            double x = dot(r, df);
            if (i >= k) x += dot(cross_motion(column, r), f);
            by_q[static_cast<std::size_t>(row.v_index + l) * n +
                 static_cast<std::size_t>(by.v_index + c)] -= x;
          }
        }
      }
    }
  }
  for (const TreeBody& b : tree.bodies) {
    const auto v = static_cast<std::size_t>(b.v_index);
    if (terms & kSpringTerm) by_q[v * n + v] += b.ratio * b.ratio * b.spring.stiffness;
    if ((terms & kFrictionTerm) && !batch.qd.empty())
      for (std::size_t k = v; k < v + static_cast<std::size_t>(b.columns); ++k)
        by_qd[k * n + k] += b.ratio * b.ratio * b.friction.viscous;
  }
}

/// The same of accelerations, at those that the torques cause; false where M is not positive
/// definite.
inline bool pairwise_derivatives(const BodyTree& tree, const DynamicsBatch& batch,
                                 std::size_t sample, const double* qdd, double* scratch,
                                 std::span<double> by_q, std::span<double> by_qd,
                                 std::span<double> by_tau) {
  const std::size_t n = tree.velocities;
  pairwise_derivatives(tree, batch, sample, qdd, true, scratch, by_q, by_qd);
  const TreeScratch swept = take_scratch(tree, scratch);
  std::vector<double> m(n * n), column(n);
  tree_inertia(tree, swept.bodies, swept.columns, m);
  if (cholesky(m, n) >= 0) return false;
  std::fill(by_tau.begin(), by_tau.end(), 0.0);
  for (std::size_t k = 0; k < n; ++k) by_tau[k * n + k] = 1;
  for (const std::span<double> d : {by_q, by_qd, by_tau})
    for (std::size_t c = 0; c < n; ++c) {
      const double sign = d.data() == by_tau.data() ? 1 : -1;
      for (std::size_t r = 0; r < n; ++r) column[r] = sign * d[r * n + c];
      cholesky_solve(m, n, column.data());
      for (std::size_t r = 0; r < n; ++r) d[r * n + c] = column[r];
    }
  return true;
}

}  // namespace robomosp::test
