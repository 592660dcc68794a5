// SPDX-License-Identifier: Apache-2.0
// A robot's axes as its maker counts them, from the record (layer: data processing, robotics).
// Values are in degrees and mm, joints in rad and m. [any thread]
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/result.h>

#include "model/records.h"

namespace robomosp::robotics {

/// Owns what its axes refer to; moved, they stay valid.
class MakerAxes {
 public:
  MakerAxes() = default;
  MakerAxes(MakerAxes&&) = default;
  MakerAxes& operator=(MakerAxes&&) = default;
  MakerAxes(const MakerAxes&) = delete;
  MakerAxes& operator=(const MakerAxes&) = delete;

  /// Empty for a robot without axes. An error where some joint has none, or where axes depend on
  /// each other: joints could not be computed from them.
  [[nodiscard]] static Result<MakerAxes> of(const model::Robot& robot);

  /// The same for messages, never null: without axes where there is no robot, or of() fails.
  [[nodiscard]] static std::shared_ptr<const MakerAxes> for_messages(const model::Robot* robot);

  /// False if the robot's axes are not known.
  [[nodiscard]] bool known() const { return !axes_.empty(); }
  /// In the controller's order, with their limits: those of the record, else those of the joint.
  [[nodiscard]] std::span<const PostAxis> axes() const { return axes_; }
  /// The axis of which entry `entry` of q is the joint; null = none, or the axes are not known.
  [[nodiscard]] const PostAxis* of_entry(std::size_t entry) const;
  /// "axis A2, " where entry `entry` of q has an axis, else nothing: what messages put before their
  /// words for a joint.
  [[nodiscard]] std::string before_joint(std::size_t entry) const;
  /// "axis A2 at 70 deg (-180 to 65 deg), " at q [rad or m], or nothing: the value of the axis and
  /// its range. The range of an axis that counts several joints depends on the others: "axis J3 at
  /// 70 deg (-80 to 60 deg while J2 is at 20 deg), "; one that the robot's record gives the axis,
  /// and that the value exceeds, comes first. Without limits there is no range.
  [[nodiscard]] std::string before_place(std::size_t entry, std::span<const double> q) const;
  /// Axes in a text that speaks of joints of `model`, such as the reason of a solver, which knows
  /// no axes: each "joint 3", "joint 3 (elbow)" or "joint \"elbow\"" gets its axis before it,
  /// unless the text has it already. Of a joint that "would need" a value, an axis that counts this
  /// joint alone gets value and range, too. Numbers without a name are those of RobotModel::joints.
  [[nodiscard]] std::string in_text(const RobotModel& model, std::string_view text) const;
  /// The same for the message and the hint of an error.
  [[nodiscard]] Error in_error(const RobotModel& model, Error e) const;
  /// The axis of this name; null = none.
  [[nodiscard]] const PostAxis* find(std::string_view name) const;
  /// One value an axis [degrees or mm] at q: coordinate_count() numbers.
  [[nodiscard]] std::vector<double> values(std::span<const double> q) const;
  /// q at one value an axis [degrees or mm].
  [[nodiscard]] Result<std::vector<double>> joints(std::span<const double> values) const;

 private:
  /// "axis A2 at 70 deg (-180 to 65 deg), "; `q` is empty where only the axis's own joint is known.
  [[nodiscard]] std::string place(const PostAxis& a, double value, std::span<const double> q) const;

  std::vector<PostAxis> axes_;
  std::vector<std::string> names_;
  std::vector<std::vector<double>> coupled_;
  std::vector<std::pair<double, double>> joint_limits_;  ///< of each axis's joint [rad or m]
  std::size_t coordinates_ = 0;
};

}  // namespace robomosp::robotics
