// SPDX-License-Identifier: Apache-2.0
// How far configurations are beyond the limits of their joints, whole turns counted as none
// (layer: data processing, robotics). [any thread]
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// The same mechanism without limits of position.
[[nodiscard]] RobotModel without_limits(const RobotModel& model);

/// Where solvers without a seed begin: the middle of the limits, 0 where there are none, no turn.
[[nodiscard]] std::vector<double> start_configuration(const RobotModel& model);

/// The joint that is farthest beyond a limit of its own.
struct LimitExcess {
  std::int32_t joint = -1;  ///< index into RobotModel::joints; -1 = all are within their limits
  double by = 0;            ///< [rad or m]
  double value = 0;         ///< where the joint is [rad or m]
  double limit = 0;         ///< the limit that it is beyond
};

/// Joints of one coordinate only, followers among them; `slack` [rad or m] beyond counts as within.
[[nodiscard]] LimitExcess limit_excess(const RobotModel& model, std::span<const double> q,
                                       double slack = 1e-9);

/// Adds whole turns to the revolute joints that nothing follows: within the limits, as near to
/// `near` (a configuration, or empty) as can be; else to where the excess is least.
void turn_into_limits(const RobotModel& model, std::span<double> q, std::span<const double> near);

/// `joint 3 ("elbow") at 72.3 deg, 12.3 deg beyond its limit`
[[nodiscard]] std::string excess_words(const RobotModel& model, const LimitExcess& excess);

}  // namespace robomosp::robotics
