// SPDX-License-Identifier: Apache-2.0
// Six-dimensional vectors of rigid-body dynamics, inline: twists and wrenches in one frame about
// its origin, the inertia of a body and its symmetric generalisation (layer: data processing,
// spatial). Notation of Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 2.
#pragma once

#include "spatial/pose.h"

namespace robomosp::spatial {

/// A motion: angular velocity and velocity of the point at the origin (or accelerations); or a
/// force: moment about the origin and force.
struct Screw {
  Vec3 angular{}, linear{};  ///< of a force: moment, force
};

[[nodiscard]] constexpr Screw add(const Screw& a, const Screw& b) {
  return {add(a.angular, b.angular), add(a.linear, b.linear)};
}
[[nodiscard]] constexpr Screw sub(const Screw& a, const Screw& b) {
  return {sub(a.angular, b.angular), sub(a.linear, b.linear)};
}
[[nodiscard]] constexpr Screw scale(const Screw& a, double s) {
  return {scale(a.angular, s), scale(a.linear, s)};
}
/// Power of a force along a motion.
[[nodiscard]] constexpr double dot(const Screw& a, const Screw& b) {
  return dot(a.angular, b.angular) + dot(a.linear, b.linear);
}
/// v x m: how a motion fixed in a body changes that moves with v.
[[nodiscard]] constexpr Screw cross_motion(const Screw& v, const Screw& m) {
  return {cross(v.angular, m.angular), add(cross(v.angular, m.linear), cross(v.linear, m.angular))};
}
/// v x* f: how a force fixed in a body changes that moves with v.
[[nodiscard]] constexpr Screw cross_force(const Screw& v, const Screw& f) {
  return {add(cross(v.angular, f.angular), cross(v.linear, f.linear)), cross(v.angular, f.linear)};
}
/// A motion of frame a in frame b, from a_T_b.
[[nodiscard]] constexpr Screw motion_into(const Pose& t, const Screw& m) {
  return {rotate_back(t, m.angular), rotate_back(t, add(m.linear, cross(m.angular, t.p)))};
}
/// A motion of frame b in frame a, from a_T_b.
[[nodiscard]] constexpr Screw motion_out(const Pose& t, const Screw& m) {
  const Vec3 w = rotate(t, m.angular);
  return {w, add(rotate(t, m.linear), cross(t.p, w))};
}
/// A force of frame b in frame a, from a_T_b.
[[nodiscard]] constexpr Screw force_out(const Pose& t, const Screw& f) {
  const Vec3 force = rotate(t, f.linear);
  return {add(rotate(t, f.angular), cross(t.p, force)), force};
}
/// A force of frame a in frame b, from a_T_b.
[[nodiscard]] constexpr Screw force_into(const Pose& t, const Screw& f) {
  return {rotate_back(t, sub(f.angular, cross(t.p, f.linear))), rotate_back(t, f.linear)};
}

/// Inertia of a rigid body about the origin of a frame.
struct RigidInertia {
  double mass = 0;
  Vec3 first{};  ///< mass times centre of mass [kg m]
  Sym3 second;   ///< inertia about the frame's origin [kg m^2]
};
[[nodiscard]] constexpr RigidInertia add(const RigidInertia& a, const RigidInertia& b) {
  return {a.mass + b.mass, add(a.first, b.first), add(a.second, b.second)};
}
/// Momentum of a body that moves with v; also the force for an acceleration.
[[nodiscard]] constexpr Screw multiply(const RigidInertia& i, const Screw& v) {
  return {add(multiply(i.second, v.angular), cross(i.first, v.linear)),
          sub(scale(v.linear, i.mass), cross(i.first, v.angular))};
}
/// The inertia of frame b in frame a, from a_T_b.
[[nodiscard]] constexpr RigidInertia inertia_out(const Pose& t, const RigidInertia& b) {
  const auto& R = t.R;
  const Vec3 r0{R[0], R[1], R[2]}, r1{R[3], R[4], R[5]}, r2{R[6], R[7], R[8]};
  const Vec3 i0 = multiply(b.second, r0), i1 = multiply(b.second, r1), i2 = multiply(b.second, r2);
  const Vec3 h = rotate(t, b.first), p = t.p;
  // For x' = R x + p: 2 (p.g) 1 - p g^T - g p^T with g = h + m p / 2.
  const Vec3 g = add(h, scale(p, 0.5 * b.mass));
  const double trace = 2 * dot(p, g);
  return {b.mass,
          add(h, scale(p, b.mass)),
          {dot(r0, i0) + trace - 2 * p[0] * g[0], dot(r1, i1) + trace - 2 * p[1] * g[1],
           dot(r2, i2) + trace - 2 * p[2] * g[2], dot(r0, i1) - p[0] * g[1] - p[1] * g[0],
           dot(r1, i2) - p[1] * g[2] - p[2] * g[1], dot(r0, i2) - p[0] * g[2] - p[2] * g[0]}};
}

}  // namespace robomosp::spatial
