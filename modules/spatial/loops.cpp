// SPDX-License-Identifier: Apache-2.0
#include "spatial/loops.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "spatial/rotation.h"

namespace robomosp::spatial {
namespace {

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

}  // namespace

LoopGap::LoopGap(const Pose& a, const Pose& b) : a_(a), b_(b.p) {
  way = rotate_back(a, sub(b.p, a.p));
  turn = rotation_log(compose(inverse(a), b).R);
  const double t2 = dot(turn, turn);
  if (t2 < 1e-4) {
    c_ = 1.0 / 12 + t2 / 720 + t2 * t2 / 30240;
    slope_ = 1.0 / 360 + t2 / 7560;
  } else {  // c = 1/t^2 - cot(t/2) / (2 t)
    const double t = std::sqrt(t2);
    const double s = std::sin(t / 2), cot = std::cos(t / 2) / s;
    c_ = 1 / t2 - cot / (2 * t);
    slope_ = (-2 / (t2 * t) + cot / (2 * t2) + 1 / (4 * t * s * s)) / t;
  }
}

Vec3 LoopGap::turn_rate(const Vec3& u) const {
  const Vec3 x = cross(turn, u);
  return add(sub(u, scale(x, 0.5)), scale(cross(turn, x), c_));
}

Vec3 LoopGap::turn_rate_change(const Vec3& rate, const Vec3& u) const {
  const Vec3 x = cross(turn, u), xd = cross(rate, u);
  return add(scale(xd, -0.5), add(scale(add(cross(rate, x), cross(turn, xd)), c_),
                                  scale(cross(turn, x), slope_ * dot(turn, rate))));
}

std::array<double, 6> LoopGap::rates(const Screw& motion, bool by_vector) const {
  // Either end's motion as seen from a at the place of b.
  const Vec3 moved = rotate_back(a_, add(motion.linear, cross(motion.angular, b_)));
  const Vec3 u = rotate_back(a_, motion.angular);
  const Vec3 turned = by_vector ? turn_rate(u) : u;
  return {moved[0], moved[1], moved[2], turned[0], turned[1], turned[2]};
}

std::size_t loop_rows(std::span<const LoopModel> loops) {
  std::size_t n = 0;
  for (const LoopModel& l : loops)
    n += static_cast<std::size_t>(std::popcount(l.fixed & static_cast<std::uint32_t>(kLoopWeld)));
  return n;
}

std::size_t loop_of_row(std::span<const LoopModel> loops, std::size_t row) {
  std::size_t end = 0;
  for (std::size_t l = 0; l < loops.size(); ++l)
    if (end += loop_rows(loops.subspan(l, 1)); row < end) return l;
  return 0;
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
    const LoopGap gap(a.pose, b.pose);
    const Vec3 &way = gap.way, &turn = gap.turn;
    // Everything of b relative to a, in the axes of a: the way r, its rate r' = v - w_a x r, and
    // the turning u = w_b - w_a.
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
    const Vec3 vector_rate = gap.turn_rate(u);
    const Vec3 turning = by_vector ? vector_rate : u;
    const Vec3 turning_rate =
        by_vector ? add(gap.turn_rate(ud), gap.turn_rate_change(vector_rate, u)) : ud;
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
          const std::array<double, 6> rates = gap.rates(s, by_vector);
          const auto column = static_cast<std::size_t>(body.v_index + k);
          for (std::size_t d = 0; d < 6; ++d)
            if (l.fixed & (1U << d)) out.jacobian[rows[d] * n + column] += sign * rates[d];
        }
      }
    };
    add_columns(l.joint_b, 1);
    add_columns(l.joint_a, -1);
  }
}

}  // namespace robomosp::spatial
