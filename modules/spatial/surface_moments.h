// SPDX-License-Identifier: Apache-2.0
// Volume integrals of the space enclosed by a surface of triangles in any state: open,
// inconsistently oriented, self-intersecting (layer: data processing, spatial). [any thread]
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <robomosp/sdk/csg.h>

namespace robomosp::spatial {

/// A place where a surface does not bound a solid.
struct SurfaceFault {
  enum class Kind : std::uint8_t {
    rim,      ///< of a hole: edges with a triangle on one side only
    overlap,  ///< the surface encloses this point more than once
  };
  Kind kind = Kind::rim;
  Vec3 at{};               ///< the centre of a rim, a point of an overlap [m]
  double size = 0;         ///< the longest side of the box around it [m]
  std::vector<Vec3> line;  ///< the rim's corners in order; empty for an overlap
};

struct SurfaceMoments {
  /// About the origin. `exact` is false; `relative_error` bounds the volume and, about the middle
  /// of the box, the trace of the second moments, or is 1 if no bound is known.
  Moments moments;
  bool is_hull = false;  ///< `moments` are those of the convex hull
  double overlap = 0;    ///< volume that is enclosed more than once, counted once [m^3]
  std::size_t open_edges = 0;
  std::size_t turned = 0;  ///< triangles oriented opposite to most of their neighbours
  std::vector<SurfaceFault> faults;
  std::vector<std::uint32_t> triangles;  ///< as given, consistently oriented; indices of the given
                                         ///< points
};

/// `points`: 3 numbers per corner [m], finite; `triangles`: 3 indices each, in range. Corners at
/// one position are merged. Holes are closed by fans about the centres of their rims; the error of
/// the filling is bounded by the hulls of the rims, which are flat for a plane hole. Space that
/// rays along the axes find enclosed more than once is counted once; if they find none, the missed
/// volume is bounded by the number of rays. A surface with an enclosed volume below its uncertainty
/// counts as its convex hull; one that lies in a plane has a volume of 0.
[[nodiscard]] SurfaceMoments surface_moments(std::span<const double> points,
                                             std::span<const std::uint32_t> triangles);

/// A description: "open along 12 edges" and such, joined by commas; "" if there are no faults.
[[nodiscard]] std::string state_in_words(const SurfaceMoments& m);

}  // namespace robomosp::spatial
