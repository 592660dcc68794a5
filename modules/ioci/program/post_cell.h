// SPDX-License-Identifier: Apache-2.0
// Data for a post from a program's world: the robot, the frame of targets, the tool (layer:
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
  std::shared_ptr<const RobotModel> robot;  ///< its tip is the flange; null = unknown
  std::string robot_name;                   ///< of its record
  robotics::MakerAxes maker;                ///< its axes; empty if unknown
  model::ProviderChoice ik;
  std::vector<double> start;  ///< joint values at the start [rad or m]
  /// As in the run; empty = the base, the flange.
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

/// How the controller of a target treats a rail: set by the option `rail` of the profile (base or
/// carriage), or by the target's tag.
[[nodiscard]] Result<program_post::RailKind> rail_kind(const ProviderInfo& target,
                                                       const PostCapabilities&, const PostProfile&);
/// Adds the external axes of a cell's additional joints to a profile that lacks them.
void carry_axes(ControllerProfile&, const PostCell&);

/// The cell of the world that contains the program of `args` (`world` and `name_there` select one),
/// or of `robot` alone without a world. `symbol`: the ROBOT of the program to post, "" = its
/// default. Errors: a world or robot that is not the program's, differing places, bindings without
/// a meaning.
Result<PostCell> post_cell(CommandContext&, const Map& args, std::shared_ptr<const CompiledProgram>,
                           std::string_view symbol);

}  // namespace robomosp::ioci
