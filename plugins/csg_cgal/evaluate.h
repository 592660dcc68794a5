// SPDX-License-Identifier: GPL-3.0-or-later
// From a tree of nodes to one solid: checks it, merges nested operations and evaluates each
// operation once (layer: plugin).
#pragma once

#include <string>
#include <vector>

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/result.h>

#include "imports.h"
#include "mesh_boolean.h"

namespace robomosp::csg_cgal {

struct Evaluated {
  ExactSolid solid;                ///< in the frame of the root's parent
  std::vector<std::string> notes;  ///< sentences
};

/// Never recurses: the depth of the tree costs no stack. Throws Cancelled.
Result<Evaluated> evaluate_tree(const CsgTree& tree, Imports& imports, Progress& progress);

}  // namespace robomosp::csg_cgal
