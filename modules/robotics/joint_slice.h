// SPDX-License-Identifier: Apache-2.0
// A cut through the joint space: two joints on a grid, the others fixed, with the measures of the
// Jacobian and the curves where it is singular (layer: data processing, robotics). [any thread]
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "robotics/workspace.h"

namespace robomosp::robotics {

/// One axis of a slice: a joint of one coordinate that follows no other.
struct SliceAxis {
  std::size_t joint = 0;
  double from = 0, to = 0;  ///< [rad or m]
  std::size_t count = 0;    ///< nodes, >= 2
  [[nodiscard]] double at(std::size_t i) const {
    return from + (to - from) * static_cast<double>(i) / static_cast<double>(count - 1);
  }
};

struct SliceOptions {
  std::size_t tip = 0;
  std::array<SliceAxis, 2> axes;
  TwistPart part = TwistPart::all;
  double length = 1;           ///< that linear velocities are divided by [m]
  ConfigurationFilter filter;  ///< what it drops is marked in `collides`; may be empty
  std::size_t threads = 0;     ///< 0 = all cores; the answer does not depend on it
};

/// Nodes with the first axis fastest.
struct JointSlice {
  int rank = 0;  ///< of the Jacobian's part over the joint space
  std::vector<JacobianMeasures> nodes;
  std::vector<std::uint8_t> collides;
  std::vector<std::uint8_t> singular;  ///< nodes next to a point of a singular curve
  /// Points of singular curves on the lines of the grid: values of the two joints. Between
  /// neighbours the least singular value is followed to its minimum; it counts as zero below 1e-6
  /// times the greatest.
  std::vector<std::array<double, 2>> curve;
};
[[nodiscard]] Result<JointSlice> joint_slice(const RobotModel& model, std::span<const double> q,
                                             const SliceOptions&, Progress&);

}  // namespace robomosp::robotics
