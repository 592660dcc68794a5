// SPDX-License-Identifier: Apache-2.0
// How the mounting of a robot moves over time, prescribed by a trajectory or by expressions of the
// time, and what the robot's dynamics feel of it (layer: application, sim).
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
  /// Along a path, as of its trajectory's frame; at rest before and after.
  BasePath(std::shared_ptr<const motion::Path> path, const Pose& world_T_path);
  /// By expressions in the axes of `world_T_mounting`, where the robot is placed. Velocities and
  /// accelerations are their central differences of order 8 over steps of 2 ms, right to about 1e-9
  /// of what is slower than 10 Hz; `start` and `end`: the times in which all must have a value.
  static Result<BasePath> by_expressions(const BaseExpressions&, const Pose& world_T_mounting,
                                         double start, double end);

  /// Errors here and below: those of the path or the expressions.
  [[nodiscard]] Result<Pose> world_T_mounting(double t) const;
  /// How the base moves of a robot that stands so on the mounting, world axes.
  [[nodiscard]] Result<PathSample> base(double t, const Pose& mounting_T_base) const;
  /// What a robot feels whose base is so placed on the mounting; gravity in world axes.
  [[nodiscard]] Result<BaseMotion> felt(double t, const Pose& mounting_T_base,
                                        const Vec3& gravity) const;

 private:
  BasePath() = default;
  std::function<Result<PathSample>(double)> sample_;
  Pose world_T_path_;
};

/// What runs that know standing bases only say of a robot whose base has a way of its own; `who`
/// leaves it standing: "tasks do". nullopt = it has none.
[[nodiscard]] std::optional<std::string> note_on_standing_base(const model::PlacedRobot&,
                                                               std::string_view who);

}  // namespace robomosp::sim
