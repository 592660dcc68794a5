// SPDX-License-Identifier: Apache-2.0
// Vectors, symmetric matrices and joint rotations of numbers T, which are doubles, Lanes or Wide;
// for sources of robomosp_lanes() (layer: data processing, spatial).
#pragma once

#include "spatial/joint_constants.h"
#include "spatial/lanes.h"

namespace robomosp::spatial::RMP_LANES {

template <class T>
struct Vec {
  T x, y, z;
};
template <class A, class B>
using Wider = decltype(A{} + B{});

template <class T>
RMP_INLINE Vec<T> vec(const double* v, std::size_t stride = 1) {
  return {splat<T>(v[0]), splat<T>(v[stride]), splat<T>(v[2 * stride])};
}
RMP_INLINE Vec<double> plain(const double* v) { return {v[0], v[1], v[2]}; }
template <class A, class B>
RMP_INLINE Vec<Wider<A, B>> operator+(const Vec<A>& a, const Vec<B>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class A, class B>
RMP_INLINE Vec<Wider<A, B>> operator-(const Vec<A>& a, const Vec<B>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class A, class B>
RMP_INLINE Vec<Wider<A, B>> scaled(const Vec<A>& a, const B& s) {
  return {a.x * s, a.y * s, a.z * s};
}
template <class A, class B>
RMP_INLINE Vec<Wider<A, B>> cross(const Vec<A>& a, const Vec<B>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class A, class B>
RMP_INLINE Wider<A, B> dot(const Vec<A>& a, const Vec<B>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
/// R v and R^T v, R row-major.
template <class A, class B>
RMP_INLINE Vec<Wider<A, B>> multiply(const A* R, const Vec<B>& v) {
  return {R[0] * v.x + R[1] * v.y + R[2] * v.z, R[3] * v.x + R[4] * v.y + R[5] * v.z,
          R[6] * v.x + R[7] * v.y + R[8] * v.z};
}
template <class A, class B>
RMP_INLINE Vec<Wider<A, B>> multiply_back(const A* R, const Vec<B>& v) {
  return {R[0] * v.x + R[3] * v.y + R[6] * v.z, R[1] * v.x + R[4] * v.y + R[7] * v.z,
          R[2] * v.x + R[5] * v.y + R[8] * v.z};
}

template <class T>
struct Sym {
  T xx, yy, zz, xy, yz, xz;
};
template <class A, class B>
RMP_INLINE Vec<Wider<A, B>> multiply(const Sym<A>& m, const Vec<B>& v) {
  return {m.xx * v.x + m.xy * v.y + m.xz * v.z, m.xy * v.x + m.yy * v.y + m.yz * v.z,
          m.xz * v.x + m.yz * v.y + m.zz * v.z};
}
/// R m R^T.
template <class A, class T>
RMP_INLINE Sym<T> turned(const A* R, const Sym<T>& m) {
  const Vec<A> r0{R[0], R[1], R[2]}, r1{R[3], R[4], R[5]}, r2{R[6], R[7], R[8]};
  const Vec<T> a = multiply(m, r0), b = multiply(m, r1), c = multiply(m, r2);
  return {dot(r0, a), dot(r1, b), dot(r2, c), dot(r0, b), dot(r1, c), dot(r0, c)};
}

/// parent_R_joint of one configuration; see JointConstants. R only for Turn::ball.
template <Turn K, class T>
struct Rotation {
  const JointConstants& k;
  T s, c;
  const T* R;

  /// A direction of the joint's frame in the parent's.
  RMP_INLINE Vec<T> forth(const Vec<T>& v) const {
    if constexpr (K == Turn::ball) {
      return multiply(R, v);
    } else {
      const Vec<T> z{c * v.x - s * v.y, s * v.x + c * v.y, v.z};
      if constexpr (K == Turn::none) return z;
      if constexpr (K == Turn::quarter) return {z.x, -z.z, z.y};
      if constexpr (K == Turn::minus_quarter) return {z.x, z.z, -z.y};
      if constexpr (K == Turn::twist)
        return {z.x, k.cos_twist * z.y - k.sin_twist * z.z, k.sin_twist * z.y + k.cos_twist * z.z};
      if constexpr (K == Turn::general) return multiply(k.R, z);
    }
  }
  /// A direction of the parent's frame in the joint's.
  RMP_INLINE Vec<T> back(const Vec<T>& v) const {
    if constexpr (K == Turn::ball) {
      return multiply_back(R, v);
    } else {
      Vec<T> u = v;
      if constexpr (K == Turn::quarter) u = {v.x, v.z, -v.y};
      if constexpr (K == Turn::minus_quarter) u = {v.x, -v.z, v.y};
      if constexpr (K == Turn::twist)
        u = {v.x, k.cos_twist * v.y + k.sin_twist * v.z, k.cos_twist * v.z - k.sin_twist * v.y};
      if constexpr (K == Turn::general) u = multiply_back(k.R, v);
      return {c * u.x + s * u.y, c * u.y - s * u.x, u.z};
    }
  }
  /// A symmetric matrix of the joint's frame in the parent's.
  RMP_INLINE Sym<T> forth(const Sym<T>& m) const {
    if constexpr (K == Turn::ball) {
      return turned(R, m);
    } else {
      const T cs = c * s, ss = s * s, d = m.xx - m.yy;
      const T shift = ss * d + (2 * cs) * m.xy;
      const Sym<T> z{m.xx - shift,        m.yy + shift,       m.zz, cs * d + (1 - 2 * ss) * m.xy,
                     s * m.xz + c * m.yz, c * m.xz - s * m.yz};
      if constexpr (K == Turn::none) return z;
      if constexpr (K == Turn::quarter) return {z.xx, z.zz, z.yy, -z.xz, -z.yz, z.xy};
      if constexpr (K == Turn::minus_quarter) return {z.xx, z.zz, z.yy, z.xz, -z.yz, -z.xy};
      if constexpr (K == Turn::twist) {
        const double ca = k.cos_twist, sa = k.sin_twist;
        const T e = z.yy - z.zz, away = (sa * sa) * e + (2 * ca * sa) * z.yz;
        return {z.xx,
                z.yy - away,
                z.zz + away,
                ca * z.xy - sa * z.xz,
                (ca * sa) * e + (1 - 2 * sa * sa) * z.yz,
                sa * z.xy + ca * z.xz};
      }
      if constexpr (K == Turn::general) return turned(k.R, z);
    }
  }
};

template <Turn K>
struct TurnOf {
  static constexpr Turn kTurn = K;
};
/// Calls f with the TurnOf of a joint: one branch, and then code for that kind of rotation alone.
template <class F>
RMP_INLINE void by_turn(Turn turn, const F& f) {
  switch (turn) {
    case Turn::none: return f(TurnOf<Turn::none>{});
    case Turn::quarter: return f(TurnOf<Turn::quarter>{});
    case Turn::minus_quarter: return f(TurnOf<Turn::minus_quarter>{});
    case Turn::twist: return f(TurnOf<Turn::twist>{});
    case Turn::general: return f(TurnOf<Turn::general>{});
    case Turn::ball: return f(TurnOf<Turn::ball>{});
  }
}

/// R times the rotation of a quaternion w x y z of any length but zero.
template <class T>
RMP_INLINE void ball_rotation(const double* R, const T* q, T* out) {
  const T scale = 2 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const T x = scale * q[1], y = scale * q[2], z = scale * q[3];
  const T Q[9] = {1 - y * q[2] - z * q[3], x * q[2] - z * q[0],     x * q[3] + y * q[0],
                  x * q[2] + z * q[0],     1 - x * q[1] - z * q[3], y * q[3] - x * q[0],
                  x * q[3] - y * q[0],     y * q[3] + x * q[0],     1 - x * q[1] - y * q[2]};
  for (int i = 0; i < 9; i += 3)
    for (int j = 0; j < 3; ++j)
      out[i + j] = R[i] * Q[j] + R[i + 1] * Q[3 + j] + R[i + 2] * Q[6 + j];
}

}  // namespace robomosp::spatial::RMP_LANES
