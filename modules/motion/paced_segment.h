// SPDX-License-Identifier: Apache-2.0
// A part of a segment, slowed down towards its ends (layer: data processing, motion).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "motion/segment.h"

namespace robomosp::motion {

/// Pace along a segment: 1 is the segment's own timing, 0.5 half of its speed. The pace changes by
/// 3 x^2 - 2 x^3 over time: the acceleration is continuous at the ends of a change.
struct Pace {
  double start = 1, middle = 1, end = 1;
  double first = 0, last = 0;  ///< time of the change at the start and at the end [s]

  /// The segment's own time that the two changes take [s].
  [[nodiscard]] double taken() const {
    return first * (start + middle) / 2 + last * (middle + end) / 2;
  }
  [[nodiscard]] bool is_own() const { return start == 1 && middle == 1 && end == 1; }
};

/// Greatest rates of a segment, from samples [SI].
struct SegmentPeaks {
  double speed = 0, turning = 0;
  double acceleration = 0;  ///< along the path only [m/s^2]
  double spin = 0;          ///< angular acceleration [rad/s^2]
};
Result<SegmentPeaks> peaks_of(const Segment&);

/// Length of the tool's path between two times of a segment, by Simpson's rule [m].
Result<double> length_between(const Segment&, double from, double to);

/// A part of a segment between two of its times. [any thread]
class PacedSegment final : public Segment {
 public:
  /// `pace.taken()` is at most to - from; the paces are above zero.
  static Result<std::shared_ptr<const Segment>> of(std::shared_ptr<const Segment>, double from,
                                                   double to, const Pace&);
  [[nodiscard]] double duration() const override { return duration_; }
  [[nodiscard]] double length() const override { return length_; }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override;

 private:
  PacedSegment(std::shared_ptr<const Segment> segment, double from, double to, const Pace& pace,
               double length);
  /// The segment's own time since `from_`, its rate and the rate's change.
  [[nodiscard]] std::array<double, 3> own_time(double t) const;

  std::shared_ptr<const Segment> segment_;
  double from_, to_;
  Pace pace_;
  double cruise_;  ///< time at the middle pace [s]
  double duration_, length_;
};

/// A part of a segment that must begin and end at given paces.
struct PaceTask {
  std::shared_ptr<const Segment> segment;
  double from = 0, to = 0;  ///< of the segment's time [s]
  SegmentLimits limits;     ///< kept while the pace changes, unless the segment itself exceeds them
  SegmentPeaks peaks;       ///< of the whole segment
  double ease_start = 0, ease_end = 0;  ///< segment time of a change without limits [s]
};

/// The pace of the task between `start` and `end` with the fastest middle; nullopt = the segment is
/// too short for the change.
Result<std::optional<Pace>> find_pace(const PaceTask&, double start, double end);
/// The same without a faster middle: true if the segment is long enough for the change itself.
Result<bool> has_pace(const PaceTask&, double start, double end);

}  // namespace robomosp::motion
