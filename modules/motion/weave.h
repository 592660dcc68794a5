// SPDX-License-Identifier: Apache-2.0
// Weaving: a path with sideways oscillations of the tool, as for broad seams (layer: data
// processing).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "motion/cartesian_path.h"

namespace robomosp::motion {

/// Oscillation across a path: a sine over the distance along it. Its direction is perpendicular to
/// the path and to the tool's z.
struct Weave {
  double amplitude = 0;  ///< to each side [m]
  double length = 0;     ///< distance along the path for one full oscillation [m], > 0
};

/// Oscillations superposed on a path. Their amplitude grows from zero within the first oscillation
/// of each piece and decays within the last one (each half of the piece if it is shorter than two
/// oscillations), so that position, velocity and acceleration at the ends of a piece are those of
/// the path itself. Pieces that only turn the tool have none. Immutable. [any thread]
class Weaving {
 public:
  /// Measures the length along each piece.
  static Result<Weaving> over(std::shared_ptr<const Path>, const Weave&);
  /// Displaces samples of the path at these times [s], and adjusts their velocities and
  /// accelerations. ErrorCode::unsupported if the tool's z is along the path (within 5 degrees), so
  /// that the direction is undefined.
  Result<void> move(std::span<const double> times, std::span<PathSample> samples) const;

 private:
  struct Piece {
    double start = 0, duration = 0;  ///< [s]
    std::vector<double> way, speed;  ///< at equal times [m, m/s]
  };
  [[nodiscard]] const Piece& piece_at(double t) const;

  Weave weave_;
  std::shared_ptr<const Path> path_;
  std::vector<Piece> pieces_;
};

}  // namespace robomosp::motion
