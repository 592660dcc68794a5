// SPDX-License-Identifier: Apache-2.0
// How the tip 0 of a mechanism moves: pose, Jacobian and the acceleration that velocities alone
// give, all in the base frame about the tip (layer: plugin). Allocates nothing.
#pragma once

#include <array>
#include <span>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::control {

struct TipMotion {
  Pose pose;
  std::array<double, 6> velocity{};  ///< J qd
  std::array<double, 6> bias{};      ///< Jd qd
};

/// Doubles of scratch.
[[nodiscard]] std::size_t tip_motion_scratch(const RobotModel& model);
/// `jacobian`: 6 numbers (v, w) for each entry of qd.
[[nodiscard]] TipMotion tip_motion(const RobotModel& model, std::span<const double> q,
                                   std::span<const double> qd, std::span<double> jacobian,
                                   std::span<double> scratch);

}  // namespace robomosp::control
