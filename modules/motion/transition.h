// SPDX-License-Identifier: Apache-2.0
// Transitions: consecutive segments made to follow each other smoothly (layer: data processing,
// motion).
#pragma once

#include <memory>
#include <string_view>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "model/records.h"

namespace robomosp::motion {

/// Greatest differences that still count as joined.
inline constexpr double kJoinPosition = 1e-9;  ///< [m]
inline constexpr double kJoinRotation = 1e-9;  ///< [rad]
inline constexpr double kJoinRate = 1e-9;      ///< [m/s and rad/s], beside the same share of both

/// Puts `next` behind the pieces there are. Where it does not begin as the last one ends,
/// - a gap in position or orientation is bridged;
/// - a corner, a jump of velocity alone, is cut: the last piece ends and `next` begins a distance
///   from it (by the transition, or a tenth of the shorter of the two);
/// by a piece of fifth degree in time whose position, orientation, velocities and accelerations are
/// those of its neighbours at both ends. It takes the shortest time (for a corner at least that of
/// what was cut away) in which the tool is nowhere faster than at the faster end or the
/// transition's speed; where the ends are faster than that speed, the tool slows down to it until
/// the middle. Without a speed a gap is bridged at the neighbours'. An impossible speed is an
/// error. Without smoothness a gap is an error that gives its size, and a velocity may jump.
/// `number` counts the segments, for messages.
Result<void> follow(std::vector<std::shared_ptr<const Segment>>& pieces,
                    std::shared_ptr<const Segment> next, const model::Transition&,
                    std::size_t number);

}  // namespace robomosp::motion
