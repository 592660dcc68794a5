// SPDX-License-Identifier: Apache-2.0
// Vectors of doubles, one sample a lane, for sources that CMake's robomosp_lanes() compiles once an
// instruction set. Everything lives in a namespace of that set and uses no inline function of the
// standard library, so that no code of one set is ever linked in place of another's
// (layer: data processing, spatial). Decision 0013.
#pragma once

#include <cstddef>
#include <cstdint>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

#ifndef RMP_LANES
#error "spatial/lanes.h is for sources that robomosp_lanes() compiles"
#endif

// Arguments are inlined away; the warning is about calls between sets, which do not happen.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace robomosp::spatial::RMP_LANES {

#if defined(__SANITIZE_ADDRESS__)
#define RMP_INLINE inline  // instrumented, one large function takes minutes to compile
#else
#define RMP_INLINE [[gnu::always_inline]] inline
#endif

inline constexpr std::size_t kLanes = RMP_LANE_COUNT;
using Lanes = double __attribute__((vector_size(8 * RMP_LANE_COUNT)));
using Bits = std::int64_t __attribute__((vector_size(8 * RMP_LANE_COUNT)));

RMP_INLINE Lanes load(const double* from) {
  Lanes v;
  __builtin_memcpy(&v, from, sizeof v);
  return v;
}
RMP_INLINE void store(double* to, Lanes v) { __builtin_memcpy(to, &v, sizeof v); }
/// The first n numbers, n < kLanes; the others are zero.
RMP_INLINE Lanes load_first(const double* from, std::size_t n) {
#if defined(__AVX512F__) && RMP_LANE_COUNT == 8
  return _mm512_maskz_loadu_pd(static_cast<__mmask8>((1U << n) - 1), from);
#else
  Lanes v{};
  for (std::size_t i = 0; i < kLanes; ++i) v[i] = i < n ? from[i] : 0;
  return v;
#endif
}
RMP_INLINE void store_first(double* to, Lanes v, std::size_t n) {
#if defined(__AVX512F__) && RMP_LANE_COUNT == 8
  _mm512_mask_storeu_pd(to, static_cast<__mmask8>((1U << n) - 1), v);
#else
  for (std::size_t i = 0; i < kLanes; ++i)
    if (i < n) to[i] = v[i];
#endif
}
/// The same number in every lane, or the number itself.
template <class T>
RMP_INLINE T splat(double x) {
  return x - T{};
}
/// True when a comparison holds in some lane.
RMP_INLINE bool any(Bits mask) {
#if defined(__AVX512DQ__) && RMP_LANE_COUNT == 8
  return _mm512_movepi64_mask(reinterpret_cast<__m512i>(mask)) != 0;
#elif defined(__AVX__) && RMP_LANE_COUNT == 4
  return _mm256_movemask_pd(reinterpret_cast<__m256d>(mask)) != 0;
#elif defined(__x86_64__) && RMP_LANE_COUNT == 2
  return _mm_movemask_pd(reinterpret_cast<__m128d>(mask)) != 0;
#else
  for (std::size_t i = 0; i < kLanes; ++i)
    if (mask[i]) return true;
  return false;
#endif
}
RMP_INLINE bool any(bool condition) { return condition; }

RMP_INLINE double select(bool which, double a, double b) { return which ? a : b; }
RMP_INLINE Lanes select(Bits which, Lanes a, Lanes b) { return which ? a : b; }

/// Two vectors that are computed side by side: recursions wait for results less.
struct Wide {
  Lanes a, b;
};
/// Whether Wide pays: there are registers for it.
inline constexpr bool kHasWide = kLanes == 8;
struct WideBits {
  Bits a, b;
};
#define RMP_WIDE_OPERATOR(op)                                                                    \
  RMP_INLINE Wide operator op(const Wide& x, const Wide& y) { return {x.a op y.a, x.b op y.b}; } \
  RMP_INLINE Wide operator op(const Wide& x, double y) { return {x.a op y, x.b op y}; }          \
  RMP_INLINE Wide operator op(double x, const Wide& y) { return {x op y.a, x op y.b}; }          \
  RMP_INLINE Wide& operator op##=(Wide& x, const Wide& y) { return x = x op y; }                 \
  RMP_INLINE Wide& operator op##=(Wide& x, double y) { return x = x op y; }
RMP_WIDE_OPERATOR(+)
RMP_WIDE_OPERATOR(-)
RMP_WIDE_OPERATOR(*)
RMP_WIDE_OPERATOR(/)
#undef RMP_WIDE_OPERATOR
RMP_INLINE Wide operator-(const Wide& x) { return {-x.a, -x.b}; }
#define RMP_WIDE_COMPARISON(op)                                   \
  RMP_INLINE WideBits operator op(const Wide& x, const Wide& y) { \
    return {x.a op y.a, x.b op y.b};                              \
  }                                                               \
  RMP_INLINE WideBits operator op(const Wide& x, double y) { return {x.a op y, x.b op y}; }
RMP_WIDE_COMPARISON(<)
RMP_WIDE_COMPARISON(>)
RMP_WIDE_COMPARISON(<=)
RMP_WIDE_COMPARISON(>=)
#undef RMP_WIDE_COMPARISON
RMP_INLINE WideBits operator&(const WideBits& x, const WideBits& y) {
  return {x.a & y.a, x.b & y.b};
}
RMP_INLINE WideBits operator~(const WideBits& x) { return {~x.a, ~x.b}; }
RMP_INLINE bool any(const WideBits& x) { return any(x.a | x.b); }
RMP_INLINE Wide select(const WideBits& which, const Wide& x, const Wide& y) {
  return {select(which.a, x.a, y.a), select(which.b, x.b, y.b)};
}

/// The numbers of `a` and, from kLanes on, of `b` that `which` counts.
RMP_INLINE Lanes shuffled(const Lanes& a, const Lanes& b, const Bits& which) {
#if defined(__clang__)  // which has no shuffle by numbers that are not written out
  Lanes out;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const auto from = static_cast<std::size_t>(which[i]);
    out[i] = from < kLanes ? a[from] : b[from - kLanes];
  }
  return out;
#else
  return __builtin_shuffle(a, b, which);
#endif
}
/// Swaps rows and columns of a square of numbers, in log2(kLanes) rounds of exchanges.
RMP_INLINE void transpose(Lanes* row) {
  Bits lane, low, high;
  for (std::size_t i = 0; i < kLanes; ++i) lane[i] = static_cast<std::int64_t>(i);
#pragma GCC unroll 3
  for (std::size_t d = 1; d < kLanes; d *= 2) {
    const auto step = static_cast<std::int64_t>(d), count = static_cast<std::int64_t>(kLanes);
    low = (lane & step) ? lane - step + count : lane;
    high = (lane & step) ? lane + count : lane + step;
#pragma GCC unroll 8
    for (std::size_t i = 0; i < kLanes; ++i) {
      if (i & d) continue;
      const Lanes a = row[i], b = row[i + d];
      row[i] = shuffled(a, b, low);
      row[i + d] = shuffled(a, b, high);
    }
  }
}

/// Reads `width` numbers a sample of the first kLanes of `samples` samples at `from` into one
/// vector a number, `stride` doubles apart; lanes beyond the last sample repeat it.
inline void load_samples(const double* from, std::size_t width, std::size_t samples, double* to,
                         std::size_t stride) {
  if (samples == 1) {
    for (std::size_t k = 0; k < width; ++k) store(to + k * stride, splat<Lanes>(from[k]));
    return;
  }
  const std::size_t size = samples * width;
  for (std::size_t first = 0; first < width; first += kLanes) {
    const std::size_t part = width - first < kLanes ? width - first : kLanes;
    Lanes row[kLanes];
    if (samples >= kLanes && (kLanes - 1) * width + first + kLanes <= size) {
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kLanes; ++i) row[i] = load(from + i * width + first);
    } else {
      for (std::size_t i = 0; i < kLanes; ++i) {
        const std::size_t at = (i < samples ? i : samples - 1) * width + first;
        row[i] = at + kLanes <= size ? load(from + at) : load_first(from + at, part);
      }
    }
    transpose(row);
    for (std::size_t k = 0; k < part; ++k) store(to + (first + k) * stride, row[k]);
  }
}

/// Writes what load_samples reads: `width` vectors to min(samples, kLanes) samples at `to`.
inline void store_samples(const double* from, std::size_t stride, std::size_t width,
                          std::size_t samples, double* to) {
  if (samples > kLanes) samples = kLanes;
  const std::size_t size = samples * width;
  for (std::size_t next = 0; next < width; next += kLanes) {
    // The last square of a wide sample overlaps the one before; a narrow sample is written with
    // some of what follows it, which the next sample overwrites.
    const std::size_t first = next + kLanes <= width || width < kLanes ? next : width - kLanes;
    const std::size_t part = width < kLanes ? width : kLanes;
    Lanes row[kLanes];
    if (width >= kLanes) {
#pragma GCC unroll 8
      for (std::size_t k = 0; k < kLanes; ++k) row[k] = load(from + (first + k) * stride);
    } else {
#pragma GCC unroll 8
      for (std::size_t k = 0; k < kLanes; ++k)
        row[k] = k < part ? load(from + (first + k) * stride) : Lanes{};
    }
    transpose(row);
    if (samples == kLanes && width >= kLanes) {
#pragma GCC unroll 8
      for (std::size_t i = 0; i < kLanes; ++i) store(to + i * width + first, row[i]);
      continue;
    }
    for (std::size_t i = 0; i < samples; ++i) {
      const std::size_t at = i * width + first;
      if (at + kLanes <= size) store(to + at, row[i]);
      else store_first(to + at, row[i], part);
    }
  }
}

/// Samples at `from`, of which there is at least one, in the lanes of T: of Lanes or Wide.
template <class T>
inline void load_samples(const double* from, std::size_t width, std::size_t samples, T* to) {
  constexpr std::size_t kStride = sizeof(T) / sizeof(double);
  auto* at = reinterpret_cast<double*>(to);
  for (std::size_t half = 0; half < kStride; half += kLanes) {
    const std::size_t begin = half < samples ? half : samples - 1;
    load_samples(from + begin * width, width, samples - begin, at + half, kStride);
  }
}
template <class T>
inline void store_samples(const T* from, std::size_t width, std::size_t samples, double* to) {
  constexpr std::size_t kStride = sizeof(T) / sizeof(double);
  const auto* at = reinterpret_cast<const double*>(from);
  for (std::size_t half = 0; half < kStride && half < samples; half += kLanes)
    store_samples(at + half, kStride, width, samples - half, to + half * width);
}

enum class RightAngles {
  as_given,  ///< the number's own sine and cosine
  exact,     ///< as spatial::sin_cos: what is within some 1e-15 rad of a right angle is one
};

RMP_INLINE Lanes magnitude_of(Lanes x) {
  return reinterpret_cast<Lanes>(reinterpret_cast<Bits>(x) & INT64_MAX);
}

/// Sine and cosine. Up to kSinCosRange [rad] by reduction with pi/2 in three parts (119 bits) and
/// the minimax polynomials of fdlibm (Sun, 1993: k_sin.c, k_cos.c), beyond and for NaN and
/// infinities by the C library. Error below 1 ulp; as_given, sin(-x) = -sin(x).
inline constexpr double kSinCosRange = 1e4;
/// For numbers within the range, of any other ones anything.
template <RightAngles Right>
RMP_INLINE void near_sin_cos(Lanes x, Lanes& sine, Lanes& cosine) {
  constexpr double kRound = 0x1.8p52, kTwoByPi = 0x1.45f306dc9c883p-1;
  // pi/2 = kHigh + kMiddle + kLow; the first two have 33 bits, so that small multiples are exact.
  constexpr double kHigh = 0x1.921fb544p0, kMiddle = 0x1.0b4611a6p-34, kLow = 0x1.3198a2e037073p-69;
  const Lanes shifted = x * kTwoByPi + kRound;
  const Bits quadrant = reinterpret_cast<Bits>(shifted);
  const Lanes turns = shifted - kRound;
  const Lanes t = x - turns * kHigh, w = turns * kMiddle, r = t - w;
  const Lanes tail = turns * kLow - ((t - r) - w);
  Lanes y = r - tail, rest = (r - y) - tail;
  if constexpr (Right == RightAngles::exact) {
    const Bits wrong = magnitude_of(y) > 0.5e-15 + 0.5e-15 * magnitude_of(turns);
    y = reinterpret_cast<Lanes>(reinterpret_cast<Bits>(y) & wrong);
    rest = reinterpret_cast<Lanes>(reinterpret_cast<Bits>(rest) & wrong);
  }
  const Lanes z = y * y, cube = z * y;
  // Pairs of terms side by side, so that less waits for what comes before.
  const Lanes zz = z * z;
  const Lanes p = (8.33333333332248946124e-03 + z * -1.98412698298579493134e-04) +
                  zz * ((2.75573137070700676789e-06 + z * -2.50507602534068634195e-08) +
                        zz * 1.58969099521155010221e-10);
  const Lanes s = y - ((z * (0.5 * rest - cube * p) - rest) + cube * 1.66666666666666324348e-01);
  const Lanes g = z * ((4.16666666666666019037e-02 + z * -1.38888888888741095749e-03) +
                       zz * ((2.48015872894767294178e-05 + z * -2.75573143513906633035e-07) +
                             zz * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)));
  const Lanes half = 0.5 * z, top = 1 - half;
  const Lanes c = top + (((1 - top) - half) + (z * g - y * rest));
  const Bits swap = (quadrant & 1) != 0;
  sine = reinterpret_cast<Lanes>(reinterpret_cast<Bits>(swap ? c : s) ^ ((quadrant & 2) << 62));
  cosine =
      reinterpret_cast<Lanes>(reinterpret_cast<Bits>(swap ? s : c) ^ (((quadrant + 1) & 2) << 62));
}
RMP_INLINE Bits far(Lanes x) { return ~(magnitude_of(x) <= kSinCosRange); }
/// Of the lanes that are beyond the range.
[[gnu::noinline]] inline void far_sin_cos(const double* x, double* sine, double* cosine) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (__builtin_fabs(x[i]) <= kSinCosRange) continue;
    sine[i] = __builtin_sin(x[i]);
    cosine[i] = __builtin_cos(x[i]);
  }
}

/// Of many numbers; reads and writes up to the next multiple of kLanes.
template <RightAngles Right>
inline void sin_cos(const double* x, std::size_t count, double* sine, double* cosine) {
  std::size_t i = 0;
  const auto write = [&](std::size_t at, Lanes s, Lanes c) {
    store(sine + at, s);
    store(cosine + at, c);
  };
  for (; i + kLanes < count; i += 2 * kLanes) {
    const Lanes first = load(x + i), second = load(x + i + kLanes);
    Lanes s, c, t, d;
    near_sin_cos<Right>(first, s, c);
    near_sin_cos<Right>(second, t, d);
    write(i, s, c);
    write(i + kLanes, t, d);
    if (__builtin_expect(any(far(first) | far(second)), 0))
      for (std::size_t at = i; at <= i + kLanes; at += kLanes)
        far_sin_cos(x + at, sine + at, cosine + at);
  }
  if (i >= count) return;
  Lanes s, c;
  near_sin_cos<Right>(load(x + i), s, c);
  write(i, s, c);
  if (__builtin_expect(any(far(load(x + i))), 0)) far_sin_cos(x + i, sine + i, cosine + i);
}

}  // namespace robomosp::spatial::RMP_LANES
