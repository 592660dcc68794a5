// SPDX-License-Identifier: Apache-2.0
// Trajectories in pictures: the tool's path as a line, arrowheads along it, its control points, and
// what is wrong with it in colours (layer: application, scene).
#pragma once

#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/render.h>

#include "model/records.h"
#include "motion/cartesian_path.h"
#include "sim/trajectory_faults.h"

namespace robomosp::scene {

/// What of a trajectory a picture shows, each including those before it.
enum class ShownPath : std::uint8_t {
  none,
  line,    ///< the tool's path
  arrows,  ///< arrowheads that show its direction
  points,  ///< the control points of its segments as balls with numbers
  frames,  ///< and their axes
};

/// Adds the path along `poses` (world_T_tool) of a member of a world to a scene. Where `arrows` is
/// given, it gets for each arrowhead the pose before it.
void add_path(render::Scene&, const std::string& member, std::span<const Pose> poses,
              ShownPath shown, std::vector<std::size_t>* arrows = nullptr);
/// A control point of a trajectory, by the numbers of its segment and of itself, from 0; -1 = it
/// belongs to a stored trajectory that the segment runs.
struct PointOf {
  std::int32_t segment = 0, point = -1;
};
/// Adds the control points of a trajectory placed at `world_T_trajectory`; `size` is that of
/// the path [m]. Where `points` is given, it gets one element a point that is shown.
void add_points(render::Scene&, const std::string& member, const model::Trajectory&,
                const Pose& world_T_trajectory, const motion::FindTrajectory& stored, double size,
                bool has_frames, std::vector<PointOf>* points = nullptr);
/// Diagonal of the box around places [m].
[[nodiscard]] double size_of(std::span<const Pose> poses);

/// Draws the path of a check over that of its trajectory: green where it is good, orange where a
/// limit is exceeded, violet where bodies touch, red where it is out of reach, with a ball and a
/// few words at the worst place of each fault, and what the colours mean. Where `samples` is given,
/// it gets the samples that the added lines begin at and that the added items are at.
struct MarkedSamples {
  std::vector<std::size_t> lines, items;
};
void mark_path(render::Scene&, const sim::PathCheck&, MarkedSamples* samples = nullptr);

/// A stretch of a tool's path in one colour.
struct MarkedStretch {
  std::vector<Pose> poses;  ///< world_T_tool
  Colour colour;
  std::string kind;  ///< in the legend
  bool is_good = true;
};
/// A ball with a few words, or none.
struct MarkedPlace {
  Vec3 at{};
  std::string text;
  Colour colour;
};
/// Draws the path of a run in the colours of its stretches, with marks and what the colours mean.
void mark_stretches(render::Scene&, const std::string& member, std::span<const MarkedStretch>,
                    std::span<const MarkedPlace>);

}  // namespace robomosp::scene
