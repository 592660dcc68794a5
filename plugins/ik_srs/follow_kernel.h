// SPDX-License-Identifier: Apache-2.0
// The kernels of follow_kernel.cpp, one an instruction set; plain structures only (layer: plugin).
#pragma once

#include <cstddef>

namespace robomosp::ik_srs {

/// Samples of one call at most.
inline constexpr std::size_t kMostAhead = 64;

/// An arm, one of its branches and an arm angle, as numbers; matrices row-major.
struct FollowArm {
  double shoulder[3], tip_wrist[3], upper[3], fore[3];
  double axis1[3], axis4[3];
  double first_to[9], first_from[9], last_to[9];
  double whole[9];        ///< tip_at_zero.R^T last.from^T
  double bend2, bend6;    ///< [rad]
  double offset;          ///< of the wrist along axis 4 [m]
  double l2, l3;          ///< across axis 4 [m]
  double least, most;     ///< distances from shoulder to wrist [m]
  double places[8 * 12];  ///< of the joints at q = 0, then the tool: R, p
};
struct FollowBranch {
  double elbow, shoulder, wrist;  ///< signs
  double sine, cosine;            ///< of the arm angle
};

/// Of kMostAhead samples.
struct Followed {
  double q[7 * kMostAhead];     ///< sample after sample, any whole turn [rad]
  double clear[kMostAhead];     ///< the least of the sines that are 0 where branches meet
  double distance[kMostAhead];  ///< of the tip from the target [m]
  double square[kMostAhead];    ///< of the differences of their rotation matrices' elements
};

struct FollowKernel {
  /// `count` targets, 12 numbers each: base_T_tip, R row-major, then p. Where `clear` is near 0 or
  /// negative the angles are not to be used.
  void (*follow)(const FollowArm&, const FollowBranch&, const double* targets, std::size_t count,
                 Followed& out);
};

namespace baseline {
const FollowKernel& follow_kernel();
}
namespace avx2 {
const FollowKernel& follow_kernel();
}
namespace avx512 {
const FollowKernel& follow_kernel();
}

}  // namespace robomosp::ik_srs
