// SPDX-License-Identifier: Apache-2.0
// Weaving: a path to whose sides the tool swings, as for broad seams (layer: data processing).
#pragma once

#include <memory>
#include <span>
#include <vector>

#include <robomosp/sdk/result.h>
#include <robomosp/sdk/trajectory.h>

#include "motion/cartesian_path.h"

namespace robomosp::motion {

/// Swings across a path: a sine over the way along it. The side is across the way and the tool's z.
struct Weave {
  double amplitude = 0;  ///< to each side [m]
  double length = 0;     ///< of the path for one swing to both sides and back [m], > 0
};

/// Swings laid over a path. They grow from nothing within the first swing of each piece and cease
/// within the last one (each half of the piece, where it is shorter than two swings), so that
/// place, velocity and acceleration at the ends of a piece are those of the path itself. Pieces
/// without a way, which only turn the tool, have no swings. Immutable. [any thread]
class Weaving {
 public:
  /// Measures the way along each piece.
  static Result<Weaving> over(std::shared_ptr<const Path>, const Weave&);
  /// Moves samples that are those of the path at these times [s] to the side, with their
  /// velocities and accelerations. ErrorCode::unsupported where the tool's z lies along the way (to
  /// 5 degrees), so that it has no sides.
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
