// SPDX-License-Identifier: Apache-2.0
// Data for a post from a program's world: the robot, the frame of targets, the tool (layer:
// application, program_post).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/robot_model.h>

#include "kernel/registry.h"
#include "model/robot.h"
#include "program_post/carriage.h"
#include "program_post/cell.h"
#include "program_post/points.h"
#include "program_post/posted.h"
#include "program_source/place.h"
#include "program_source/workshop.h"
#include "robotics/controller_profile.h"
#include "robotics/maker_axes.h"
#include "robotics/rail.h"
#include "task/program_actor.h"

namespace robomosp::program_post {

struct PostCell {
  std::shared_ptr<const RobotModel> robot;  ///< its tip is the flange; null = unknown
  std::string robot_name;                   ///< of its record
  robotics::MakerAxes maker;                ///< its axes; empty if unknown
  model::ProviderChoice ik;
  std::vector<double> start;  ///< joint values at the start [rad or m]
  /// As in the run; empty = the base, the flange.
  CellPlaces places;
  bool is_placed = false;  ///< they are those of a world
  /// Additional joints that are joints of the world; with a rail `robot` is the arm behind it.
  std::optional<Carrier> carrier;
  std::vector<std::string> axis_names;  ///< by carrier axis: of the maker, empty = it has none
  std::vector<task::CountedJoint> axis_counts;  ///< by carrier axis: how the maker's counts
  std::vector<robotics::RailJoint> rail;        ///< joints of the chain before the arm
  [[nodiscard]] bool is_on_rail() const { return carrier && carrier->rail > 0; }
  std::vector<PostedFault> remarks;
};

/// How the controller of a target treats a rail: set by the option `rail` of the profile (base or
/// carriage), or by the target's tag.
[[nodiscard]] Result<RailKind> rail_kind(const ProviderInfo& target, const PostCapabilities&,
                                         const PostProfile&);
/// Adds the external axes of a cell's additional joints to a profile that lacks them.
void carry_axes(robotics::ControllerProfile&, const PostCell&);

/// Selects the cell of a program.
struct CellWish {
  AnyId program;                      ///< exists
  program_source::PlaceWish place{};  ///< selects a world that contains it
  RobotId robot{};  ///< of its world, or alone without a world; number 0 = none is given
};
/// The cell of the world that contains the program, or of the robot alone without a world.
/// `symbol`: the ROBOT of the program to post, "" = its default. Errors: a world or robot that is
/// not the program's, differing places, bindings without a meaning.
[[nodiscard]] Result<PostCell> post_cell(const program_source::Workshop&, const CellWish&,
                                         std::shared_ptr<const CompiledProgram>,
                                         std::string_view symbol);

}  // namespace robomosp::program_post
