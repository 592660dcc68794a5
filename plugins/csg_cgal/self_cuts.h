// SPDX-License-Identifier: GPL-3.0-or-later
// Whether the surface of a mesh cuts or touches itself (layer: plugin; CGAL's predicates).
#pragma once

#include <optional>

#include <robomosp/sdk/host.h>

#include "box_tree.h"
#include "patch_mesh.h"

namespace robomosp::csg_cgal {

/// Two triangles that have more in common than the corners and sides they share, exactly; which
/// two does not depend on the number of threads. `host` gives those.
std::optional<std::array<std::uint32_t, 2>> self_cut(const PatchMesh& mesh, const BoxTree& tree,
                                                     const Host& host);

}  // namespace robomosp::csg_cgal
