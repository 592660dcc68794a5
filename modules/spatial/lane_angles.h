// SPDX-License-Identifier: Apache-2.0
// Square roots, the angle of a direction, and distances of the tips of arms from their targets, in
// lanes; for sources of robomosp_lanes() (layer: data processing, spatial).
#pragma once

#include "spatial/lane_math.h"

namespace robomosp::spatial::RMP_LANES {

inline constexpr double kPi = 0x1.921fb54442d18p1;

template <class B, class T>
RMP_INLINE T pick(B which, const T& yes, const T& no) {
  return select(which, yes, no);
}
template <class T>
RMP_INLINE T size_of(const T& x) {
  return pick(x < 0, -x, x);
}
template <class T>
RMP_INLINE T least_of(const T& a, const T& b) {
  return pick(a < b, a, b);
}
template <class T>
RMP_INLINE T most_of(const T& a, const T& b) {
  return pick(a > b, a, b);
}
RMP_INLINE Lanes root_of(Lanes x) {
#if defined(__AVX512F__) && RMP_LANE_COUNT == 8
  return _mm512_maskz_sqrt_pd(0xff, x);
#elif defined(__AVX__) && RMP_LANE_COUNT == 4
  return _mm256_sqrt_pd(x);
#else
  for (std::size_t i = 0; i < kLanes; ++i) x[i] = __builtin_sqrt(x[i]);
  return x;
#endif
}

RMP_INLINE Wide root_of(const Wide& x) { return {root_of(x.a), root_of(x.b)}; }

// Angle of (x, y), to 2e-16 relative: atan(t) on t <= tan(pi / 8) as t + t^3 P(t^2), P interpolated
// at Chebyshev nodes; 0 at the origin.
template <class T>
RMP_INLINE T angle(const T& y, const T& x) {
  const T ax = size_of(x), ay = size_of(y);
  const T big = most_of(ax, ay), small = least_of(ax, ay);
  const auto far = small > 0x1.a827999fcef33p-2 * big;  // atan t = pi/4 + atan((t - 1) / (t + 1))
  const T up = pick(far, small - big, small), down = pick(far, small + big, big);
  const T t = up / pick(down > 0, down, splat<T>(1)), z = t * t;
  T p = splat<T>(0.016144973584241742);
  p = p * z - 0.03442637336309011;
  p = p * z + 0.045451625004966183;
  p = p * z - 0.052288153563136014;
  p = p * z + 0.058786656658639996;
  p = p * z - 0.066663971190719304;
  p = p * z + 0.076922944359089529;
  p = p * z - 0.090909086651550702;
  p = p * z + 0.11111111102643356;
  p = p * z - 0.14285714285619402;
  p = p * z + 0.19999999999999518;
  p = p * z - 0.33333333333333331;
  T a = pick(far, splat<T>(kPi / 4), T{}) + (t + t * z * p);
  a = pick(ax >= ay, a, kPi / 2 - a);
  a = pick(x < 0, kPi - a, a);
  return pick(y < 0, -a, a);
}

/// Distance of the tip at q from the target [m], and the sum of the squared differences of the
/// rotation matrices' elements, for `count` samples of arms of N revolute joints; arrays have space
/// for the next multiple of kLanes samples. `places` and `targets`: 12 numbers each, R row-major,
/// then p; the joints at q = 0, each relative to the previous one, then the tool.
template <std::size_t N>
inline void measure_tips(const double* places, const double* targets, const double* q,
                         std::size_t count, double* distance, double* square) {
  for (std::size_t i = 0; i < count; i += kLanes) {
    Lanes pose[12], angles[N];
    load_samples(targets + 12 * i, 12, count - i, pose);
    load_samples(q + N * i, N, count - i, angles);
    double sine[N * kLanes], cosine[N * kLanes];
    sin_cos<RightAngles::as_given>(reinterpret_cast<const double*>(angles), N * kLanes, sine,
                                   cosine);
    // Axes and origin of the joint's frame, in the base.
    const Lanes none{}, one = splat<Lanes>(1);
    Vec<Lanes> x{one, none, none}, y{none, one, none}, z{none, none, one}, p{none, none, none};
    for (std::size_t j = 0; j <= N; ++j) {
      const double* k = places + 12 * j;
      const auto seen = [&](double a, double b, double d) __attribute__((always_inline)) {
        return scaled(x, a) + scaled(y, b) + scaled(z, d);
      };
      p = p + seen(k[9], k[10], k[11]);
      const Vec<Lanes> X = seen(k[0], k[3], k[6]), Y = seen(k[1], k[4], k[7]);
      z = seen(k[2], k[5], k[8]);
      x = X, y = Y;
      if (j == N) break;  // the tool
      const Lanes s = load(sine + j * kLanes), c = load(cosine + j * kLanes);
      x = scaled(X, c) + scaled(Y, s);
      y = scaled(Y, c) - scaled(X, s);
    }
    const Vec<Lanes> miss = p - Vec<Lanes>{pose[9], pose[10], pose[11]};
    store(distance + i, root_of(dot(miss, miss)));
    const Vec<Lanes> dx = x - Vec<Lanes>{pose[0], pose[3], pose[6]},
                     dy = y - Vec<Lanes>{pose[1], pose[4], pose[7]},
                     dz = z - Vec<Lanes>{pose[2], pose[5], pose[8]};
    store(square + i, dot(dx, dx) + dot(dy, dy) + dot(dz, dz));
  }
}

}  // namespace robomosp::spatial::RMP_LANES
