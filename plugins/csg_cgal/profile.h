// SPDX-License-Identifier: GPL-3.0-or-later
// Profiles as polygons, with the curve approximated by each side (layer: plugin).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>

#include "triangulate.h"

namespace robomosp::csg_cgal {

/// The curve that a run of sides approximates.
struct Curve2 {
  enum class Kind : std::uint8_t { line, arc, free };
  Kind kind = Kind::line;
  Point2 centre{};
  double radius = 0;
  double deviation = 0;  ///< of the sides from the curve [m]
  double turn = 0;       ///< greatest angle between two sides [rad]
};

struct Outline {
  std::vector<Curve2> curves;
  std::vector<std::vector<Point2>> loops;
  std::vector<std::vector<std::uint32_t>> curve_of;  ///< of the side that begins at each corner
};

/// Number of sides that keep a full circle within the chord; a multiple of 4.
int circle_sides(double radius);
/// Ratio by which the corners of a polygon with this angle per side lie outside the radius, so that
/// it has the circle's area.
double equal_area(double angle_of_side);
/// Points of an arc about the origin from angle `from`, without the last one: its ends lie on the
/// arc, the points between outside of it so that the area is the sector's.
std::vector<Point2> arc_points(double radius, double from, double sweep, int sides);

/// `loop 2`, counted from 1.
std::string loop_text(std::size_t loop);
/// Which loops cross or touch, for a message.
std::string conflict_text(const std::vector<std::vector<Point2>>& loops);

/// The profile's loops as polygons, not yet oriented; the error describes its fault.
Result<Outline> outline_of(const CsgProfile& profile);

}  // namespace robomosp::csg_cgal
