// SPDX-License-Identifier: Apache-2.0
// The partition of the plane by the borders of regions: exact if borders coincide or touch, refused
// if they nearly do (layer: plugin, std only). Lengths in millimetres.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <robomosp/sdk/progress.h>

namespace robomosp::csg_occt {

struct Point2 {
  double x = 0, y = 0;
};

/// A straight or circular part of a region's border. The side of the region does not matter:
/// crossing the border once changes between outside and inside.
struct BorderPiece {
  std::uint32_t region = 0;
  Point2 from, to;  ///< equal for a whole circle
  bool is_circular = false;
  Point2 centre;  ///< circular pieces run counterclockwise
  double radius = 0;
  bool is_whole_circle() const { return is_circular && from.x == to.x && from.y == to.y; }
};

struct Arrangement {
  /// A line or circle that borders lie on. Lines are measured by length from `origin` along
  /// `direction`, circles by the angle from the x axis, counterclockwise.
  struct Carrier {
    bool is_circle = false;
    Point2 origin;  ///< or the centre
    Point2 direction{1, 0};
    double radius = 0;
    std::vector<std::uint32_t> edges;  ///< in order; gaps are possible
  };
  /// Runs along its carrier. A circle without intersections is one edge from a vertex to itself.
  struct Edge {
    std::uint32_t carrier = 0, from = 0, to = 0;
    double start = 0, end = 0;          ///< on the carrier; end > start
    std::uint32_t left = 0, right = 0;  ///< cells
  };
  struct Vertex {
    Point2 p;
    std::vector<std::uint32_t> edges;  ///< that begin or end here; a loop counts twice
  };
  /// A connected part of the plane without borders inside. Cell 0 is the unbounded one.
  struct Cell {
    double area = 0;
    std::vector<std::uint32_t> regions;  ///< that cover it, ascending
  };
  std::vector<Carrier> carriers;
  std::vector<Edge> edges;
  std::vector<Vertex> vertices;
  std::vector<Cell> cells;
};

/// Points nearer than this are identical, and narrower gaps between borders do not exist.
inline constexpr double kSamePlace = 1e-8;
/// Least distance between disjoint elements.
inline constexpr double kClearance = 1e-5;
/// Least angle of crossing borders [rad].
inline constexpr double kLeastCrossing = 1e-3;

/// Nothing if the borders are too close to a degenerate position to be certain of the result, if
/// they cut the plane into so many pieces that other methods are faster, or if it was cancelled.
std::optional<Arrangement> arrange(const std::vector<BorderPiece>& borders,
                                   const Progress& progress);

}  // namespace robomosp::csg_occt
