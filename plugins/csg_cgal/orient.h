// SPDX-License-Identifier: GPL-3.0-or-later
// Which side of a mesh is outside (layer: plugin).
#pragma once

#include <vector>

#include "patch_mesh.h"

namespace robomosp::csg_cgal {

/// Turns the separate pieces of a closed mesh that does not cut itself so that they bound a volume.
/// `neighbours` are its neighbours_of(), and are again afterwards.
void orient_outwards(PatchMesh& mesh, std::vector<Triangle>& neighbours);

}  // namespace robomosp::csg_cgal
