// SPDX-License-Identifier: Apache-2.0
// Programs of records checked by a run, in their world or alone with a robot (layer: application,
// program_check).
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include <robomosp/sdk/language.h>

#include "model/world.h"
#include "program_check/check.h"
#include "program_source/place.h"
#include "program_source/workshop.h"
#include "task/program_actor.h"

namespace robomosp::program_check {

struct CheckedProgram {
  Check check;
  Options options;
  std::shared_ptr<const CompiledProgram> code;
  /// The records used by the run: those of the command, or with a world made for the check.
  std::shared_ptr<const document::Snapshot> snapshot;
  WorldId world;
  std::string name;  ///< of the program in its world
};

/// What to check, and how.
struct CheckTask {
  AnyId program;                      ///< exists
  program_source::PlaceWish place{};  ///< selects one of its places in worlds
  RobotId robot{};     ///< for a program that is in no world: runs it alone; number 0 = none
  AnyId profile{};     ///< a controller, for the limits of its axes and its speeds; number 0 = none
  bool alone = false;  ///< without the other programs and tasks of its world
  bool frees_unbound = false;  ///< signals without a binding belong to the program
  bool contacts = true, torques = true;
  double clearance = 0.005;                     ///< as Options::clearance [m]
  double condition = 100;                       ///< as Options::condition
  double sample_time = 0.02, most_time = 3600;  ///< [s]
};

/// A replacement for a program in a run.
struct InItsPlace {
  std::shared_ptr<const CompiledProgram> code;
  /// Makes the bindings of the place those of this program; its name stays.
  std::function<void(model::PlacedProgram&, const model::World&)> bind;
  bool moves_flange = true;  ///< for motions without TOOL; else they move the robot's tool
  /// Signs and offsets of additional joints, and whether poses are measured from the carriage of a
  /// rail.
  std::map<std::size_t, task::CountedJoint> counted = {};
  bool is_on_carriage = false;
};
/// Runs the program in its world, or alone with a robot. The document is not changed. `instead`
/// runs in its place, with separate signals for those it does not bind. Errors: a program without a
/// world and robot, an ambiguous place, those of check().
[[nodiscard]] Result<CheckedProgram> check_program(const program_source::Workshop&,
                                                   const CheckTask&,
                                                   const InItsPlace* instead = nullptr);

}  // namespace robomosp::program_check
