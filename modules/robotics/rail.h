// SPDX-License-Identifier: Apache-2.0
// An arm behind the first joints of its chain, which carry it: a rail, a column, a gantry (layer:
// data processing, robotics). [any thread]
#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include <robomosp/sdk/post_axes.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

namespace robomosp::robotics {

/// base_T_carriage: the frame that the arm is mounted on, at the first `rail` entries of `q`
/// [rad or m]. The chain is serial and of single joints.
[[nodiscard]] Pose base_T_carriage(const RobotModel& chain, std::size_t rail,
                                   std::span<const double> q);

/// The joints behind the first `rail` ones as a robot with the carriage as its base. Tips on the
/// arm stay; those on the rail are left out.
[[nodiscard]] std::shared_ptr<RobotModel> arm_behind_rail(const RobotModel& chain,
                                                          std::size_t rail);

/// A joint that carries an arm.
struct RailJoint {
  std::size_t number = 1;  ///< of the additional joint that it is, from 1
  bool is_rotary = false;
};
/// Makes the maker's axes of a chain those of the arm behind its first rail.size() joints: the axes
/// of these are external ones of the additional joints, and count degrees or mm of them. An error
/// where an axis counts joints of both.
[[nodiscard]] Result<void> axes_behind_rail(std::span<PostAxis> axes,
                                            std::span<const RailJoint> rail);

}  // namespace robomosp::robotics
