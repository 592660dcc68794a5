// SPDX-License-Identifier: Apache-2.0
#include "turning.h"

#include <algorithm>
#include <cmath>

#include "spatial/vec.h"
#include "world.h"

namespace robomosp::physics_ode {
namespace {

using Quaternion = std::array<double, 4>;

/// Slower than this in a step [rad] there is nothing to be seen of it.
constexpr double kLeastTurn = 1e-7;
constexpr double kTurnOfPart = 0.02;  ///< of Runge and Kutta's method [rad]
constexpr int kMostParts = 200;
/// Less than this share of the momentum across the axis is rounding.
constexpr double kLeastAcross = 1e-14;

Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}
Quaternion conjugate(const Quaternion& q) { return {q[0], -q[1], -q[2], -q[3]}; }
Quaternion normalized(const Quaternion& q) {
  const double n = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return {q[0] / n, q[1] / n, q[2] / n, q[3] / n};
}
Vec3 rotated(const Quaternion& q, const Vec3& v) {
  const Vec3 u{q[1], q[2], q[3]};
  const Vec3 t = spatial::scale(spatial::cross(u, v), 2);
  return spatial::add(spatial::add(v, spatial::scale(t, q[0])), spatial::cross(u, t));
}
Quaternion turn_by(const Vec3& v) {
  const double angle = spatial::norm(v);
  const double s = angle > 0 ? std::sin(angle / 2) / angle : 0.5;
  return {std::cos(angle / 2), s * v[0], s * v[1], s * v[2]};
}

/// A x, of ODE's matrices of three rows of four.
Vec3 times(const dReal* A, const Vec3& x) {
  return {A[0] * x[0] + A[1] * x[1] + A[2] * x[2], A[4] * x[0] + A[5] * x[1] + A[6] * x[2],
          A[8] * x[0] + A[9] * x[1] + A[10] * x[2]};
}

}  // namespace

std::array<double, 9> inertia_in_world(dBodyID body) {
  dMass m;
  dBodyGetMass(body, &m);
  const dReal* R = dBodyGetRotation(body);
  std::array<double, 9> half{}, out{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t l = 0; l < 3; ++l)
      for (std::size_t k = 0; k < 3; ++k) half[3 * i + l] += R[4 * i + k] * m.I[4 * k + l];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t l = 0; l < 3; ++l) out[3 * i + j] += half[3 * i + l] * R[4 * j + l];
  return out;
}

FreeTurn free_turn(dBodyID body, double h) {
  FreeTurn out;
  const Vec3 w = vec3(dBodyGetAngularVel(body));
  const double turn = h * spatial::norm(w);
  if (!(turn > kLeastTurn)) return out;
  dMass m;
  dBodyGetMass(body, &m);
  const dReal* at = dBodyGetQuaternion(body);
  const Quaternion start{at[0], at[1], at[2], at[3]};
  const Vec3 w_body = rotated(conjugate(start), w);
  const Vec3 L_body = times(m.I, w_body);
  const Vec3 across = spatial::cross(w_body, L_body);
  if (!(spatial::norm(across) > kLeastAcross * spatial::norm(w) * spatial::norm(L_body)))
    return out;
  dMatrix3 inverse;
  if (!(dInvertMatrix3(inverse, m.I) > 0)) return out;
  const Vec3 L = rotated(start, L_body);            // stays
  const auto velocity = [&](const Quaternion& q) {  // in the body
    return times(inverse, rotated(conjugate(q), L));
  };
  const auto rate = [&](const Quaternion& q) {
    const Vec3 v = velocity(q);
    Quaternion r = product(q, {0, v[0], v[1], v[2]});
    for (double& x : r) x *= 0.5;
    return r;
  };
  const auto along = [](const Quaternion& q, const Quaternion& d, double by) {
    return Quaternion{q[0] + by * d[0], q[1] + by * d[1], q[2] + by * d[2], q[3] + by * d[3]};
  };
  const int parts =
      static_cast<int>(std::clamp(std::ceil(turn / kTurnOfPart), 1.0, double{kMostParts}));
  const double part = h / parts;
  Quaternion q = start;
  for (int i = 0; i < parts; ++i) {
    const Quaternion k1 = rate(q), k2 = rate(along(q, k1, part / 2)),
                     k3 = rate(along(q, k2, part / 2)), k4 = rate(along(q, k3, part));
    for (std::size_t k = 0; k < 4; ++k) q[k] += part / 6 * (k1[k] + 2 * k2[k] + 2 * k3[k] + k4[k]);
    q = normalized(q);
  }
  out.is_on = true;
  out.w_after = rotated(q, velocity(q));
  const Vec3 change = rotated(conjugate(start), spatial::sub(out.w_after, w));
  out.torque = rotated(start, spatial::scale(times(m.I, change), 1 / h));
  out.rest = product(conjugate(product(turn_by(spatial::scale(out.w_after, h)), start)), q);
  return out;
}

bool OdeWorld::turns_freely(const Body& b) const {
  return b.id && b.is_movable && !b.is_jointed && b.attached == 0;
}

/// Of this step. What is held turns as the engine takes it: implicitly, so that no energy is added.
void OdeWorld::begin_turns() {
  for (Body& b : bodies_) {
    b.turn = {};
    if (!b.is_movable) continue;
    const bool is_free = turns_freely(b);
    dBodySetGyroscopicMode(b.id, is_free ? 0 : 1);
    dBodySetFiniteRotationMode(b.id, is_free ? 1 : 0);
    if (is_free) b.turn = free_turn(b.id, dt_);
  }
}

void OdeWorld::end_turns() {
  for (const Body& b : bodies_) {
    if (!b.turn.is_on) continue;
    const dReal* at = dBodyGetQuaternion(b.id);
    const Quaternion q = normalized(product({at[0], at[1], at[2], at[3]}, b.turn.rest));
    dBodySetQuaternion(b.id, q.data());
  }
}

}  // namespace robomosp::physics_ode
