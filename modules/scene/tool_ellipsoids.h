// SPDX-License-Identifier: Apache-2.0
// Ellipsoids of velocity and force at the tools of robots, as they stand or as they move along a
// recording (layer: application, scene). [any thread]
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

/// Those of the first tool, as long as a fifth of the reach; with closed loops by the motors'
/// rates. `joint_frames` of one configuration.
[[nodiscard]] std::vector<render::Item> tool_ellipsoids(const std::string& owner,
                                                        const RobotModel& model,
                                                        const Pose& world_T_base,
                                                        std::span<const Pose> joint_frames,
                                                        const ShownEllipsoids& shown);

/// The ellipsoids of all robots of a picture at any time.
class MovingEllipsoids {
 public:
  /// Of a world or a robot; of what else has none. Robots that `recording` (may be null) moves
  /// follow it, the others stand as build() shows them; those that cannot be built are left out.
  static Result<MovingEllipsoids> build(const Source&, AnyId, const recording::Recording* recording,
                                        Progress&);
  [[nodiscard]] bool empty() const { return robots_.empty(); }
  /// At a time of the recording [s], between its rows linearly; ids and names as of build().
  [[nodiscard]] std::vector<render::Item> at(double time, const ShownEllipsoids&) const;

 private:
  struct Robot {
    std::string owner;
    std::shared_ptr<const RobotModel> model;
    Pose world_T_base;
    std::vector<double> q;  ///< row after row, one a time; one where it stands
  };
  std::vector<double> times_;
  std::vector<Robot> robots_;
};

}  // namespace robomosp::scene
