// SPDX-License-Identifier: Apache-2.0
// Transitions: consecutive segments joined into one motion (layer: data processing, motion).
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "model/records.h"
#include "motion/segment.h"

namespace robomosp::motion {

/// Greatest differences that still count as joined.
inline constexpr double kJoinPosition = 1e-9;  ///< [m]
inline constexpr double kJoinRotation = 1e-9;  ///< [rad]
inline constexpr double kJoinRate = 1e-9;      ///< [m/s and rad/s], beside the same share of both

/// A segment of a sequence.
struct SegmentInLine {
  std::shared_ptr<const Segment> segment;
  SegmentLimits limits;
  model::Transition transition;  ///< from the one before; the first one's is not used
};

struct JoinedPiece {
  std::shared_ptr<const Segment> segment;
  std::size_t index = 0;       ///< of the segment that it is, or leads to
  bool is_transition = false;  ///< it leads to that segment
};

struct JoinedSegments {
  std::vector<JoinedPiece> pieces;  ///< in order of time
  std::vector<std::string> notes;   ///< limits and hulls that were left, a sentence each
};

/// Joins segments. Where one does not begin as the one before ends,
/// - a gap in position is bridged, and so is a turn between two rests;
/// - a corner, where orientation or velocity alone differ, is cut: the segment before ends and the
///   next one begins a distance from it (the transition's, or a tenth of the shorter of the two);
/// by a piece of fifth degree in time with the positions, orientations and velocities of its
/// neighbours at both ends, and their accelerations unless these would drive it out of the convex
/// hull of what it replaces (a corner) or joins (a gap). From rest to rest it is a straight line.
///
/// The piece takes the shortest time in which it keeps
/// - the transition's speed, or the faster neighbour's: where the ends are faster than the
///   transition's speed, the tool slows down to it until the middle;
/// - the smaller acceleration and jerk of its neighbours' limits, and the greater angular speed.
/// Where no time does within the hull, its neighbours slow down for it: over a stretch that keeps
/// their accelerations, farther back if a segment is too short for that. A limit or a hull that is
/// left nevertheless is a note with the peak and its time.
///
/// Without smoothness a gap is an error that gives its size, and a velocity may jump. A segment
/// that lasts no time and stays where the one before ends has no part in this. [any thread]
Result<JoinedSegments> join(std::span<const SegmentInLine>);

}  // namespace robomosp::motion
