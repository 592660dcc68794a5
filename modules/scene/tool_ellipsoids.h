// SPDX-License-Identifier: Apache-2.0
// Ellipsoids of velocity and force at the tools of robots, at rest or moving with a recording
// (layer: application, scene). [any thread]
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/render.h>
#include <robomosp/sdk/result.h>

#include "scene/build.h"
#include "scene/ellipsoid.h"

namespace robomosp::scene {

/// The ellipsoids of the first tool, scaled to a fifth of the reach; with closed loops for the
/// motors' rates. `joint_frames` of one configuration.
[[nodiscard]] std::vector<render::Item> tool_ellipsoids(const std::string& owner,
                                                        const RobotModel& model,
                                                        const Pose& world_T_base,
                                                        std::span<const Pose> joint_frames,
                                                        const ShownEllipsoids& shown);

/// The ellipsoids of all robots of a picture at any time.
class MovingEllipsoids {
 public:
  /// For a world or a robot; other records have none. Robots that `recording` (may be null) moves
  /// follow it, the others are at rest as in build(); those that cannot be built are left out.
  static Result<MovingEllipsoids> build(const Source&, AnyId, const recording::Recording* recording,
                                        Progress&);
  [[nodiscard]] bool empty() const { return robots_.empty(); }
  /// At a time of the recording [s], interpolated linearly between its rows; ids and names as in
  /// build().
  [[nodiscard]] std::vector<render::Item> at(double time, const ShownEllipsoids&) const;

 private:
  struct Robot {
    std::string owner;
    std::shared_ptr<const RobotModel> model;
    Pose world_T_base;
    std::vector<double> q;  ///< row after row, one per time; a single one at rest
  };
  std::vector<double> times_;
  std::vector<Robot> robots_;
};

}  // namespace robomosp::scene
