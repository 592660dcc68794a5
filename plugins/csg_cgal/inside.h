// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a point is inside a solid (layer: plugin; CGAL's kernel).
#pragma once

#include <optional>

#include "exact_corners.h"

namespace robomosp::csg_cgal {

/// Whether a triangle that nowhere cuts the surface of `solid`, but may touch it, is inside of it.
/// `rounded`: its corners within `slack` [m]. Nothing when every point tried is on the surface.
std::optional<bool> is_inside(const ExactSolid& solid, const std::array<Point, 3>& triangle,
                              const std::array<Vec3, 3>& rounded, double slack);

}  // namespace robomosp::csg_cgal
