// SPDX-License-Identifier: Apache-2.0
#include "scene/tool_ellipsoids.h"

#include "robotics/kinematics.h"
#include "robotics/singularity.h"
#include "robotics/tip_motion.h"
#include "scene/ids.h"
#include "spatial/pose.h"

namespace robomosp::scene {

std::vector<render::Item> tool_ellipsoids(const std::string& owner, const RobotModel& model,
                                          const Pose& world_T_base,
                                          std::span<const Pose> joint_frames,
                                          const ShownEllipsoids& shown) {
  std::vector<render::Item> out;
  if (model.dof() == 0 || model.tips.empty() || !(shown.velocity || shown.force)) return out;
  const auto motion = robotics::tip_motion(model, 0, joint_frames);
  const auto e = robotics::ellipsoid(motion.jacobian, robotics::TwistPart::translation,
                                     motion.self_motion_twists);
  Pose axes;
  axes.R = e.axes;
  Pose at = spatial::compose(world_T_base, axes);
  at.p = spatial::transform(world_T_base, robotics::tip_pose(model, 0, joint_frames).p);
  const double size = 0.2 * robotics::reach(model, 0);
  const auto add = [&](std::size_t number, const char* name, const Vec3& half, const Colour& c) {
    out.push_back(ellipsoid_item(item_id(owner, kEllipsoidBody, number), owner + " " + name, at,
                                 drawn_lengths(half, size), c));
  };
  if (shown.velocity) add(0, "velocity ellipsoid", e.velocity, {0.15F, 0.45F, 0.9F, 0.45F});
  if (shown.force) add(1, "force ellipsoid", e.force, {0.95F, 0.5F, 0.1F, 0.45F});
  return out;
}

}  // namespace robomosp::scene
