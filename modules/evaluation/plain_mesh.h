// SPDX-License-Identifier: Apache-2.0
// Imported meshes that no solid engine accepts: they are drawn, collide and have mass, but
// operations on them are refused (layer: application, evaluation). Internal to modules/evaluation.
// [any thread]
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <robomosp/sdk/csg.h>

#include "spatial/surface_cuts.h"
#include "spatial/surface_moments.h"

namespace robomosp::evaluation {

/// True if the tree is one imported mesh that is only placed and scaled, possibly by scale nodes.
[[nodiscard]] bool is_plain_mesh(const CsgTree& tree);

/// Faults and moments of a mesh, in the frame of its tree.
[[nodiscard]] spatial::SurfaceMoments examined(const CsgTree& tree);

/// Places where its triangles cut each other, with coincident corners merged; at most `most`.
[[nodiscard]] std::vector<spatial::SurfaceCut> cuts_of(const CsgTree& tree, std::size_t most);

/// Why a shape of plain_shape() is not a clean solid; nullptr for shapes of engines.
[[nodiscard]] const Error* why_plain(const CsgShape& shape);

/// The shape of a plain mesh. `why` is the reason why it is not a clean solid, and the error of its
/// sections and features. A corner that is not finite, or a triangle with a missing corner, is an
/// error.
[[nodiscard]] Result<std::shared_ptr<const CsgShape>> plain_shape(const CsgTree& tree,
                                                                  const Error& why);

/// An engine for the shapes of plain_shape() only; not a provider, since it refuses operations.
[[nodiscard]] std::shared_ptr<CsgEngine> plain_engine();

}  // namespace robomosp::evaluation
