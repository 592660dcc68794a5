// SPDX-License-Identifier: Apache-2.0
// Robots of a picture: what is drawn of them, and where it is for joint values (layer: application,
// scene). Internal to modules/scene.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "robotics/build_model.h"
#include "scene/build.h"
#include "scene/shape.h"

namespace robomosp::scene {

/// The parts of a robot that do not depend on its placement. Immutable.
struct RobotBase {
  document::RecordPtr kept;  ///< owns `record`
  const model::Robot* record = nullptr;
  std::shared_ptr<const RobotModel> model;
  evaluation::RobotBodies bodies;
  std::vector<robotics::LinkFrame> links;

  [[nodiscard]] bool shows(std::size_t body) const {
    return body == 0 || record->links[body - 1].visible;
  }
  [[nodiscard]] std::string body_name(std::size_t body) const {
    return body == 0 ? "base" : record->links[body - 1].name;
  }
  /// Length of the axes of its frames [m].
  [[nodiscard]] double frame_length() const;
};
using RobotBasePtr = std::shared_ptr<const RobotBase>;
[[nodiscard]] Result<RobotBasePtr> robot_base(const Source&, RobotId, Progress&);

/// A robot on a mounting. [one thread]
class PosedRobot {
 public:
  PosedRobot(RobotBasePtr base, const Pose& world_T_mounting);
  [[nodiscard]] const RobotBase& base() const { return *base_; }
  [[nodiscard]] const Pose& world_T_base() const { return world_T_base_; }
  /// world_T_body of the base, of every link and of the tool.
  void pose(std::span<const double> q, std::vector<Pose>& bodies);
  /// base_T_joint of every joint, as of the last call of pose().
  [[nodiscard]] std::span<const Pose> joint_frames() const { return joint_frames_; }
  /// Where something fixed to a joint is in the world, as of the last call of pose().
  [[nodiscard]] Pose place(const robotics::LinkFrame& at) const;
  /// Where an object that it holds is fixed to it.
  [[nodiscard]] Result<robotics::LinkFrame> grip_of(const model::Attachment&) const;

 private:
  RobotBasePtr base_;
  Pose world_T_base_;
  std::vector<Pose> joint_frames_;
};

/// Joint values to show: those given, else the pose "home", else zeros. What the given ones lack,
/// since the robot got links after it was placed, is neutral.
[[nodiscard]] std::vector<double> shown_q(const model::Robot&, const std::vector<double>& given);

/// Items of all bodies and the axes of the tool. Body 0 is the base, then come the links, the last
/// is the tool.
[[nodiscard]] ShapePtr robot_shape(const document::Snapshot&, const RobotBase&);
/// Frames of base and links with their names.
[[nodiscard]] ShapePtr robot_frames(const RobotBase&);
/// A label at each link with its Denavit-Hartenberg row, or with the axis of its joint.
[[nodiscard]] ShapePtr robot_rows(const RobotBase&, std::span<const double> q);
/// What depends on the joint values: ellipsoids, and the mark of the whole mass. In the world.
[[nodiscard]] ShapePtr robot_posed(const PosedRobot&, const std::string& owner, const Extras&);

}  // namespace robomosp::scene
