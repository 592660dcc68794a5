// SPDX-License-Identifier: Apache-2.0
// Programs checked by a run before they are posted (layer: application, ioci only).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include <robomosp/sdk/language.h>

#include "ioci/core/commands.h"
#include "model/world.h"
#include "program_check/check.h"
#include "task/program_actor.h"

namespace robomosp::ioci {

struct CheckedProgram {
  program_check::Check check;
  program_check::Options options;
  std::shared_ptr<const CompiledProgram> code;
  /// The records used by the run: those of the command, or with a world made for the check.
  std::shared_ptr<const document::Snapshot> snapshot;
  WorldId world;
  std::string name;  ///< of the program in its world
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
/// Runs the program `id` of the arguments in its world, or alone with `robot`. The document is not
/// changed. `instead` runs in its place, with separate signals for those it does not bind.
Result<CheckedProgram> check_program(CommandContext&, const Map& args,
                                     const InItsPlace* instead = nullptr);
/// The arguments that check_program() reads besides `id`.
[[nodiscard]] Schema check_params();
/// A fault as program.check_run returns it, without its member `fault`.
[[nodiscard]] Map fault_row(const CheckedProgram&, const program_check::Fault&);
/// Label of a place in a picture: `line 7`, `lines 7, 12 and 18`, or for more than five `lines 7,
/// 9, 12, 18 and 3 more`.
[[nodiscard]] std::string lines_text(const std::set<std::uint32_t>& lines);
/// At most about so many bytes, cut between words, with how many were left out.
[[nodiscard]] std::string shortened(std::string_view, std::size_t most);

}  // namespace robomosp::ioci
