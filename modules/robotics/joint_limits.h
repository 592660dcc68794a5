// SPDX-License-Identifier: Apache-2.0
// Distances of configurations from their joint limits, modulo whole turns (layer: data processing,
// robotics). [any thread]
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// The same mechanism without position limits.
[[nodiscard]] RobotModel without_limits(const RobotModel& model);

/// Initial configuration of solvers without a seed: the middle of the limits, 0 without limits, the
/// identity for quaternions.
[[nodiscard]] std::vector<double> start_configuration(const RobotModel& model);

/// The joint that exceeds a limit by the most.
struct LimitExcess {
  std::int32_t joint = -1;  ///< index into RobotModel::joints; -1 = all are within their limits
  double by = 0;            ///< [rad or m]
  double value = 0;         ///< position of the joint [rad or m]
  double limit = 0;         ///< the exceeded limit
};

/// Joints of one coordinate only, including followers; up to `slack` [rad or m] beyond counts as
/// within.
[[nodiscard]] LimitExcess limit_excess(const RobotModel& model, std::span<const double> q,
                                       double slack = 1e-9);

/// Adds whole turns to the revolute joints without followers: within the limits, as near as
/// possible to `near` (a configuration, or empty); else where the excess is least.
void turn_into_limits(const RobotModel& model, std::span<double> q, std::span<const double> near);

/// `joint 3 ("elbow") at 72.3 deg, 12.3 deg beyond its limit`
[[nodiscard]] std::string excess_words(const RobotModel& model, const LimitExcess& excess);

}  // namespace robomosp::robotics
