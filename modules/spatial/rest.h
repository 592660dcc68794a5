// SPDX-License-Identifier: Apache-2.0
// Threshold below which a joint is at rest (layer: data processing, spatial; no standard library,
// also for sources of robomosp_lanes()).
#pragma once

namespace robomosp::spatial {

/// A joint that is no faster than this is at rest [rad/s or m/s]: planned standstills have rounding
/// errors of about 1e-17, and their sign does not determine the direction of Coulomb friction. The
/// holding force of a joint at rest is within the cone of static friction, and not part of computed
/// torques.
inline constexpr double kRestSpeed = 1e-9;

}  // namespace robomosp::spatial
