// SPDX-License-Identifier: Apache-2.0
#include "chain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spatial/pose.h"

namespace robomosp::ik_numeric {

Chain make_chain(const RobotModel& model, std::size_t tip) {
  Chain chain;
  chain.tool = model.tips[tip].tool;
  chain.length = spatial::norm(chain.tool.p);
  for (std::int32_t j = model.tips[tip].joint; j >= 0;
       j = model.joints[static_cast<std::size_t>(j)].parent) {
    const JointModel& m = model.joints[static_cast<std::size_t>(j)];
    chain.joints.push_back({m.placement, m.lower, m.upper, 1, static_cast<std::size_t>(j), m.type});
  }
  std::reverse(chain.joints.begin(), chain.joints.end());
  for (std::size_t i = 1; i < chain.size(); ++i)
    chain.length += spatial::norm(chain.joints[i].placement.p);
  for (const PathJoint& joint : chain.joints)
    if (joint.type == JointType::prismatic) {
      chain.slide += std::max(std::fabs(joint.lower), std::fabs(joint.upper));
      const double range = joint.upper - joint.lower;
      if (std::isfinite(range)) chain.length += 0.5 * range;
    }
  if (!(chain.length > 1e-9)) chain.length = 1;
  for (PathJoint& joint : chain.joints)
    if (joint.type == JointType::prismatic) joint.unit = chain.length;
  return chain;
}

Pose forward(const Chain& chain, std::span<const double> q, std::span<Pose> frames) {
  for (std::size_t i = 0; i < chain.size(); ++i) {
    const PathJoint& joint = chain.joints[i];
    const Pose local = spatial::joint_pose(joint.placement, joint.type, q[i]);
    frames[i] = i == 0 ? local : spatial::compose(frames[i - 1], local);
  }
  return chain.size() == 0 ? chain.tool : spatial::compose(frames[chain.size() - 1], chain.tool);
}

double start_bound(const PathJoint& joint, bool upper) {
  const double limit = upper ? joint.upper : joint.lower;
  if (std::isfinite(limit)) return limit;
  const double half = joint.type == JointType::revolute ? std::numbers::pi : joint.unit;
  const double other = upper ? joint.lower : joint.upper;
  const double centre = std::isfinite(other) ? other + (upper ? half : -half) : 0.0;
  return centre + (upper ? half : -half);
}

double certain_gap(const Chain& chain, const Vec3& target) {
  if (chain.size() == 0) return 0;
  double reach = spatial::norm(chain.tool.p) + chain.slide;
  for (std::size_t i = 1; i < chain.size(); ++i)
    reach += spatial::norm(chain.joints[i].placement.p);
  return std::max(0.0, spatial::distance(target, chain.joints[0].placement.p) - reach);
}

}  // namespace robomosp::ik_numeric
