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
inline constexpr std::uint32_t kWristFlipped = 4;    ///< the hand is bent up where joint 4 is 0

/// Of an arm of six turning joints, axes 2 and 3 parallel and across axis 1, the last three through
/// one point (the wrist): kShoulderBehind, kElbowBelow and kWristFlipped at q [rad]. In front is
/// the side of axis 1 on which axis 2 lies, else where the base's x axis points at joint 1 = 0. The
/// wrist is not flipped where axis 5 turns the hand in the sense in which axis 2 lowers the arm in
/// front, both seen at joint 4 = 0: A5 and rax_5 > 0 of KUKA and ABB, J5 < 0 of FANUC. Nothing = it
/// is another kind of arm, or axis 5 lies across axis 2 at joint 4 = 0.
[[nodiscard]] std::optional<std::uint32_t> arm_status(const RobotModel& robot,
                                                      std::span<const double> q);

}  // namespace robomosp::robotics
