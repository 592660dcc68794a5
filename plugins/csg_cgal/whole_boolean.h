// SPDX-License-Identifier: GPL-3.0-or-later
// A boolean operation by CGAL's corefinement of both solids from end to end (layer: plugin): what
// local_boolean.h leaves undecided, and what the tests compare it with.
#pragma once

#include <optional>

#include <robomosp/sdk/csg.h>

#include "exact_solid.h"

namespace robomosp::csg_cgal {

/// Nothing when the result is no closed surface. Corners and triangles come in no particular order.
/// Throws Cancelled.
std::optional<ExactSolid> whole_boolean(CsgKind kind, const ExactSolid& a, const ExactSolid& b,
                                        const Progress& progress);

}  // namespace robomosp::csg_cgal
