// SPDX-License-Identifier: Apache-2.0
// Motion of a robot's mounting over time, prescribed by a trajectory or by expressions of the time,
// and its effect on the robot's dynamics (layer: application, sim).
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <robomosp/sdk/dynamics.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "model/world.h"
#include "motion/cartesian_path.h"

namespace robomosp::sim {

/// x, y, z [m], roll, pitch, yaw [rad] as expressions of `time` [s], empty = 0.
using BaseExpressions = std::array<std::string, 6>;
inline constexpr std::array<const char*, 6> kBaseNumbers{"x", "y", "z", "roll", "pitch", "yaw"};

/// A prescribed motion of the mounting. [one thread]
class BasePath {
 public:
  /// Along a path, as the pose of its trajectory's frame; at rest before and after.
  BasePath(std::shared_ptr<const motion::Path> path, const Pose& world_T_path);
  /// By expressions in the axes of `world_T_mounting`, the placement of the robot. Velocities and
  /// accelerations are central differences of order 8 with steps of 2 ms, accurate to about 1e-9
  /// for motions slower than 10 Hz; `start` and `end`: the time range in which all must be defined.
  static Result<BasePath> by_expressions(const BaseExpressions&, const Pose& world_T_mounting,
                                         double start, double end);

  /// Errors here and below: those of the path or the expressions.
  [[nodiscard]] Result<Pose> world_T_mounting(double t) const;
  /// Motion of a robot's base with the given pose on the mounting, world axes.
  [[nodiscard]] Result<PathSample> base(double t, const Pose& mounting_T_base) const;
  /// Motion felt by a robot with that base; gravity in world axes.
  [[nodiscard]] Result<BaseMotion> felt(double t, const Pose& mounting_T_base,
                                        const Vec3& gravity) const;

 private:
  BasePath() = default;
  std::function<Result<PathSample>(double)> sample_;
  Pose world_T_path_;
};

/// The note of runs that support fixed bases only, for a robot with a moving base; `who` ignores
/// the motion: "tasks do". nullopt = the base is fixed.
[[nodiscard]] std::optional<std::string> note_on_standing_base(const model::PlacedRobot&,
                                                               std::string_view who);

}  // namespace robomosp::sim
