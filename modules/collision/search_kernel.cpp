// SPDX-License-Identifier: Apache-2.0
// Whether spheres are near boxes, cylinders and other spheres, a configuration a lane; compiled
// once an instruction set.
#include "collision/search_kernel.h"

#include "spatial/lane_angles.h"

namespace robomosp::collision::RMP_LANES {
namespace {

using namespace spatial::RMP_LANES;

RMP_INLINE std::uint32_t bits_of(Bits mask) {
#if defined(__AVX512DQ__) && RMP_LANE_COUNT == 8
  return _mm512_movepi64_mask(reinterpret_cast<__m512i>(mask));
#elif defined(__AVX__) && RMP_LANE_COUNT == 4
  return static_cast<std::uint32_t>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
#elif defined(__x86_64__) && RMP_LANE_COUNT == 2
  return static_cast<std::uint32_t>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask)));
#else
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < kLanes; ++i)
    if (mask[i]) bits |= 1U << i;
  return bits;
#endif
}

RMP_INLINE Lanes above_zero(Lanes x) { return most_of(x, Lanes{}); }

RMP_INLINE Vec<Lanes> centre_at(const double* centres, std::size_t i) {
  const double* at = centres + 3 * kLanes * i;
  return {load(at), load(at + kLanes), load(at + 2 * kLanes)};
}

void spread(const double* rows, std::size_t width, std::size_t configurations, double* out) {
  load_samples(rows, width, configurations, out, kLanes);
}

void centres(const double* frame, const SearchSphere* spheres, std::size_t count, double* out) {
  Lanes f[12];
  for (std::size_t k = 0; k < 12; ++k) f[k] = load(frame + k * kLanes);
  for (std::size_t i = 0; i < count; ++i) {
    const Vec<Lanes> at = multiply(f, plain(spheres[i].centre)) + Vec<Lanes>{f[9], f[10], f[11]};
    store(out + 3 * kLanes * i, at.x);
    store(out + (3 * i + 1) * kLanes, at.y);
    store(out + (3 * i + 2) * kLanes, at.z);
  }
}

template <bool is_cylinder>
RMP_INLINE std::uint32_t near_one(const double* at, const SearchSphere* spheres, std::size_t count,
                                  const SearchShape& s, Lanes room) {
  Bits near{};
  for (std::size_t i = 0; i < count; ++i) {
    const Vec<Lanes> v = multiply_back(s.R, centre_at(at, i) - plain(s.p));
    const Lanes reach = room + (spheres[i].radius + s.margin), z = size_of(v.z) - s.half[2];
    const Lanes up = above_zero(z);
    Lanes squared;
    if constexpr (is_cylinder) {
      const Lanes out = above_zero(root_of(v.x * v.x + v.y * v.y) - s.half[0]);
      squared = out * out + up * up;
    } else {
      const Lanes x = above_zero(size_of(v.x) - s.half[0]),
                  y = above_zero(size_of(v.y) - s.half[1]);
      squared = x * x + y * y + up * up;
    }
    near |= squared < reach * reach;
  }
  return bits_of(near);
}

std::uint32_t near_shape(const double* at, const SearchSphere* spheres, std::size_t count,
                         const SearchShape& shape, const double* room) {
  return shape.is_cylinder ? near_one<true>(at, spheres, count, shape, load(room))
                           : near_one<false>(at, spheres, count, shape, load(room));
}

RMP_INLINE Bits near_each_other(const Vec<Lanes>& a, double radius_a, const Vec<Lanes>& b,
                                double radius_b, Lanes room) {
  const Vec<Lanes> d = a - b;
  const Lanes reach = room + (radius_a + radius_b);
  return dot(d, d) < reach * reach;
}

std::uint32_t near_spheres(const double* centres_a, const SearchSphere* a, std::size_t count_a,
                           const double* centres_b, const SearchSphere* b, std::size_t count_b,
                           const double* centre_around_b, const SearchSphere& around_b,
                           const double* room) {
  const Lanes own = load(room);
  const Vec<Lanes> around = centre_at(centre_around_b, 0);
  Bits near{};
  for (std::size_t i = 0; i < count_a; ++i) {
    const Vec<Lanes> at = centre_at(centres_a, i);
    if (!any(near_each_other(at, a[i].radius, around, around_b.radius, own))) continue;
    for (std::size_t k = 0; k < count_b; ++k)
      near |= near_each_other(at, a[i].radius, centre_at(centres_b, k), b[k].radius, own);
  }
  return bits_of(near);
}

constexpr SearchKernel kSearchKernel{kLanes, spread, centres, near_shape, near_spheres};

}  // namespace

const SearchKernel& search_kernel() { return kSearchKernel; }

}  // namespace robomosp::collision::RMP_LANES
