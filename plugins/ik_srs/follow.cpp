// SPDX-License-Identifier: Apache-2.0
#include "follow.h"

#include <algorithm>
#include <cmath>

#include "spatial/instruction_set.h"
#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::ik_srs {
namespace {

const FollowKernel& kernel() {
  const spatial::InstructionSet set = spatial::widest_instruction_set();
#if defined(RMP_HAS_AVX512)
  if (set == spatial::InstructionSet::avx512) return avx512::follow_kernel();
#endif
#if defined(__x86_64__)
  if (set == spatial::InstructionSet::avx2) return avx2::follow_kernel();
#endif
  (void)set;
  return baseline::follow_kernel();
}

template <class From>
void put(const From& from, double* to) {
  std::copy(from.begin(), from.end(), to);
}

}  // namespace

FollowArm follow_arm(const SrsArm& arm) {
  FollowArm f{};
  put(arm.shoulder, f.shoulder), put(arm.tip_wrist, f.tip_wrist);
  put(arm.upper, f.upper), put(arm.fore, f.fore);
  put(arm.arm.joints[0].axis, f.axis1), put(arm.arm.joints[3].axis, f.axis4);
  put(arm.first.to, f.first_to), put(arm.first.from, f.first_from), put(arm.last.to, f.last_to);
  Pose zero, from;
  zero.R = arm.arm.tip_at_zero.R, from.R = arm.last.from;
  put(spatial::compose(spatial::inverse(zero), spatial::inverse(from)).R, f.whole);
  f.bend2 = arm.first.bend, f.bend6 = arm.last.bend;
  f.offset = arm.offset, f.l2 = arm.upper_across, f.l3 = arm.fore_across;
  f.least = arm.least, f.most = arm.most;
  for (std::size_t j = 0; j <= 7; ++j) {
    const Pose& place = j < 7 ? arm.arm.joints[j].placement : arm.arm.tool;
    put(place.R, f.places + 12 * j);
    put(place.p, f.places + 12 * j + 9);
  }
  return f;
}

FollowBranch follow_branch(const SrsArm& arm, const Angles& q) {
  const Vec3 h = arm.arm.joints[3].axis;
  const Vec3 fore = spatial::sub(arm.fore, spatial::scale(h, arm.offset));
  const double a = spatial::dot(arm.upper, fore),
               b = spatial::dot(arm.upper, spatial::cross(h, fore));
  const auto sign = [](double x) { return x < 0 ? -1.0 : 1.0; };
  const double angle = arm_angle(arm, q);
  return {sign(a * std::sin(q[3]) - b * std::cos(q[3])), sign(std::sin(q[1] + arm.first.bend)),
          sign(std::sin(q[5] + arm.last.bend)), std::sin(angle), std::cos(angle)};
}

void follow(const FollowArm& arm, const FollowBranch& branch, std::span<const Pose> targets,
            Followed& out) {
  static_assert(sizeof(Pose) == 12 * sizeof(double));
  kernel().follow(arm, branch, targets.front().R.data(), targets.size(), out);
}

}  // namespace robomosp::ik_srs
