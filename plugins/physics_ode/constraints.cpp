// SPDX-License-Identifier: Apache-2.0
// Constraints that ODE has no joint for, joints that follow others and closed loops that leave some
// directions free (layer: plugin). ODE's rows join two bodies, these up to four. Their forces are
// found by steps on trial: v+ is a piecewise linear, monotone function of them (contacts, stops and
// friction bend it), so that a few steps of Broyden's method, Math. Comp. 19 (1965) 577, with the
// response of the step before meet all rows.
#include <algorithm>
#include <cmath>

#include "spatial/pose.h"
#include "spatial/rotation.h"
#include "world.h"

namespace robomosp::physics_ode {
namespace {

constexpr int kMostTrials = 30;
constexpr double kProbe = 1e-2;  ///< force by which the response is measured [N or N m]

double largest(const std::vector<double>& x) {
  double most = 0;
  for (const double v : x) most = std::max(most, std::fabs(v));
  return most;
}

/// x of A x = b by elimination with pivots; false where A is singular.
bool solve(std::vector<double> A, std::vector<double>& b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t best = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (std::fabs(A[i * n + k]) > std::fabs(A[best * n + k])) best = i;
    if (!(std::fabs(A[best * n + k]) > 0)) return false;
    if (best != k) {
      std::swap_ranges(A.begin() + static_cast<std::ptrdiff_t>(k * n),
                       A.begin() + static_cast<std::ptrdiff_t>((k + 1) * n),
                       A.begin() + static_cast<std::ptrdiff_t>(best * n));
      std::swap(b[k], b[best]);
    }
    for (std::size_t i = k + 1; i < n; ++i) {
      const double f = A[i * n + k] / A[k * n + k];
      for (std::size_t c = k; c < n; ++c) A[i * n + c] -= f * A[k * n + c];
      b[i] -= f * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t c = k + 1; c < n; ++c) b[k] -= A[k * n + c] * b[c];
    b[k] /= A[k * n + k];
  }
  return true;
}

}  // namespace

/// Adds `factor` times the joint's rate.
void OdeWorld::add_rate(const Joint& j, double factor, Row& row) const {
  const Vec3 z = spatial::scale(axis(j), factor);
  const Vec3 back = spatial::scale(z, -1);
  const dBodyID a = body_id(j.a), b = body_id(j.b);
  if (j.type == kRevolute) {
    if (b) row.entries.push_back({b, {}, z});
    if (a) row.entries.push_back({a, {}, back});
    return;
  }
  // z . (v_b - v_a - w_a x (c_b - c_a))
  if (b) row.entries.push_back({b, z, {}});
  if (!a) return;
  const Vec3 arm = b ? spatial::sub(vec3(dBodyGetPosition(b)), vec3(dBodyGetPosition(a))) : Vec3{};
  row.entries.push_back({a, back, spatial::cross(arm, back)});
}

/// The rows as the bodies stand.
void OdeWorld::make_rows() {
  rows_.clear();
  const double repair = settings_.erp / dt_;
  for (const Joint& j : joints_) {
    if (j.follows >= 0) {
      const Joint& of = joints_[static_cast<std::size_t>(j.follows)];
      Row& row = rows_.emplace_back();
      add_rate(j, 1, row);
      add_rate(of, -j.ratio, row);
      row.target = -repair * (position(j) - j.ratio * position(of) - j.offset);
    }
    if (j.type != kDirections) continue;
    const Pose a = spatial::compose(pose(j.a), j.in_a), b = spatial::compose(pose(j.b), j.in_b);
    const Pose gap = spatial::compose(spatial::inverse(a), b);
    const Vec3 turn = spatial::rotation_log(gap.R);
    for (std::size_t k = 0; k < 6; ++k) {
      if (!(j.fixed >> k & 1U)) continue;
      Row& row = rows_.emplace_back();
      const Vec3 n = spatial::axis(a, k % 3);
      row.target = -repair * (k < 3 ? gap.p[k] : turn[k - 3]);
      // Along n the speed of b's origin against what of a is there.
      const auto add = [&](std::int32_t body, double sign) {
        const dBodyID id = body_id(body);
        if (!id) return;
        const Vec3 s = spatial::scale(n, sign);
        if (k >= 3) {
          row.entries.push_back({id, {}, s});
        } else {
          const Vec3 arm = spatial::sub(b.p, vec3(dBodyGetPosition(id)));
          row.entries.push_back({id, s, spatial::cross(arm, s)});
        }
      };
      add(j.b, 1);
      add(j.a, -1);
    }
  }
}

std::vector<OdeWorld::Moving> OdeWorld::moving() const {
  std::vector<Moving> all;
  for (const Body& b : bodies_) {
    if (!b.id) continue;
    const dReal* q = dBodyGetQuaternion(b.id);
    all.push_back({b.id,
                   vec3(dBodyGetPosition(b.id)),
                   vec3(dBodyGetLinearVel(b.id)),
                   vec3(dBodyGetAngularVel(b.id)),
                   {q[0], q[1], q[2], q[3]}});
  }
  return all;
}

void OdeWorld::put_back(std::span<const Moving> before) {
  for (const Moving& s : before) {
    dBodySetPosition(s.id, s.p[0], s.p[1], s.p[2]);
    dBodySetQuaternion(s.id, s.q.data());
    dBodySetLinearVel(s.id, s.v[0], s.v[1], s.v[2]);
    dBodySetAngularVel(s.id, s.w[0], s.w[1], s.w[2]);
  }
}

/// Forces at the joints, on bodies and of rows.
void OdeWorld::add_forces(std::span<const double> forces, std::span<const double> row_forces) {
  for (std::size_t i = 0; i < joints_.size() && !forces.empty(); ++i) {
    const Joint& j = joints_[i];
    if (j.type == kRevolute) dJointAddHingeTorque(j.id, forces[i]);
    if (j.type == kPrismatic) dJointAddSliderForce(j.id, forces[i]);
  }
  for (const Push& p : pushes_) {
    const dBodyID id = body_id(p.body);
    if (!id) continue;
    const Vec3 at = pose(p.body).p;
    dBodyAddForceAtPos(id, p.force[0], p.force[1], p.force[2], at[0], at[1], at[2]);
    dBodyAddTorque(id, p.torque[0], p.torque[1], p.torque[2]);
  }
  for (const Body& b : bodies_)
    if (b.turn.is_on) dBodyAddTorque(b.id, b.turn.torque[0], b.turn.torque[1], b.turn.torque[2]);
  for (const PileForce& f : pile_forces_) {
    dBodyAddForce(f.id, f.force[0], f.force[1], f.force[2]);
    dBodyAddTorque(f.id, f.torque[0], f.torque[1], f.torque[2]);
  }
  for (std::size_t r = 0; r < row_forces.size(); ++r)
    for (const Row::Entry& e : rows_[r].entries) {
      const Vec3 f = spatial::scale(e.linear, row_forces[r]),
                 m = spatial::scale(e.angular, row_forces[r]);
      dBodyAddForce(e.id, f[0], f[1], f[2]);
      dBodyAddTorque(e.id, m[0], m[1], m[2]);
    }
}

/// One step of ODE. Where its exact solver gives up, the step is made again by sweeps.
bool OdeWorld::advance(std::span<const double> forces, std::span<const double> row_forces) {
  constexpr int kCarefulSweeps = 200;
  constexpr int kStepsUntilTried = 20;  ///< what made it give up mostly lasts
  dRandSetSeed(1);
  if (!settings_.exact) {
    add_forces(forces, row_forces);
    return dWorldQuickStep(world_, dt_) != 0;
  }
  if (is_swept_) {
    // Too many contacts at once.
  } else if (steps_until_exact_ > 0) {
    --steps_until_exact_;
  } else {
    const std::vector<Moving> before = moving();
    add_forces(forces, row_forces);
    if (!step_exactly(world_, dt_)) return false;
    if (!gave_up()) return true;
    put_back(before);
    steps_until_exact_ = kStepsUntilTried;
  }
  add_forces(forces, row_forces);
  dWorldSetQuickStepNumIterations(world_, std::max(settings_.sweeps, kCarefulSweeps));
  const bool done = dWorldQuickStep(world_, dt_) != 0;
  dWorldSetQuickStepNumIterations(world_, settings_.sweeps);
  return done;
}

bool OdeWorld::advance_with_rows(std::span<const double> forces) {
  make_rows();
  const std::size_t n = rows_.size();
  const std::vector<Moving> before = moving();
  bool has_memory = true, is_first = true;
  // What is left of the rows after a step with these forces.
  const auto trial = [&](const std::vector<double>& f) {
    if (!is_first) put_back(before);
    is_first = false;
    has_memory = advance(forces, f) && has_memory;
    std::vector<double> left(n);
    for (std::size_t r = 0; r < n; ++r) {
      left[r] = settings_.cfm * f[r] - rows_[r].target;
      for (const Row::Entry& e : rows_[r].entries)
        left[r] += spatial::dot(e.linear, vec3(dBodyGetLinearVel(e.id))) +
                   spatial::dot(e.angular, vec3(dBodyGetAngularVel(e.id)));
    }
    return left;
  };
  const double tolerance = settings_.exact ? 1e-9 : 1e-6;  // [m/s or rad/s]
  std::vector<double>&f = row_forces_, &B = row_response_;
  f.resize(n, 0.0);
  std::vector<double> left = trial(f), best = f, best_left = left, last = f;
  const auto probe = [&] {
    B.assign(n * n, 0.0);
    for (std::size_t k = 0; k < n; ++k) {
      std::vector<double> g = best;
      g[k] += kProbe;
      const std::vector<double> moved = trial(last = g);
      for (std::size_t r = 0; r < n; ++r) B[r * n + k] = (moved[r] - best_left[r]) / kProbe;
    }
    f = best, left = best_left;
  };
  bool is_measured = B.size() != n * n;
  if (is_measured) probe();
  int worse = 0;
  for (int i = 0; i < kMostTrials && largest(best_left) > tolerance && has_memory; ++i) {
    if (worse >= 4 && !is_measured) {
      probe();
      is_measured = true, worse = 0;
    }
    std::vector<double> d = left;
    if (!solve(B, d)) break;
    // After a trial that made it worse, half way.
    const double share = worse > 0 && is_measured ? -0.5 : -1;
    double length2 = 0;
    for (std::size_t k = 0; k < n; ++k) d[k] *= share, f[k] += d[k], length2 += d[k] * d[k];
    if (!(length2 > 0) || !std::isfinite(length2)) break;
    const std::vector<double> now = trial(last = f);
    for (std::size_t r = 0; r < n; ++r) {
      double miss = now[r] - left[r];
      for (std::size_t k = 0; k < n; ++k) miss -= B[r * n + k] * d[k];
      for (std::size_t k = 0; k < n; ++k) B[r * n + k] += miss * d[k] / length2;
    }
    left = now;
    if (largest(left) < largest(best_left)) {
      best = f, best_left = left, worse = 0;
    } else {
      ++worse;
    }
  }
  f = best;
  if (last != best) trial(best);
  if (!(largest(best_left) <= tolerance)) B.clear();  // measured anew in the next step
  return has_memory;
}

}  // namespace robomosp::physics_ode
