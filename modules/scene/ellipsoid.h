// SPDX-License-Identifier: Apache-2.0
// Ellipsoids of velocity and force at a robot's tool, as bodies of a picture (layer: application,
// scene). [any thread]
#pragma once

#include <cstdint>
#include <string>

#include <robomosp/sdk/render.h>

namespace robomosp::scene {

/// Which ellipsoids of a robot's tool a picture shows.
struct ShownEllipsoids {
  bool velocity = false;  ///< blue: velocities for joint speeds of unit length
  bool force = false;     ///< orange: forces for joint torques of unit length
};

/// A body of `half` lengths [m] along the axes of `pose`. Lengths below 3 % of the greatest
/// are drawn as that, so that a flat ellipsoid stays a body.
[[nodiscard]] render::Item ellipsoid_item(std::uint64_t id, std::string name, const Pose& pose,
                                          const Vec3& half, const Colour& colour);

/// Half lengths for drawing: the greatest becomes `size` [m], infinite ones count as twice the
/// greatest finite one.
[[nodiscard]] Vec3 drawn_lengths(const Vec3& half, double size);

}  // namespace robomosp::scene
