// SPDX-License-Identifier: GPL-3.0-or-later
// Boolean operations on solids of triangles (layer: plugin).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/result.h>

#include "exact_solid.h"

namespace robomosp::csg_cgal {

struct BooleanOutcome {
  ExactSolid solid;
  std::string remedy;  ///< what had to be done to get a closed result; empty = nothing
};

/// All solids together. Throws Cancelled.
Result<BooleanOutcome> unite(std::vector<ExactSolid> solids, Progress& progress);
/// The solid minus all tools. Throws Cancelled.
Result<BooleanOutcome> subtract(const ExactSolid& solid, std::vector<ExactSolid> tools,
                                Progress& progress);
/// What all share. Throws Cancelled.
Result<BooleanOutcome> intersect(std::vector<ExactSolid> solids, Progress& progress);

}  // namespace robomosp::csg_cgal
