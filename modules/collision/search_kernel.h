// SPDX-License-Identifier: Apache-2.0
// The kernels of search_kernel.cpp, one table an instruction set; plain structures only
// (layer: application, collision).
#pragma once

#include <cstddef>
#include <cstdint>

namespace robomosp::collision {

/// Configurations of one call at most.
inline constexpr std::size_t kMostSearchLanes = 8;

/// A sphere in the frame of the joint that carries it [m].
struct SearchSphere {
  double centre[3];
  double radius;
};

/// A body at rest in the frame of a robot's base: a box or a cylinder about z, centred, and all
/// that is within `margin` of it. Spheres and capsules are points and segments with a margin [m].
struct SearchShape {
  double R[9];     ///< base_T_shape, row-major
  double p[3];     ///< base_T_shape
  double half[3];  ///< of a box: half sizes; of a cylinder: radius, radius, half length
  double margin;
  bool is_cylinder;
};

/// Vectors hold one configuration a lane; results are bits, bit k for lane k.
struct SearchKernel {
  std::size_t lanes;
  /// One vector a number from 1..lanes configurations of `width` numbers each, row after row; the
  /// lanes beyond the last configuration repeat it.
  void (*spread)(const double* rows, std::size_t width, std::size_t configurations, double* out);
  /// Centres of spheres in the base frame, three vectors each. `frame`: 12 vectors, base_T_joint.
  void (*centres)(const double* frame, const SearchSphere* spheres, std::size_t count, double* out);
  /// The lanes in which one of the spheres is nearer to the shape than `room` (a vector) [m].
  std::uint32_t (*near_shape)(const double* centres, const SearchSphere* spheres, std::size_t count,
                              const SearchShape& shape, const double* room);
  /// The lanes in which a sphere of one body is nearer to one of another than `room`; `around_b` is
  /// a sphere around all of the second body, and its centre.
  std::uint32_t (*near_spheres)(const double* centres_a, const SearchSphere* a, std::size_t count_a,
                                const double* centres_b, const SearchSphere* b, std::size_t count_b,
                                const double* centre_around_b, const SearchSphere& around_b,
                                const double* room);
};

namespace baseline {
const SearchKernel& search_kernel();
}
namespace avx2 {
const SearchKernel& search_kernel();
}
namespace avx512 {
const SearchKernel& search_kernel();
}

}  // namespace robomosp::collision
