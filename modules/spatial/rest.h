// SPDX-License-Identifier: Apache-2.0
// When a joint counts as resting (layer: data processing, spatial; no standard library, for sources
// of robomosp_lanes() too).
#pragma once

namespace robomosp::spatial {

/// A joint that is no faster than this rests [rad/s or m/s]: a planned rest comes with some 1e-17
/// of rounding, whose sign says nothing about where Coulomb friction points. What holds a resting
/// joint is within the cone of static friction, and no part of a torque that is computed.
inline constexpr double kRestSpeed = 1e-9;

}  // namespace robomosp::spatial
