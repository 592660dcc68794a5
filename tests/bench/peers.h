// SPDX-License-Identifier: Apache-2.0
// Libraries that engine_peers measures beside this project: each gives the same kernels for the
// same model.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::bench {

/// One state; qdd and tau are the same numbers.
struct State {
  std::span<const double> q, qd, u;
};
/// Computes one state and returns the result, which is valid until the next call: poses as R
/// row-major and p, Jacobians row by row (6 * n; linear above angular), matrices row by row.
using Kernel = std::function<std::span<const double>(const State&)>;

/// "forward kinematics", "Jacobian", "inverse dynamics", "inertia", "forward dynamics"; a library
/// may lack some. For serial robots of revolute joints; motors and friction are not looked at.
using Peer = std::map<std::string, Kernel>;

Peer kdl(const RobotModel& model);
Peer dart(const RobotModel& model);

}  // namespace robomosp::bench
