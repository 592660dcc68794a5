// SPDX-License-Identifier: Apache-2.0
// Movables: places of records that can be moved in a picture, where they are in the world, and what
// record.set has to change to move them (layer: application, scene). [any thread]
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>

#include "kernel/value.h"
#include "model/records.h"
#include "scene/frame.h"

namespace robomosp::scene {

/// A placement of a record in a picture, or the tool of a robot, which its joints move.
struct Movable {
  AnyId record;
  std::string path;   ///< of the placement; record.set takes `<path>.position`; "" = a robot's tool
  std::string label;  ///< "object \"table\""
  Pose world_T_parent;           ///< the frame in which the record gives the placement
  Pose parent_T_own;             ///< as the document has it
  model::Placement placement{};  ///< as it is written
  /// Expressions of the three numbers of the position and the three angles; "" = a plain number.
  std::array<std::string, 6> expressions{};
  /// Of a robot's tool.
  struct Joints {
    AnyId robot;
    std::string member;  ///< of the world `record`
    Pose world_T_mounting;
    std::vector<double> q;  ///< joint values shown [rad, m or 1]
  };
  std::optional<Joints> joints{};

  [[nodiscard]] Pose world_T_own() const;
};

/// What a path names in a picture: members of worlds, parts and centre points of objects, nodes of
/// solids, tools and links with an origin of robots, control points and segments of trajectories.
/// "" of a record = its member. `seen`: an element of the wanted instance; none = the first one
/// that the frame shows. Errors give the reason why it cannot be moved.
[[nodiscard]] Result<Movable> movable(const Frame&, AnyId record, std::string_view path,
                                      const std::optional<ElementRef>& seen = {});
/// The tool of a robot of a world, moved by inverse kinematics. `member`: the robot's name there.
[[nodiscard]] Result<Movable> movable_tool(const Frame&, std::string_view member);

/// Control points of a trajectory in the world of the frame.
struct ControlPoint {
  std::string path;  ///< "segments.1.points.2"
  std::string name;  ///< "segment 1, start"
  Vec3 place{};      ///< in the world [m]
};
/// Those of the placement that was seen, else of the first one. Empty if the frame does not show
/// the trajectory, and for segments that move joints.
[[nodiscard]] std::vector<ControlPoint> control_points(
    const Frame&, AnyId trajectory, const std::optional<ElementRef>& seen = std::nullopt);

/// A call of record.set.
struct Assignment {
  std::string path;
  Value value;
};
/// The assignments that bring a placement to a pose; none if it is there. Only numbers that differ
/// are assigned. A number that an expression gives is not overwritten: an error with its text.
[[nodiscard]] Result<std::vector<Assignment>> assignments(const Movable&, const Pose& world_T_own);

}  // namespace robomosp::scene
