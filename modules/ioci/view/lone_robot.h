// SPDX-License-Identifier: Apache-2.0
// Shows recordings of single robots in the same form as those of worlds (layer: application).
// Internal to modules/ioci.
#pragma once

#include <optional>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// A temporary world with one robot at its origin. It is never listed and ends with this object.
class LoneRobot {
 public:
  /// The robot is named as in the recording.
  static Result<LoneRobot> make(CommandContext& ctx, RobotId robot, const recording::Recording& r);
  [[nodiscard]] const document::Snapshot& snapshot() const { return edit_.now(); }
  [[nodiscard]] WorldId world() const { return world_; }

 private:
  LoneRobot(document::Transaction edit, WorldId world) : edit_(std::move(edit)), world_(world) {}
  document::Transaction edit_;  ///< never committed
  WorldId world_;
};

/// The robot of a recording without a world, by its name.
[[nodiscard]] std::optional<RobotId> robot_of(const document::Snapshot&,
                                              const recording::Recording& r);

}  // namespace robomosp::ioci
