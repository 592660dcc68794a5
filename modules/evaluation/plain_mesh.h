// SPDX-License-Identifier: Apache-2.0
// Imported meshes as they are, where no engine for solids takes them: drawn, collided with and
// weighed, but not operated on (layer: application, evaluation). Internal to modules/evaluation.
// [any thread]
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/csg.h>

#include "spatial/surface_cuts.h"
#include "spatial/surface_moments.h"

namespace robomosp::evaluation {

/// Whether the tree is one imported mesh, with nothing done to it but placed and scaled, be it by
/// scale nodes.
[[nodiscard]] bool is_plain_mesh(const CsgTree& tree);

/// What was found out about a mesh; in the frame of its tree.
[[nodiscard]] spatial::SurfaceMoments examined(const CsgTree& tree);

/// Where its triangles cut each other, corners at one place taken for one; at most `most` places.
[[nodiscard]] std::vector<spatial::SurfaceCut> cuts_of(const CsgTree& tree, std::size_t most);

/// Why a shape of plain_shape() is no clean solid; nullptr for shapes of engines.
[[nodiscard]] const Error* why_plain(const CsgShape& shape);

/// The shape of a plain mesh. `why` says what keeps it from being a clean solid, and is what
/// sections and features of it are refused with. What has a corner that is not a finite number, or
/// a triangle that names a corner which is not there, is an error.
[[nodiscard]] Result<std::shared_ptr<const CsgShape>> plain_shape(const CsgTree& tree,
                                                                  const Error& why);

/// Works on what plain_shape() makes, and on nothing else; no provider, as it refuses operations.
[[nodiscard]] std::shared_ptr<CsgEngine> plain_engine();

}  // namespace robomosp::evaluation
