// SPDX-License-Identifier: Apache-2.0
// What a program's world says of its post: the robot, the frame of targets, the tool (layer:
// application, ioci only).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/robot_model.h>

#include "ioci/core/command.h"
#include "ioci/program/post_output.h"
#include "model/robot.h"
#include "program_post/cell.h"
#include "robotics/maker_axes.h"

namespace robomosp::ioci {

struct PostCell {
  std::shared_ptr<const RobotModel> robot;  ///< its tip is the flange; null = none is known
  std::string robot_name;                   ///< of its record
  robotics::MakerAxes maker;                ///< its axes; none where they are not known
  model::ProviderChoice ik;
  std::vector<double> start;  ///< joint values at the start [rad or m]
  /// As the run has them; empty = the base, the flange.
  program_post::CellPlaces places;
  bool is_placed = false;  ///< they are those of a world
  std::vector<PostedFault> remarks;
};

/// Of the world that the program of `args` is in (`world` and `name_there` choose one), or without
/// one of `robot` alone. `symbol`: the ROBOT of the program whose post it is, "" = its own. Errors:
/// a world or robot that is not the program's, places that differ, bindings without a meaning.
Result<PostCell> post_cell(CommandContext&, const Map& args, std::shared_ptr<const CompiledProgram>,
                           std::string_view symbol);

}  // namespace robomosp::ioci
