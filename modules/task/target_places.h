// SPDX-License-Identifier: Apache-2.0
// The frame that targets of a program are in and the tool that moves to them, before any run
// (layer: application, task).
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/progress.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/robot_model.h>

#include "sim/simulate.h"
#include "task/program_actor.h"

namespace robomosp::task {

/// An additional joint of the program that is bound to a joint of the world.
struct AdditionalJoint {
  std::size_t number = 0;    ///< in the program, from 1
  std::string robot, joint;  ///< names
  std::int32_t rail = -1;  ///< entry of q of the program's robot, which it carries; -1 = another's
  bool is_rotary = true;
  double start = 0, lower = 0, upper = 0;  ///< [degrees or mm] as the joint counts
  std::string axis;                        ///< of the maker; empty = it has none
  CountedJoint maker;                      ///< how the maker's axis counts
};

/// As a run of the program begins: from its bindings, the robot's mounting and attached tools.
struct TargetPlaces {
  std::string robot;  ///< that moves, by its name in the world
  RobotId record;
  std::vector<double> start;     ///< joint values [rad or m]
  Pose base_T_frame;             ///< frame of targets, without FRAME of a motion
  Pose flange_T_tool;            ///< tool of motions without TOOL
  std::string frame, tool;       ///< names of the bindings; empty = base, the robot's tool
  bool frame_is_object = false;  ///< the frame is of an object, which may move during a run
  std::size_t rail = 0;          ///< first joints of the robot that are additional ones
  std::vector<AdditionalJoint> additional;  ///< by number
  /// The robot that holds the frame's object and that the program moves; empty = none does.
  std::string frame_carrier;
};

/// Of the robot that the ROBOT `symbol` of the program means ("" = its own robot). Errors: bindings
/// to members that the world does not have, a tool that the robot does not hold at the start, a
/// tool on another joint than the flange. [any thread]
[[nodiscard]] Result<TargetPlaces> target_places(const sim::Simulator&, WorldId,
                                                 const ProgramInWorld&, std::string_view symbol,
                                                 Progress&);

}  // namespace robomosp::task
