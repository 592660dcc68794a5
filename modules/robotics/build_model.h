// SPDX-License-Identifier: Apache-2.0
// From a robot record and the masses of its designed bodies to the RobotModel that solvers read
// (layer: data processing, robotics). Denavit-Hartenberg conventions end here. [any thread]
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "model/records.h"

namespace robomosp::robotics {

/// Where a link of the record stands in the model: fixed to a joint's frame (-1 = base).
struct LinkFrame {
  std::int32_t joint = -1;
  Pose joint_T_link;
};

/// Builds the model. `link_masses` holds one entry a link, in the link's frame, nullopt where
/// nothing is designed; it may be empty. `gravity_in_mounting_frame` is in m/s^2. Fixed links
/// are folded into the joint that carries them, payloads added to the body that carries them.
/// Universal, cylindrical and planar joints become sequences of joints of one coordinate without
/// bodies between. Tip 0 is the tool on the last link; every other leaf link is a further tip at
/// its own frame, then follow the robot's further tools. Faults name robot and link. `progress`, if
/// any, is asked every few links whether to stop: ErrorCode::cancelled.
[[nodiscard]] Result<RobotModel> build_robot_model(
    const std::string& name, const model::Robot& robot,
    std::span<const std::optional<MassProperties>> link_masses, Vec3 gravity_in_mounting_frame,
    const Progress* progress = nullptr);

/// One entry a link of a robot that build_robot_model accepts.
[[nodiscard]] std::vector<LinkFrame> link_frames(const model::Robot& robot);

/// The link that each joint belongs to: indices into robot.links in the order of
/// RobotModel::joints; a link whose joint is a sequence stands there as often as it has joints.
[[nodiscard]] std::vector<std::int32_t> moving_links(const model::Robot& robot);

/// The pose of link's row for its variable at 0 up to the joint, and from the joint to the link:
/// parent-link_T_joint and joint_T_link.
struct RowPoses {
  Pose parent_T_joint;
  Pose joint_T_link;
};
[[nodiscard]] RowPoses row_poses(model::Convention convention, const model::DhRow& row);
/// The same of a link as the record gives it: by its row in its convention, or by origin and axis.
/// The joint's frame has the joint's axis as z; the joint moves between the two poses.
[[nodiscard]] RowPoses link_joint_poses(const model::Robot& robot, std::size_t link);

}  // namespace robomosp::robotics
