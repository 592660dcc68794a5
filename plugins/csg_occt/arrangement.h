// SPDX-License-Identifier: Apache-2.0
// The plane cut up by the borders of regions: exact where borders coincide or touch, refused where
// they nearly do (layer: plugin, std only). Lengths in millimetres.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <robomosp/sdk/progress.h>

namespace robomosp::csg_occt {

struct Point2 {
  double x = 0, y = 0;
};

/// A straight or circular part of a region's border. Which side the region is on does not matter:
/// crossing the border once leads from outside to inside.
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
  /// Runs along its carrier. A circle that nothing meets is one edge from a vertex to itself.
  struct Edge {
    std::uint32_t carrier = 0, from = 0, to = 0;
    double start = 0, end = 0;          ///< on the carrier; end > start
    std::uint32_t left = 0, right = 0;  ///< cells
  };
  struct Vertex {
    Point2 p;
    std::vector<std::uint32_t> edges;  ///< that start or end here; a loop counts twice
  };
  /// A connected part of the plane that no border crosses. Cell 0 is the unbounded one.
  struct Cell {
    double area = 0;
    std::vector<std::uint32_t> regions;  ///< that cover it, ascending
  };
  std::vector<Carrier> carriers;
  std::vector<Edge> edges;
  std::vector<Vertex> vertices;
  std::vector<Cell> cells;
};

/// Points nearer than this are one point, a gap between borders less than this is none.
inline constexpr double kSamePlace = 1e-8;
/// Nothing may come nearer than this to anything it does not touch.
inline constexpr double kClearance = 1e-5;
/// Borders cross at no smaller angle [rad] than this.
inline constexpr double kLeastCrossing = 1e-3;

/// Nothing when the borders are too close to a degenerate position to be sure of the outcome, when
/// they cut the plane into so many pieces that other ways are quicker, or when it was cancelled.
std::optional<Arrangement> arrange(const std::vector<BorderPiece>& borders,
                                   const Progress& progress);

}  // namespace robomosp::csg_occt
