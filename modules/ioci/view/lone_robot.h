// SPDX-License-Identifier: Apache-2.0
// Recordings of robots alone, shown as those of worlds are (layer: application). Internal to
// modules/ioci.
#pragma once

#include <optional>

#include "ioci/core/commands.h"

namespace robomosp::ioci {

/// A world with nothing in it but one robot, at its origin. It is on no list and is gone with this.
class LoneRobot {
 public:
  /// The robot stands there under the name that the recording knows it by.
  static Result<LoneRobot> make(CommandContext& ctx, RobotId robot, const recording::Recording& r);
  [[nodiscard]] const document::Snapshot& snapshot() const { return edit_.now(); }
  [[nodiscard]] WorldId world() const { return world_; }

 private:
  LoneRobot(document::Transaction edit, WorldId world) : edit_(std::move(edit)), world_(world) {}
  document::Transaction edit_;  ///< never committed
  WorldId world_;
};

/// The robot that a recording without a world is of: that of its name.
[[nodiscard]] std::optional<RobotId> robot_of(const document::Snapshot&,
                                              const recording::Recording& r);

}  // namespace robomosp::ioci
