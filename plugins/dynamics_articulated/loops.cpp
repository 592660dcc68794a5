// SPDX-License-Identifier: Apache-2.0
#include "loops.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "spatial/rotation.h"

namespace robomosp::articulated {
namespace {

using namespace spatial;

/// A frame that a body (or the base) carries, in motion, base frame.
struct Carried {
  Pose pose;
  Screw velocity, acceleration;
  /// Velocity and classical acceleration of its origin.
  [[nodiscard]] Vec3 origin_velocity() const {
    return add(velocity.linear, cross(velocity.angular, pose.p));
  }
  [[nodiscard]] Vec3 origin_acceleration() const {
    return add(add(acceleration.linear, cross(acceleration.angular, pose.p)),
               cross(velocity.angular, origin_velocity()));
  }
};

Carried loop_frame(std::int32_t joint, const Pose& in, std::span<const MovingBody> bodies,
                   const TreeState& state) {
  if (joint < 0) return {in, state.base_velocity, state.base_acceleration};
  const MovingBody& m = bodies[static_cast<std::size_t>(joint)];
  return {compose(m.pose, in), m.velocity, m.acceleration};
}

/// Derivative of the rotation vector v by a turn w of the turned frame, seen from the fixed one:
/// the inverse of the left Jacobian of SO(3) times w, and its rate with v.
struct RotationRates {
  // inverse = 1 - [v]/2 + c [v]^2 with c = 1/t^2 - cot(t/2) / (2 t), t = |v|; slope = c'(t) / t
  double c, slope;
  explicit RotationRates(const Vec3& v) {
    const double t2 = dot(v, v);
    if (t2 < 1e-4) {
      c = 1.0 / 12 + t2 / 720 + t2 * t2 / 30240;
      slope = 1.0 / 360 + t2 / 7560;
    } else {
      const double t = std::sqrt(t2);
      const double s = std::sin(t / 2), cot = std::cos(t / 2) / s;
      c = 1 / t2 - cot / (2 * t);
      slope = (-2 / (t2 * t) + cot / (2 * t2) + 1 / (4 * t * s * s)) / t;
    }
  }
  [[nodiscard]] Vec3 apply(const Vec3& v, const Vec3& w) const {
    const Vec3 x = cross(v, w);
    return add(sub(w, scale(x, 0.5)), scale(cross(v, x), c));
  }
  /// d/dt of apply(v, w) with w held, for v' = vd.
  [[nodiscard]] Vec3 rate(const Vec3& v, const Vec3& vd, const Vec3& w) const {
    const Vec3 x = cross(v, w), xd = cross(vd, w);
    return add(scale(xd, -0.5), add(scale(add(cross(vd, x), cross(v, xd)), c),
                                    scale(cross(v, x), slope * dot(v, vd))));
  }
};

}  // namespace

std::size_t loop_rows(const BodyTree& tree) {
  std::size_t n = 0;
  for (const LoopModel& l : tree.loops)
    for (std::uint32_t d = 0; d < 6; ++d) n += (l.fixed >> d) & 1U;
  return n;
}

void loop_constraints(const BodyTree& tree, std::span<const MovingBody> bodies,
                      std::span<const Screw> columns, const TreeState& state, const LoopRows& out) {
  const std::size_t n = tree.velocities;
  std::fill(out.jacobian.begin(), out.jacobian.end(), 0.0);
  std::size_t row = 0;
  for (const LoopModel& l : tree.loops) {
    const Carried a = loop_frame(l.joint_a, l.in_a, bodies, state),
                  b = loop_frame(l.joint_b, l.in_b, bodies, state);
    const auto into_a = [&](const Vec3& v) { return rotate_back(a.pose, v); };
    Pose relative;
    relative.R = compose(inverse(a.pose), b.pose).R;
    const Vec3 turn = rotation_log(relative.R);
    const RotationRates rotation(turn);
    // Everything of b relative to a, in the axes of a: the way r, its rate r' = v - w_a x r, and
    // the turning u = w_b - w_a.
    const Vec3 way = into_a(sub(b.pose.p, a.pose.p));
    const Vec3 wa = into_a(a.velocity.angular);
    const Vec3 v = sub(into_a(sub(b.origin_velocity(), a.origin_velocity())), cross(wa, way));
    const Vec3 u = into_a(sub(b.velocity.angular, a.velocity.angular));
    const Vec3 push = into_a(sub(b.origin_acceleration(), a.origin_acceleration()));
    const Vec3 wad = into_a(a.acceleration.angular);
    const Vec3 acceleration =
        sub(push, add(cross(wad, way), add(scale(cross(wa, v), 2), cross(wa, cross(wa, way)))));
    const Vec3 ud = sub(into_a(sub(b.acceleration.angular, a.acceleration.angular)), cross(wa, u));
    // One fixed turn is that of the rotation vector; two or three are met by u = 0, whose forces
    // are the moments themselves.
    const bool by_vector = std::popcount(l.fixed & 56U) == 1;
    const Vec3 vector_rate = rotation.apply(turn, u);
    const Vec3 turning = by_vector ? vector_rate : u;
    const Vec3 turning_rate =
        by_vector ? add(rotation.apply(turn, ud), rotation.rate(turn, vector_rate, u)) : ud;
    std::size_t rows[6] = {};
    for (std::size_t d = 0; d < 6; ++d) {
      if (!(l.fixed & (1U << d))) continue;
      rows[d] = row++;
      out.gap[rows[d]] = d < 3 ? way[d] : turn[d - 3];
      out.rate[rows[d]] = d < 3 ? v[d] : turning[d - 3];
      out.bias[rows[d]] = d < 3 ? acceleration[d] : turning_rate[d - 3];
    }
    const auto add_columns = [&](std::int32_t joint, double sign) {
      for (; joint >= 0; joint = tree.bodies[static_cast<std::size_t>(joint)].parent) {
        const TreeBody& body = tree.bodies[static_cast<std::size_t>(joint)];
        for (std::int32_t k = 0; k < body.columns; ++k) {
          const Screw& s = columns[static_cast<std::size_t>(body.column + k)];
          // Both ends' motion as seen from a at the place of b.
          const Vec3 moved = scale(into_a(add(s.linear, cross(s.angular, b.pose.p))), sign);
          Vec3 turned = scale(into_a(s.angular), sign);
          if (by_vector) turned = rotation.apply(turn, turned);
          const auto column = static_cast<std::size_t>(body.v_index + k);
          for (std::size_t d = 0; d < 6; ++d)
            if (l.fixed & (1U << d))
              out.jacobian[rows[d] * n + column] += d < 3 ? moved[d] : turned[d - 3];
        }
      }
    };
    add_columns(l.joint_b, 1);
    add_columns(l.joint_a, -1);
  }
}

std::size_t solve_semidefinite(std::span<double> a, std::size_t n, double tolerance, double* b,
                               double* scratch) {
  double* factor = scratch;            // n rows of n, of which `rank` columns are used
  double* normal = scratch + n * n;    // rank * rank
  double* left = scratch + 2 * n * n;  // what is left of the diagonal
  double *x = left + n, *unit = x + n, *rest = unit + n, *sum = rest + n;
  double greatest = 0;
  for (std::size_t i = 0; i < n; ++i) greatest = std::max(greatest, a[i * n + i]);
  for (std::size_t i = 0; i < n; ++i)  // rows of all units weigh the same
    unit[i] = a[i * n + i] > 1e-24 * greatest ? 1 / std::sqrt(a[i * n + i]) : 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) a[i * n + k] *= unit[i] * unit[k];
    left[i] = a[i * n + i];
    b[i] *= unit[i];
  }
  std::fill(factor, factor + n * n, 0.0);
  std::size_t rank = 0;
  for (; rank < n; ++rank) {
    const auto at = static_cast<std::size_t>(std::max_element(left, left + n) - left);
    if (!(left[at] > tolerance)) break;
    const double pivot = std::sqrt(left[at]);
    for (std::size_t i = 0; i < n; ++i) {
      if (left[i] < 0) continue;  // used as a pivot before
      double s = a[i * n + at];
      for (std::size_t k = 0; k < rank; ++k) s -= factor[i * n + k] * factor[at * n + k];
      factor[i * n + rank] = s / pivot;
      left[i] = std::max(0.0, left[i] - factor[i * n + rank] * factor[i * n + rank]);
    }
    left[at] = -1;
  }
  for (std::size_t r = 0; r < rank; ++r)
    for (std::size_t c = 0; c < rank; ++c) {
      double s = 0;
      for (std::size_t i = 0; i < n; ++i) s += factor[i * n + r] * factor[i * n + c];
      normal[r * rank + c] = s;
    }
  (void)cholesky(std::span(normal, rank * rank), rank);  // L has full column rank
  std::copy_n(b, n, rest);
  std::fill(sum, sum + n, 0.0);
  for (int refined = 0; refined < 3; ++refined) {
    for (std::size_t r = 0; r < rank; ++r) {
      x[r] = 0;
      for (std::size_t i = 0; i < n; ++i) x[r] += factor[i * n + r] * rest[i];
    }
    for (int twice = 0; twice < 2; ++twice)
      cholesky_solve(std::span<const double>(normal, rank * rank), rank, x);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t k = 0; k < rank; ++k) sum[i] += factor[i * n + k] * x[k];
    for (std::size_t i = 0; i < n; ++i) {
      rest[i] = b[i];
      for (std::size_t k = 0; k < n; ++k) rest[i] -= a[i * n + k] * sum[k];
    }
  }
  for (std::size_t i = 0; i < n; ++i) b[i] = unit[i] * sum[i];
  return rank;
}

}  // namespace robomosp::articulated
