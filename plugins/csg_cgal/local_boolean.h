// SPDX-License-Identifier: GPL-3.0-or-later
// A boolean operation on two solids that looks exactly only at the triangles near where they meet
// (layer: plugin; docs/decisions/0037-booleans-near-the-cut.md).
#pragma once

#include <optional>

#include <robomosp/sdk/csg.h>

#include "exact_solid.h"

namespace robomosp::csg_cgal {

struct LocalOutcome {
  enum class State {
    closed,   ///< `solid` is the result
    touches,  ///< more than two triangles of the result meet in an edge
    unsure    ///< answers contradict each other; the slower operation decides
  } state = State::unsure;
  std::optional<ExactSolid> solid;
};

/// Throws Cancelled. [any thread]
LocalOutcome local_boolean(CsgKind kind, const ExactSolid& a, const ExactSolid& b,
                           const Progress& progress);

}  // namespace robomosp::csg_cgal
