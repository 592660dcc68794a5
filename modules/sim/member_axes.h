// SPDX-License-Identifier: Apache-2.0
// The maker's axes of the robots of a world, for messages (layer: application, sim). [any thread]
#pragma once

#include <string>
#include <utility>

#include "document/document.h"
#include "recording/recording.h"
#include "robotics/maker_axes.h"

namespace robomosp::sim {

/// Of the robot that the world calls `robot`; none where there is no such robot, or where its axes
/// are not known.
[[nodiscard]] inline robotics::MakerAxes member_axes(const document::Snapshot& now, WorldId world,
                                                     const std::string& robot) {
  if (const model::World* w = now.get(world))
    for (const model::PlacedRobot& r : w->robots)
      if (const model::Robot* record = r.name == robot ? now.get(r.robot) : nullptr)
        if (auto axes = robotics::MakerAxes::of(*record); axes.ok()) return std::move(*axes);
  return {};
}

/// Puts the axis before each joint of `model` in what the columns are documented with.
inline void name_axes(recording::Recording& out, const RobotModel& model,
                      const robotics::MakerAxes& axes) {
  if (!axes.known()) return;
  for (recording::Column& c : out.columns) c.doc = axes.in_text(model, c.doc);
}

}  // namespace robomosp::sim
