// SPDX-License-Identifier: Apache-2.0
// Bridge: a quintic motion between two states of the tool (layer: data processing, motion).
#pragma once

#include <array>
#include <span>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "spatial/quintic.h"

namespace robomosp::motion {

/// Moves from one state of the tool to another in a given time: quintic polynomials for the
/// position and for the rotation vector from the first orientation. [any thread]
class Bridge final : public Segment {
 public:
  /// `duration` > 0 [s]
  Bridge(const PathSample& from, const PathSample& to, double duration);
  Result<void> measure();  ///< for length()
  [[nodiscard]] double duration() const override { return duration_; }
  [[nodiscard]] double length() const override { return length_; }
  Result<void> sample(std::span<const double> times, std::span<PathSample> out) const override;

  /// Position, and rotation vector from the first orientation, at a fraction of the duration.
  [[nodiscard]] Vec3 place(double share) const;
  [[nodiscard]] Vec3 turn(double share) const;
  [[nodiscard]] double jerk(double share) const;  ///< of the position [m/s^3]

 private:
  using Quintics = std::array<spatial::Quintic, 3>;
  double duration_, length_ = 0;
  Quintics way_, turn_;
  Pose start_;
};

/// Greatest rates within a bridge, and its speed at half time [SI].
struct BridgePeaks {
  double speed = 0, acceleration = 0, jerk = 0;
  double turning = 0, spin = 0, angular_jerk = 0;
  double middle = 0;             ///< speed at half the duration [m/s]
  double acceleration_time = 0;  ///< of the greatest acceleration, from the start [s]
};
BridgePeaks peaks_of(const Bridge&);

/// Distance of a point from the convex hull of others, to about `tolerance`; 0 inside.
double outside_hull(const Vec3& p, std::span<const Vec3> points, double tolerance);

}  // namespace robomosp::motion
