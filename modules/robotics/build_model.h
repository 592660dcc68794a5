// SPDX-License-Identifier: Apache-2.0
// Builds the RobotModel for solvers from a robot record and the masses of its designed bodies
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

/// Location of a link of the record in the model: fixed to a joint's frame (-1 = base).
struct LinkFrame {
  std::int32_t joint = -1;
  Pose joint_T_link;
};

/// Builds the model. `link_masses` has one entry per link, in the link's frame, nullopt for links
/// without designed bodies; it may be empty. `gravity_in_mounting_frame` is in m/s^2. Fixed links
/// are merged into the joint that carries them, payloads into the body that carries them.
/// Universal, cylindrical and planar joints become sequences of joints of one coordinate without
/// bodies in between. Tip 0 is the tool on the last link; every other leaf link is a further tip at
/// its frame, followed by the robot's further tools. Faults name robot and link. `progress`, if
/// any, is polled every few links: ErrorCode::cancelled.
[[nodiscard]] Result<RobotModel> build_robot_model(
    const std::string& name, const model::Robot& robot,
    std::span<const std::optional<MassProperties>> link_masses, Vec3 gravity_in_mounting_frame,
    const Progress* progress = nullptr);

/// One entry per link of a robot that build_robot_model accepts.
[[nodiscard]] std::vector<LinkFrame> link_frames(const model::Robot& robot);

/// The link of each joint: indices into robot.links in the order of RobotModel::joints; a link with
/// a joint that is a sequence appears once per joint of the sequence.
[[nodiscard]] std::vector<std::int32_t> moving_links(const model::Robot& robot);

/// The pose of a link's row, at variable 0, up to the joint, and from the joint to the link:
/// parent-link_T_joint and joint_T_link.
struct RowPoses {
  Pose parent_T_joint;
  Pose joint_T_link;
};
[[nodiscard]] RowPoses row_poses(model::Convention convention, const model::DhRow& row);
/// The same for a link of the record: by its row in its convention, or by origin and axis. The z
/// axis of the joint's frame is the joint's axis; the joint moves between the two poses.
[[nodiscard]] RowPoses link_joint_poses(const model::Robot& robot, std::size_t link);

}  // namespace robomosp::robotics
