// SPDX-License-Identifier: Apache-2.0
// Lengths of workspaces that are curves traced by one coordinate: all their voxels are on the
// surface, so counting them is meaningless (layer: data processing, robotics).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <robomosp/sdk/robot_model.h>

#include "robotics/workspace.h"

namespace robomosp::robotics {

/// Motion of a tip's position, from its Jacobians at some configurations.
struct TipMobility {
  std::ptrdiff_t only = -1;  ///< the only velocity that moves the position, -1 = none or several
  double fastest = 0;        ///< longest column [m per unit of a velocity]
};
/// `jacobians`: 6 rows per velocity, linear rows first, one configuration after the other.
[[nodiscard]] TipMobility tip_mobility(std::span<const double> jacobians, std::size_t velocities);

/// A sample of a curve traced by one coordinate.
struct CurvePoint {
  double q;      ///< of the coordinate [rad or m]
  double speed;  ///< length of the curve for one unit of q [m]
};
/// The length from the speeds, sorted by q here. Gaps of `gap` and more between two samples are not
/// counted; the error comes from the ends of the counted parts.
[[nodiscard]] WorkspaceSize curve_length(std::span<CurvePoint> points, double gap);

}  // namespace robomosp::robotics
