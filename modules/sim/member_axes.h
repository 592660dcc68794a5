// SPDX-License-Identifier: Apache-2.0
// The maker's axes of the robots of a world, for messages (layer: application, sim). [any thread]
#pragma once

#include <string>
#include <utility>

#include "document/document.h"
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

}  // namespace robomosp::sim
