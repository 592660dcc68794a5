// SPDX-License-Identifier: Apache-2.0
// Paths of a tool along the edges of a solid: for seams, deburring, sealing (layer: data
// processing).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/csg_edges.h>
#include <robomosp/sdk/result.h>
#include <robomosp/sdk/types.h>

#include "kernel/value.h"
#include "model/trajectory.h"

namespace robomosp::motion {

/// A part of such a path, as a segment of a trajectory without a transition.
struct EdgePiece {
  std::string shape, orientation;  ///< providers
  std::string law{};               ///< provider
  std::vector<Pose> points{};      ///< poses of the tool in the frame of the solid
  Map params{};                    ///< parameters of shape and law, in SI units
};

/// The pieces of a path; `all` are the edges of its solid. From rest to rest at corners, where the
/// tool turns on the spot. ErrorCode::invalid_argument where edges do not follow one another, or
/// where the tool has no direction.
[[nodiscard]] Result<std::vector<EdgePiece>> edge_pieces(const std::vector<CsgEdge>& all,
                                                         const model::EdgePath&);

}  // namespace robomosp::motion
