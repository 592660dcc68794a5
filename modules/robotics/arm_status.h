// SPDX-License-Identifier: Apache-2.0
// The configuration of an arm as it is seen, whatever its axes count from (layer: data processing,
// robotics). [any thread]
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

inline constexpr std::uint32_t kShoulderBehind = 1;  ///< the wrist is behind axis 1
inline constexpr std::uint32_t kElbowBelow = 2;      ///< the elbow is below shoulder and wrist

/// Of an arm of six turning joints, axes 2 and 3 parallel and across axis 1, the last three through
/// one point (the wrist): kShoulderBehind and kElbowBelow at q [rad]. In front is the side on which
/// axis 2 stands beside axis 1, else where the base's x axis points at joint 1 = 0. Nothing = it is
/// another kind of arm.
[[nodiscard]] std::optional<std::uint32_t> arm_status(const RobotModel& robot,
                                                      std::span<const double> q);

}  // namespace robomosp::robotics
