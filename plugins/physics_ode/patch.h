// SPDX-License-Identifier: Apache-2.0
// Where two flat faces touch: the points that an engine gives lie at the patch's edge, where
// friction would have too long an arm against spinning (layer: plugin).
#pragma once

#include <optional>
#include <span>

#include <robomosp/sdk/types.h>

namespace robomosp::physics_ode {

/// One more point for a flat patch.
struct PatchMiddle {
  Vec3 point{};      ///< its centroid
  double share = 0;  ///< of the load that it carries so that friction against spinning is that of
                     ///< an even pressure, 0..1
  double depth = 0;  ///< there [m]
};

/// Points of contact in a plane across a unit normal. Their hull is the patch; where they lie on a
/// circle and `arm` > 0, the patch is what is within it, with points at this mean distance from its
/// centre, of the radius. None where they are no patch, or where the load
/// on the points as they are has no longer an arm than an even pressure.
[[nodiscard]] std::optional<PatchMiddle> patch_middle(std::span<const Vec3> points,
                                                      std::span<const double> depths,
                                                      const Vec3& normal, double arm);

}  // namespace robomosp::physics_ode
