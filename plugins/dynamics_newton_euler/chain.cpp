// SPDX-License-Identifier: Apache-2.0
#include "chain.h"

#include "spatial/mass.h"
#include "spatial/pose.h"

namespace robomosp::newton_euler {

Result<Chain> make_chain(const RobotModel& model) {
  const std::string where = "robot \"" + model.name + "\"";
  if (model.joints.empty())
    return error(ErrorCode::invalid_argument, "it has no joints", "Give it at least one joint.",
                 where);
  if (!model.is_simple() || !model.loops.empty())
    return error(ErrorCode::unsupported,
                 "it has coupled, spherical or free joints or closed loops, which this provider "
                 "does not know",
                 "Choose another provider.", where);
  Chain chain;
  chain.gravity = model.gravity;
  chain.is_serial = model.is_serial();
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const JointModel& m = model.joints[i];
    const std::string joint = where + ", joint \"" + m.name + "\"";
    if (m.parent < -1 || m.parent >= static_cast<std::int32_t>(i))
      return error(ErrorCode::invalid_argument, "its parent does not come before it",
                   "Order the joints so that parents come first.", joint);
    if (!spatial::is_finite(m.body) || !spatial::is_rigid(m.placement))
      return error(ErrorCode::invalid_argument, "its placement or mass properties are not finite",
                   "Correct the robot's rows and masses.", joint);
    ChainJoint c;
    c.R = m.placement.R;
    c.p = m.placement.p;
    c.mass = m.body.mass;
    c.first = spatial::scale(m.body.com, m.body.mass);
    c.inertia = spatial::inertia_about(m.body, Vec3{});
    c.armature = m.armature;
    c.friction = m.friction;
    c.parent = m.parent;
    c.is_prismatic = m.type == JointType::prismatic;
    chain.joints.push_back(c);
  }
  if (!model.tips.empty()) {
    if (model.tips[0].joint >= static_cast<std::int32_t>(model.joints.size()))
      return error(ErrorCode::invalid_argument, "its first tip is on a joint that does not exist",
                   "Correct the tip.", where);
    chain.tip_joint = model.tips[0].joint;
    chain.tip = model.tips[0].tool.p;
  }
  return chain;
}

Result<void> check_batch(const Chain& chain, const DynamicsBatch& b, std::size_t required_scratch,
                         std::size_t output, std::size_t output_per_sample) {
  const std::size_t want = b.count * chain.dof();
  const auto wrong = [&](const char* what, std::size_t is, std::size_t should) {
    return error(ErrorCode::invalid_argument,
                 std::string(what) + " has " + std::to_string(is) + " values for " +
                     std::to_string(b.count) + " samples of " + std::to_string(chain.dof()) +
                     " joints",
                 "Give " + std::to_string(should) + ".");
  };
  if (b.q.size() != want) return wrong("q", b.q.size(), want);
  if (!b.qd.empty() && b.qd.size() != want) return wrong("qd", b.qd.size(), want);
  if (!b.qdd.empty() && b.qdd.size() != want) return wrong("qdd", b.qdd.size(), want);
  if (!b.tau.empty() && b.tau.size() != want) return wrong("tau", b.tau.size(), want);
  if (b.tip.size() > 1 && b.tip.size() != b.count)
    return wrong("the tip wrench", b.tip.size(), b.count);
  if (output != b.count * output_per_sample)
    return wrong("the output", output, b.count * output_per_sample);
  if (b.scratch.size() < required_scratch)
    return wrong("scratch", b.scratch.size(), required_scratch);
  return {};
}

}  // namespace robomosp::newton_euler
