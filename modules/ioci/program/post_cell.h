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
#include "ioci/program/post_profile.h"
#include "kernel/registry.h"
#include "model/robot.h"
#include "program_post/carriage.h"
#include "program_post/cell.h"
#include "program_post/points.h"
#include "robotics/maker_axes.h"
#include "robotics/rail.h"
#include "task/program_actor.h"

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
  /// Additional joints that are joints of the world; with a rail `robot` is the arm behind it.
  std::optional<program_post::Carrier> carrier;
  std::vector<std::string> axis_names;  ///< by carrier axis: of the maker, empty = it has none
  std::vector<task::CountedJoint> axis_counts;  ///< by carrier axis: how the maker's counts
  std::vector<robotics::RailJoint> rail;        ///< joints of the chain before the arm
  [[nodiscard]] bool is_on_rail() const { return carrier && carrier->rail > 0; }
  std::vector<PostedFault> remarks;
};

/// What the controller of a target does with a rail: as the option `rail` of the profile says (base
/// or carriage), or by the target's tag.
[[nodiscard]] Result<program_post::RailKind> rail_kind(const ProviderInfo& target,
                                                       const PostCapabilities&, const PostProfile&);
/// Gives a profile the external axes of a cell's additional joints, where it has none.
void carry_axes(ControllerProfile&, const PostCell&);

/// Of the world that the program of `args` is in (`world` and `name_there` choose one), or without
/// one of `robot` alone. `symbol`: the ROBOT of the program whose post it is, "" = its own. Errors:
/// a world or robot that is not the program's, places that differ, bindings without a meaning.
Result<PostCell> post_cell(CommandContext&, const Map& args, std::shared_ptr<const CompiledProgram>,
                           std::string_view symbol);

}  // namespace robomosp::ioci
