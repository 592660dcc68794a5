// SPDX-License-Identifier: Apache-2.0
// A robot's axes as its maker counts them, from the record (layer: data processing, robotics).
// Values are in degrees and mm, joints in rad and m. [any thread]
#pragma once

#include <span>
#include <string>
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

  /// False if the robot's axes are not known.
  [[nodiscard]] bool known() const { return !axes_.empty(); }
  /// In the controller's order, with their limits: those of the record, else those of the joint.
  [[nodiscard]] std::span<const PostAxis> axes() const { return axes_; }
  /// The axis of which entry `entry` of q is the joint; null = none, or the axes are not known.
  [[nodiscard]] const PostAxis* of_entry(std::size_t entry) const;
  /// "axis A2, " where entry `entry` of q has an axis, else nothing: what messages put before their
  /// words for a joint.
  [[nodiscard]] std::string before_joint(std::size_t entry) const;
  /// "axis A2 at -45 deg, " at q, or nothing. A joint's limit is told where the axis counts it
  /// alone: "axis A2 at 70 deg (-180 to 65 deg), ".
  [[nodiscard]] std::string before_place(std::size_t entry, std::span<const double> q) const;
  /// One value an axis [degrees or mm] at q: coordinate_count() numbers.
  [[nodiscard]] std::vector<double> values(std::span<const double> q) const;
  /// q at one value an axis [degrees or mm].
  [[nodiscard]] Result<std::vector<double>> joints(std::span<const double> values) const;

 private:
  std::vector<PostAxis> axes_;
  std::vector<std::string> names_;
  std::vector<std::vector<double>> coupled_;
  std::size_t coordinates_ = 0;
};

}  // namespace robomosp::robotics
