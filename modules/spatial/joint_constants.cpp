// SPDX-License-Identifier: Apache-2.0
#include "spatial/joint_constants.h"

#include <cmath>

#include "spatial/pose.h"

namespace robomosp::spatial {
namespace {

constexpr double kTwistRounding = 1e-15;

// Fits Rx(alpha) Rz(angle) to R; leaves c alone when it is something else.
void fit_twist(JointConstants& c) {
  const double* R = c.R;
  if (std::fabs(R[2]) > kTwistRounding) return;
  double cos_a = R[8], sin_a = -R[5];
  if (std::fabs(cos_a) <= kTwistRounding) cos_a = 0, sin_a = sin_a > 0 ? 1 : -1;
  if (std::fabs(sin_a) <= kTwistRounding) sin_a = 0, cos_a = cos_a > 0 ? 1 : -1;
  const double angle = std::atan2(-R[1], R[0]);
  const SinCos z = sin_cos(angle);
  const double fit[9] = {z.cos,         -z.sin,        0,    cos_a * z.sin, cos_a * z.cos, -sin_a,
                         sin_a * z.sin, sin_a * z.cos, cos_a};
  for (std::size_t i = 0; i < 9; ++i)
    if (!(std::fabs(fit[i] - R[i]) <= kTwistRounding)) return;
  c.cos_twist = cos_a, c.sin_twist = sin_a, c.angle = angle;
  if (sin_a == 0 && cos_a > 0) c.turn = Turn::none;
  else if (cos_a == 0) c.turn = sin_a > 0 ? Turn::quarter : Turn::minus_quarter;
  else c.turn = Turn::twist;
}

}  // namespace

JointConstants joint_constants(const JointModel& joint) {
  JointConstants c{};
  for (std::size_t i = 0; i < 9; ++i) c.R[i] = joint.placement.R[i];
  for (std::size_t i = 0; i < 3; ++i) c.p[i] = joint.placement.p[i];
  c.cos_twist = 1;
  c.ratio = joint.is_coupled() ? joint.coupling.ratio : 1;
  c.offset = joint.is_coupled() ? joint.coupling.offset : 0;
  c.parent = joint.parent;
  c.q_index = joint.q_index;
  c.v_index = joint.v_index;
  c.velocity_count = velocity_count(joint.type);
  c.type = joint.type;
  c.turn = Turn::general;
  if (c.velocity_count > 1) c.turn = Turn::ball;
  else fit_twist(c);
  return c;
}

}  // namespace robomosp::spatial
