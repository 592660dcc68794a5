// SPDX-License-Identifier: Apache-2.0
// The inertia of an articulated body: a symmetric 6 x 6 matrix in blocks, moved between frames,
// and what is left of it across a joint; inline (layer: plugin).
#pragma once

#include "spatial/screw.h"

namespace robomosp::articulated {

using spatial::Screw;
using Block = std::array<double, 9>;

/// moment = A w + B v, force = B^T w + M v.
struct ArticulatedInertia {
  Sym3 A;
  Block B{};
  Sym3 M;
};

inline ArticulatedInertia articulated(const spatial::RigidInertia& i) {
  const Vec3& h = i.first;
  return {i.second,
          {0, -h[2], h[1], h[2], 0, -h[0], -h[1], h[0], 0},
          {i.mass, i.mass, i.mass, 0, 0, 0}};
}
inline Vec3 times(const Block& b, const Vec3& v) {
  return {b[0] * v[0] + b[1] * v[1] + b[2] * v[2], b[3] * v[0] + b[4] * v[1] + b[5] * v[2],
          b[6] * v[0] + b[7] * v[1] + b[8] * v[2]};
}
inline Vec3 transposed_times(const Block& b, const Vec3& v) {
  return {b[0] * v[0] + b[3] * v[1] + b[6] * v[2], b[1] * v[0] + b[4] * v[1] + b[7] * v[2],
          b[2] * v[0] + b[5] * v[1] + b[8] * v[2]};
}
inline Screw multiply(const ArticulatedInertia& i, const Screw& v) {
  return {spatial::add(spatial::multiply(i.A, v.angular), times(i.B, v.linear)),
          spatial::add(transposed_times(i.B, v.angular), spatial::multiply(i.M, v.linear))};
}
inline void subtract_square(Sym3& s, const Vec3& a, const Vec3& b) {
  s.xx -= a[0] * b[0], s.yy -= a[1] * b[1], s.zz -= a[2] * b[2];
  s.xy -= a[0] * b[1], s.yz -= a[1] * b[2], s.xz -= a[0] * b[2];
}
/// Takes u u^T k away.
inline void subtract_square(ArticulatedInertia& i, const Screw& u, double k) {
  const Vec3 a = spatial::scale(u.angular, k), l = spatial::scale(u.linear, k);
  subtract_square(i.A, a, u.angular);
  subtract_square(i.M, l, u.linear);
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) i.B[3 * r + c] -= a[r] * u.linear[c];
}
inline Sym3 turned(const Block& R, const Sym3& s) {
  Block t;
  for (std::size_t r = 0; r < 9; r += 3) {
    t[r] = R[r] * s.xx + R[r + 1] * s.xy + R[r + 2] * s.xz;
    t[r + 1] = R[r] * s.xy + R[r + 1] * s.yy + R[r + 2] * s.yz;
    t[r + 2] = R[r] * s.xz + R[r + 1] * s.yz + R[r + 2] * s.zz;
  }
  const auto at = [&](std::size_t r, std::size_t c) {
    return t[r] * R[c] + t[r + 1] * R[c + 1] + t[r + 2] * R[c + 2];
  };
  return {at(0, 0), at(3, 3), at(6, 6), at(0, 3), at(3, 6), at(0, 6)};
}
inline Block turned(const Block& R, const Block& s) {
  Block t, out;
  for (std::size_t r = 0; r < 9; r += 3)
    for (std::size_t c = 0; c < 3; ++c)
      t[r + c] = R[r] * s[c] + R[r + 1] * s[3 + c] + R[r + 2] * s[6 + c];
  for (std::size_t r = 0; r < 9; r += 3)
    for (std::size_t c = 0; c < 3; ++c)
      out[r + c] = t[r] * R[3 * c] + t[r + 1] * R[3 * c + 1] + t[r + 2] * R[3 * c + 2];
  return out;
}
/// Adds the inertia of frame b, in frame a by a_T_b, to `up`.
inline void add_moved(const Pose& t, const ArticulatedInertia& i, ArticulatedInertia& up) {
  const Sym3 A = turned(t.R, i.A), M = turned(t.R, i.M);
  Block B = turned(t.R, i.B);
  const double x = t.p[0], y = t.p[1], z = t.p[2];
  const Block b = B;
  // B + [p] M
  B[0] += y * M.xz - z * M.xy, B[1] += y * M.yz - z * M.yy, B[2] += y * M.zz - z * M.yz;
  B[3] += z * M.xx - x * M.xz, B[4] += z * M.xy - x * M.yz, B[5] += z * M.xz - x * M.zz;
  B[6] += x * M.xy - y * M.xx, B[7] += x * M.yy - y * M.xy, B[8] += x * M.yz - y * M.xz;
  // A + [p] b^T - B [p]
  up.A.xx += A.xx + (y * b[2] - z * b[1]) - (B[1] * z - B[2] * y);
  up.A.yy += A.yy + (z * b[3] - x * b[5]) - (B[5] * x - B[3] * z);
  up.A.zz += A.zz + (x * b[7] - y * b[6]) - (B[6] * y - B[7] * x);
  up.A.xy += A.xy + (y * b[5] - z * b[4]) - (B[2] * x - B[0] * z);
  up.A.yz += A.yz + (z * b[6] - x * b[8]) - (B[3] * y - B[4] * x);
  up.A.xz += A.xz + (y * b[8] - z * b[7]) - (B[0] * y - B[1] * x);
  for (std::size_t k = 0; k < 9; ++k) up.B[k] += B[k];
  up.M = spatial::add(up.M, M);
}

}  // namespace robomosp::articulated
