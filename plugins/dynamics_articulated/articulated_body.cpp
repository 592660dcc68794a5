// SPDX-License-Identifier: Apache-2.0
#include "articulated_body.h"

#include <algorithm>
#include <cmath>

#include "articulated_inertia.h"
#include "spatial/rest.h"

namespace robomosp::articulated {
namespace {

using spatial::add;
using spatial::cross;
using spatial::cross_force;
using spatial::cross_motion;
using spatial::dot;
using spatial::scale;
using spatial::sub;
using spatial::TreeBody;

constexpr double kPivot = 1e-13;  // of what the joint can carry at most

/// What the three passes leave of a body, in its joint frame.
struct State {
  Pose to_parent;  ///< parent_T_joint
  Screw v, c, a;   ///< velocity; acceleration without qdd and parent; acceleration
  ArticulatedInertia inertia;
  Screw p;  ///< force at rest of the articulated body
  Screw u;  ///< its resistance to the joint's motion
  double inverse = 0, force = 0;
};
/// The same of a joint of three or six columns.
struct Wide {
  std::array<Screw, 6> u;
  std::array<double, 36> d;  ///< factored
  std::array<double, 6> force;
};
static_assert(sizeof(State) % sizeof(double) == 0 && sizeof(Wide) % sizeof(double) == 0);
static_assert(alignof(State) == alignof(double));

struct Work {
  State* bodies;
  Wide* wide;
  double* force;  ///< of the joints' columns
  double* rate;   ///< qdd of the joints' columns
  double* rest;
};
Work work(const Articulated& a, double* scratch) {
  Work w;
  w.bodies = reinterpret_cast<State*>(scratch);
  scratch += a.tree.bodies.size() * sizeof(State) / sizeof(double);
  w.wide = reinterpret_cast<Wide*>(scratch);
  scratch += a.wide_count * sizeof(Wide) / sizeof(double);
  w.force = scratch;
  w.rate = scratch + a.tree.columns;
  w.rest = w.rate + a.tree.columns;
  return w;
}

/// Largest inertia that a joint can come to carry: mass times distance squared of all beyond it.
std::vector<double> greatest_inertias(const BodyTree& tree) {
  struct Reach {
    double mass = 0, first = 0, second = 0;
  };
  std::vector<Reach> reach(tree.bodies.size());
  std::vector<double> out(tree.bodies.size());
  for (std::size_t i = tree.bodies.size(); i-- > 0;) {
    const TreeBody& b = tree.bodies[i];
    Reach& r = reach[i];
    r.mass += std::fabs(b.inertia.mass);
    r.first += spatial::norm(b.inertia.first);
    r.second += std::fabs(b.inertia.second.xx) + std::fabs(b.inertia.second.yy) +
                std::fabs(b.inertia.second.zz);
    out[i] = (b.type == JointType::prismatic ? r.mass
              : b.type == JointType::free    ? std::min(r.mass, r.second)
                                             : r.second) +
             b.armature;
    if (b.parent < 0) continue;
    Reach& up = reach[static_cast<std::size_t>(b.parent)];
    const double l = spatial::norm(b.placement.p);
    up.mass += r.mass;
    up.first += r.first + r.mass * l;
    up.second += r.second + 2 * l * r.first + r.mass * l * l;
  }
  return out;
}

/// Rate of a joint of one column, in its own coordinate.
double rate_of(const TreeBody& b, const double* qd) { return b.ratio * qd[b.v_index]; }

void outward(const BodyTree& tree, const spatial::TreeState& in, State* bodies) {
  for (std::size_t i = 0; i < tree.bodies.size(); ++i) {
    const TreeBody& b = tree.bodies[i];
    State& s = bodies[i];
    s.to_parent = spatial::joint_pose(b, in.q);
    s.v = spatial::motion_into(s.to_parent, b.parent < 0 ? in.base_velocity : bodies[b.parent].v);
    s.c = {};
    if (in.qd) {
      if (b.type == JointType::revolute) {
        const double x = rate_of(b, in.qd);
        s.v.angular[2] += x;
        s.c = {{x * s.v.angular[1], -x * s.v.angular[0], 0},
               {x * s.v.linear[1], -x * s.v.linear[0], 0}};
      } else if (b.type == JointType::prismatic) {
        const double x = rate_of(b, in.qd);
        s.v.linear[2] += x;
        s.c.linear = {x * s.v.angular[1], -x * s.v.angular[0], 0};
      } else {
        Screw rate;
        for (std::int32_t k = 0; k < b.columns; ++k)
          rate = add(rate, scale(spatial::joint_column(b, k), in.qd[b.v_index + k]));
        s.v = add(s.v, rate);
        s.c = cross_motion(s.v, rate);
      }
    }
    s.inertia = articulated(b.inertia);
    s.p = cross_force(s.v, spatial::multiply(b.inertia, s.v));
  }
}

void subtract_wrench(const BodyTree& tree, const DynamicsBatch& batch, std::size_t sample,
                     State* bodies) {
  const TipModel& tip = tree.tips[static_cast<std::size_t>(batch.tip_index)];
  if (tip.joint < 0) return;
  const TipWrench& w = batch.tip[batch.tip.size() == 1 ? 0 : sample];
  Pose turn;  // base to the tip's joint
  for (std::int32_t i = tip.joint; i >= 0; i = tree.bodies[static_cast<std::size_t>(i)].parent) {
    Pose local;
    local.R = bodies[i].to_parent.R;
    turn = spatial::compose(local, turn);
  }
  const Vec3 force = spatial::rotate_back(turn, w.force);
  const Vec3 moment = add(spatial::rotate_back(turn, w.moment), cross(tip.tool.p, force));
  bodies[tip.joint].p = sub(bodies[tip.joint].p, {moment, force});
}

/// Columns of a joint of several, as places in (angular, linear).
double part(const Screw& s, const TreeBody& b, std::int32_t k) {
  const auto i = static_cast<std::size_t>(k);
  if (b.type == JointType::spherical) return s.angular[i];
  return k < 3 ? s.linear[i] : s.angular[i - 3];
}

bool split_wide(const TreeBody& b, State& s, Wide& w, double pivot) {
  const auto n = static_cast<std::size_t>(b.columns);
  for (std::size_t k = 0; k < n; ++k)
    w.u[k] = multiply(s.inertia, spatial::joint_column(b, static_cast<std::int32_t>(k)));
  for (std::size_t r = 0; r < n; ++r)
    for (std::size_t c = 0; c < n; ++c)
      w.d[r * n + c] = part(w.u[c], b, static_cast<std::int32_t>(r));
  if (spatial::cholesky(std::span(w.d).first(n * n), n) >= 0) return false;
  for (std::size_t k = 0; k < n; ++k)
    if (!(w.d[k * n + k] * w.d[k * n + k] > pivot)) return false;
  return true;
}

/// Sum of the columns' resistances times D^-1 x.
Screw carried(const Wide& w, std::size_t n, std::array<double, 6> x) {
  spatial::cholesky_solve(std::span(w.d).first(n * n), n, x.data());
  Screw f;
  for (std::size_t k = 0; k < n; ++k) f = add(f, scale(w.u[k], x[k]));
  return f;
}

/// Articulated inertias, then forces, from the tips to the base.
std::int32_t inward(const Articulated& a, const double* force, State* bodies, Wide* wide) {
  for (std::size_t i = a.tree.bodies.size(); i-- > 0;) {
    const TreeBody& b = a.tree.bodies[i];
    State& s = bodies[i];
    if (b.columns > 1) {
      Wide& w = wide[a.wide[i]];
      if (!split_wide(b, s, w, a.pivot[i])) return static_cast<std::int32_t>(i);
      const auto n = static_cast<std::size_t>(b.columns);
      for (std::size_t k = 0; k < n; ++k)
        w.force[k] = force[b.column + static_cast<std::int32_t>(k)] -
                     part(s.p, b, static_cast<std::int32_t>(k));
      if (b.parent < 0) continue;
      Screw p = add(s.p, carried(w, n, w.force));
      ArticulatedInertia left = s.inertia;
      if (b.type == JointType::free) {
        left = {{}, {}, {}};  // only the joint's own forces are carried over
      } else {
        // U D^-1 U^T by the columns of L^-1 U^T, whose squares it sums.
        std::array<Screw, 3> y;
        for (std::size_t k = 0; k < n; ++k) {
          y[k] = w.u[k];
          for (std::size_t l = 0; l < k; ++l) y[k] = sub(y[k], scale(y[l], w.d[k * n + l]));
          y[k] = scale(y[k], 1 / w.d[k * n + k]);
          subtract_square(left, y[k], 1);
        }
        p = add(p, multiply(left, s.c));
      }
      State& up = bodies[b.parent];
      add_moved(s.to_parent, left, up.inertia);
      up.p = add(up.p, spatial::force_out(s.to_parent, p));
      continue;
    }
    double d;
    if (b.type == JointType::revolute) {
      s.u = {{s.inertia.A.xz, s.inertia.A.yz, s.inertia.A.zz},
             {s.inertia.B[6], s.inertia.B[7], s.inertia.B[8]}};
      d = s.inertia.A.zz;
      s.force = force[b.column] - s.p.angular[2];
    } else {
      s.u = {{s.inertia.B[2], s.inertia.B[5], s.inertia.B[8]},
             {s.inertia.M.xz, s.inertia.M.yz, s.inertia.M.zz}};
      d = s.inertia.M.zz;
      s.force = force[b.column] - s.p.linear[2];
    }
    d += b.armature;
    if (!(d > a.pivot[i])) return static_cast<std::int32_t>(i);
    s.inverse = 1 / d;
    if (b.parent < 0) continue;
    ArticulatedInertia left = s.inertia;
    subtract_square(left, s.u, s.inverse);
    const Screw p = add(add(s.p, multiply(left, s.c)), scale(s.u, s.force * s.inverse));
    State& up = bodies[b.parent];
    add_moved(s.to_parent, left, up.inertia);
    up.p = add(up.p, spatial::force_out(s.to_parent, p));
  }
  return -1;
}

void accelerate(const Articulated& a, const Screw& base, State* bodies, const Wide* wide,
                double* rate) {
  for (std::size_t i = 0; i < a.tree.bodies.size(); ++i) {
    const TreeBody& b = a.tree.bodies[i];
    State& s = bodies[i];
    s.a = add(spatial::motion_into(s.to_parent, b.parent < 0 ? base : bodies[b.parent].a), s.c);
    if (b.columns == 1) {
      const double x = (s.force - dot(s.u, s.a)) * s.inverse;
      rate[b.column] = x;
      (b.type == JointType::revolute ? s.a.angular[2] : s.a.linear[2]) += x;
      continue;
    }
    const Wide& w = wide[a.wide[i]];
    const auto n = static_cast<std::size_t>(b.columns);
    std::array<double, 6> x{};
    for (std::size_t k = 0; k < n; ++k) x[k] = w.force[k] - dot(w.u[k], s.a);
    spatial::cholesky_solve(std::span(w.d).first(n * n), n, x.data());
    for (std::size_t k = 0; k < n; ++k) {
      const auto column = static_cast<std::int32_t>(k);
      rate[b.column + column] = x[k];
      s.a = add(s.a, scale(spatial::joint_column(b, column), x[k]));
    }
  }
}

/// Accelerations of the columns for forces of the columns alone, at rest and without weight, with
/// the inertias that inward() left. `bodies` keep all but p, force and a.
void respond(const Articulated& a, const double* force, State* bodies, Wide* wide, double* rate) {
  for (std::size_t i = 0; i < a.tree.bodies.size(); ++i) bodies[i].p = {}, bodies[i].c = {};
  for (std::size_t i = a.tree.bodies.size(); i-- > 0;) {
    const TreeBody& b = a.tree.bodies[i];
    State& s = bodies[i];
    Screw p = s.p;
    if (b.columns == 1) {
      s.force = force[b.column] - (b.type == JointType::revolute ? s.p.angular[2] : s.p.linear[2]);
      p = add(p, scale(s.u, s.force * s.inverse));
    } else {
      Wide& w = wide[a.wide[i]];
      const auto n = static_cast<std::size_t>(b.columns);
      for (std::size_t k = 0; k < n; ++k)
        w.force[k] = force[b.column + static_cast<std::int32_t>(k)] -
                     part(s.p, b, static_cast<std::int32_t>(k));
      p = add(p, carried(w, n, w.force));
    }
    if (b.parent < 0) continue;
    State& up = bodies[b.parent];
    up.p = add(up.p, spatial::force_out(s.to_parent, p));
  }
  accelerate(a, {}, bodies, wide, rate);
}

/// Forces between followers and leaders, so that q_f'' = ratio q_l'': one multiplier a coupling.
std::int32_t couple(const Articulated& a, const Work& w) {
  const std::size_t m = a.followers.size(), columns = a.tree.columns;
  const auto follower = [&](std::size_t k) -> const TreeBody& {
    return a.tree.bodies[static_cast<std::size_t>(a.followers[k])];
  };
  const auto leader = [&](std::size_t k) -> const TreeBody& {
    return a.tree.bodies[static_cast<std::size_t>(a.leaders[k])];
  };
  double* response = w.rest;                // m rows of columns
  double* matrix = response + m * columns;  // m * m
  double* lambda = matrix + m * m;
  const auto gap = [&](std::size_t k, const double* rate) {
    return rate[follower(k).column] - follower(k).ratio * rate[leader(k).column];
  };
  for (std::size_t k = 0; k < m; ++k) {
    std::fill(w.force, w.force + columns, 0.0);
    w.force[follower(k).column] += 1;
    w.force[leader(k).column] -= follower(k).ratio;
    respond(a, w.force, w.bodies, w.wide, response + k * columns);
    lambda[k] = -gap(k, w.rate);
  }
  for (std::size_t r = 0; r < m; ++r)
    for (std::size_t c = 0; c < m; ++c) matrix[r * m + c] = gap(r, response + c * columns);
  if (const std::ptrdiff_t bad = spatial::cholesky(std::span(matrix, m * m), m); bad >= 0)
    return a.followers[static_cast<std::size_t>(bad)];
  spatial::cholesky_solve(std::span<const double>(matrix, m * m), m, lambda);
  for (std::size_t k = 0; k < m; ++k)
    for (std::size_t c = 0; c < columns; ++c) w.rate[c] += lambda[k] * response[k * columns + c];
  return -1;
}

}  // namespace

Result<Articulated> make_articulated(const RobotModel& model) {
  Articulated a;
  RMP_TRY_ASSIGN(a.tree, spatial::make_body_tree(model));
  a.pivot = greatest_inertias(a.tree);
  for (double& x : a.pivot) x *= kPivot;
  for (std::size_t i = 0; i < a.tree.bodies.size(); ++i) {
    const bool wide = a.tree.bodies[i].columns > 1;
    a.wide.push_back(wide ? static_cast<std::int32_t>(a.wide_count++) : -1);
    if (!a.tree.bodies[i].coupled) continue;
    a.followers.push_back(static_cast<std::int32_t>(i));
    a.leaders.push_back(model.joints[i].coupling.of);
  }
  // A follower moves in its own coordinate here; the ratio is the multiplier's.
  return a;
}

std::size_t articulated_scratch(const Articulated& a) {
  const std::size_t m = a.followers.size();
  return (a.tree.bodies.size() * sizeof(State) + a.wide_count * sizeof(Wide)) / sizeof(double) +
         2 * a.tree.columns + m * a.tree.columns + m * m + m;
}

std::int32_t accelerations(const Articulated& a, const DynamicsBatch& batch, std::size_t sample,
                           double* scratch, double* qdd) {
  const BodyTree& tree = a.tree;
  const Work w = work(a, scratch);
  const spatial::TreeState in = spatial::state_of(tree, batch, sample, batch.terms, true);
  outward(tree, in, w.bodies);
  if ((batch.terms & kExternalTerm) && !batch.tip.empty())
    subtract_wrench(tree, batch, sample, w.bodies);
  const double* tau = batch.tau.empty() ? nullptr : batch.tau.data() + sample * tree.velocities;
  const double* qd = batch.qd.empty() || !(batch.terms & kFrictionTerm)
                         ? nullptr
                         : batch.qd.data() + sample * tree.velocities;
  for (const TreeBody& b : tree.bodies)
    for (std::int32_t k = 0; k < b.columns; ++k) {
      double f = tau && !b.coupled ? tau[b.v_index + k] : 0.0;
      if (qd) {
        const double rate = b.ratio * qd[b.v_index + k];
        f -= b.friction.viscous * rate;
        if (rate > spatial::kRestSpeed) f -= b.friction.coulomb_positive;
        if (rate < -spatial::kRestSpeed) f -= b.friction.coulomb_negative;
      }
      if ((batch.terms & kSpringTerm) && b.spring.stiffness != 0)
        f -= b.spring.stiffness * (b.ratio * in.q[b.q_index] + b.offset - b.spring.rest);
      w.force[b.column + k] = f;
    }
  if (const std::int32_t bad = inward(a, w.force, w.bodies, w.wide); bad >= 0) return bad;
  accelerate(a, in.base_acceleration, w.bodies, w.wide, w.rate);
  if (!a.followers.empty())
    if (const std::int32_t bad = couple(a, w); bad >= 0) return bad;
  for (const TreeBody& b : tree.bodies)
    if (!b.coupled)
      for (std::int32_t k = 0; k < b.columns; ++k) qdd[b.v_index + k] = w.rate[b.column + k];
  return -1;
}

}  // namespace robomosp::articulated
