// SPDX-License-Identifier: Apache-2.0
// The scratch of one evaluation of the recursions, and the placements of all joints in it; for
// sources of robomosp_lanes() (layer: data processing, spatial).
#pragma once

#include <robomosp/sdk/dynamics.h>

#include "spatial/lane_math.h"
#include "spatial/recursion_kernels.h"

namespace robomosp::spatial::recursions::RMP_LANES {

using namespace spatial::RMP_LANES;

// Results of the outward pass for later joints and for the inward pass, in the joint's frame.
template <class T>
struct Link {
  Vec<T> w, wd, a;  // angular velocity, angular and linear acceleration of the origin
  T U[9];           // [wd x] + [w x][w x]: acceleration by place in the body
  Vec<T> f, n;      // force and moment about the origin
};
template <class T>
struct Composite {
  Vec<T> first;
  Sym<T> inertia;
};
template <class T>
struct Place {
  Vec<T> p;  // parent_p_joint, of joints that move it
  T R[9];    // parent_R_joint, of Turn::ball
};

// Force (n, f) = (A wd + B a, B^T wd + M a) + (n, f at rest), in the joint's frame.
template <class T>
struct ArticulatedBody {
  Sym<T> A, M;
  Vec<T> B[3];  // rows
  Vec<T> n, f;
};
// Results of the inward pass for the outward one.
template <class T>
struct Resistance {
  Vec<T> n, f;  // to an acceleration of the joint
  T inverse, force;
};

// The scratch of one evaluation.
template <class T>
struct Scratch {
  double *angle, *sine, *cosine;  // joints * lanes of T
  T *q, *qd, *qdd, *tau, *zeros, *m, *diagonal, *wrench;
  Link<T>* links;  // [0] is the base
  Place<T>* places;
  Composite<T>* composites;
  ArticulatedBody<T>* branches;
  Resistance<T>* resistances;
};
constexpr std::size_t padded(std::size_t n) { return (n + kLanes - 1) / kLanes * kLanes; }

// Lays out the memory from `at` and returns its number of doubles, alignment included. With a null
// pointer it only computes the size.
template <class T>
std::size_t lay_out(const Mechanism& m, const Task& task, double* at, Scratch<T>& room) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double), kAlignment = 64;
  if (at) {
    const auto address = reinterpret_cast<std::uintptr_t>(at);
    at += ((kAlignment - address % kAlignment) % kAlignment) / sizeof(double);
  }
  std::size_t used = 0;
  const auto take = [&](std::size_t doubles) {
    double* here = at ? at + used : nullptr;
    used += (doubles + 7) / 8 * 8;
    return here;
  };
  const auto numbers = [&](std::size_t n) { return reinterpret_cast<T*>(take(n * kWide)); };
  const std::size_t angles = padded(m.count * kWide), n = m.velocities;
  room.angle = take(angles), room.sine = take(angles), room.cosine = take(angles);
  room.q = numbers(m.coordinates);
  room.qd = numbers(n), room.qdd = numbers(n);
  room.tau = numbers(n), room.zeros = numbers(n);
  room.diagonal = numbers(n), room.wrench = numbers(6);
  room.links = reinterpret_cast<Link<T>*>(take((m.count + 1) * sizeof(Link<T>) / 8));
  room.places = reinterpret_cast<Place<T>*>(take(m.count * sizeof(Place<T>) / 8));
  room.composites = reinterpret_cast<Composite<T>*>(take(m.count * sizeof(Composite<T>) / 8));
  const std::size_t articulated = task.pivots ? m.count : 0;
  room.branches = reinterpret_cast<ArticulatedBody<T>*>(
      take((m.simple_chain ? 0 : articulated) * sizeof(ArticulatedBody<T>) / 8));
  room.resistances =
      reinterpret_cast<Resistance<T>*>(take(articulated * sizeof(Resistance<T>) / 8));
  const bool has_matrix =
      task.what == Task::What::inertia || task.what == Task::What::accelerations;
  room.m = numbers(has_matrix && !task.pivots ? n * n : 0);
  return used + kAlignment / sizeof(double);
}

template <Turn K, class T>
RMP_INLINE Rotation<K, T> rotation(const Scratch<T>& x, const Body& b, std::size_t j) {
  if constexpr (K == Turn::ball) return {b.joint, T{}, T{}, x.places[j].R};
  T s, c;
  __builtin_memcpy(&s, x.sine + j * (sizeof(T) / 8), sizeof(T));
  __builtin_memcpy(&c, x.cosine + j * (sizeof(T) / 8), sizeof(T));
  return {b.joint, s, c, nullptr};
}
RMP_INLINE bool moves(const spatial::JointConstants& k) {
  return k.type == JointType::prismatic || k.type == JointType::free;
}

// Sines, cosines and placements of all joints.
template <class T>
void place(const Mechanism& m, const T* q, const Scratch<T>& x) {
  constexpr std::size_t kWide = sizeof(T) / sizeof(double);
  for (std::size_t j = 0; j < m.count; ++j) {
    const spatial::JointConstants& k = m.bodies[j].joint;
    T angle = splat<T>(k.angle);
    if (k.type == JointType::revolute) {
      angle += q[k.q_index] * k.ratio + k.offset;
    } else if (k.type == JointType::prismatic) {
      const T way = q[k.q_index] * k.ratio + k.offset;
      x.places[j].p = {k.p[0] + way * k.R[2], k.p[1] + way * k.R[5], k.p[2] + way * k.R[8]};
    } else {
      const T* own = q + k.q_index;
      if (k.type == JointType::free) {
        x.places[j].p = plain(k.p) + multiply(k.R, Vec<T>{own[0], own[1], own[2]});
        own += 3;
      }
      ball_rotation(k.R, own, x.places[j].R);
    }
    __builtin_memcpy(x.angle + j * kWide, &angle, sizeof angle);
  }
  const std::size_t used = m.count * kWide;
  for (std::size_t i = used; i < padded(used); ++i) x.angle[i] = 0;
  sin_cos<RightAngles::exact>(x.angle, used, x.sine, x.cosine);
}
}  // namespace robomosp::spatial::recursions::RMP_LANES
