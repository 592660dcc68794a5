// SPDX-License-Identifier: Apache-2.0
// Bodies generated from a robot's rows, for links that have no designed ones: housings, tubes,
// rails and a flange sized by the robot's reach (layer: data processing, robotics).
// A skin has no mass. Every piece is one primitive, so that no boolean operation is needed.
#pragma once

#include <cstdint>
#include <vector>

#include <robomosp/sdk/csg.h>

#include "model/records.h"

namespace robomosp::robotics {

/// Which of the robot's two skin colours a piece has: Robot::skin_colour or skin_accent.
enum class LinkGeometryRole : std::uint8_t { tube, joint };

struct LinkGeometryPiece {
  CsgTree tree;  ///< in the frame of its link (base pieces: in the base frame)
  LinkGeometryRole role = LinkGeometryRole::tube;
};

struct LinkGeometry {
  std::vector<LinkGeometryPiece> base;
  std::vector<std::vector<LinkGeometryPiece>>
      links;  ///< one entry a link; empty for invisible links
};

/// Generates the skin of a robot that build_robot_model accepts. [any thread]
[[nodiscard]] LinkGeometry make_link_geometry(const model::Robot& robot);

/// Which bodies are generated: [0] = base, then one entry a link. Each visible link without
/// designed parts is, except a fixed one on a link that is not: it is a mere frame. The base is
/// where it has no parts and carries a generated link. [any thread]
[[nodiscard]] std::vector<bool> generated_bodies(const model::Robot& robot);

}  // namespace robomosp::robotics
