// SPDX-License-Identifier: Apache-2.0
// Lengths of workspaces that are curves, which one coordinate draws: their voxels are all on the
// surface, so that counting them tells nothing (layer: data processing, robotics).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/robot_model.h>

#include "robotics/workspace.h"

namespace robomosp::robotics {

/// How a tip's position moves, from its Jacobians at some configurations.
struct TipMobility {
  std::ptrdiff_t only = -1;  ///< the one velocity that moves the position, -1 = none or several
  double fastest = 0;        ///< longest column [m per unit of a velocity]
};
/// `jacobians`: 6 rows a velocity, linear rows first, one configuration after the other.
[[nodiscard]] TipMobility tip_mobility(std::span<const double> jacobians, std::size_t velocities);

/// A sample of a curve that one coordinate draws.
struct CurvePoint {
  double q;      ///< of the coordinate [rad or m]
  double speed;  ///< length of the curve for one unit of q [m]
};
/// The length by the speeds, sorted by q here. Parts of `gap` and more between two samples do not
/// count; the error is that of the ends of what counts.
[[nodiscard]] WorkspaceSize curve_length(std::span<CurvePoint> points, double gap);

}  // namespace robomosp::robotics
