// SPDX-License-Identifier: GPL-3.0-or-later
// Primitives as closed triangle meshes. Polygons that stand for circles have the circle's area, so
// that volumes come out right though every face is within the chord only (layer: plugin).
#pragma once

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/host.h>
#include <robomosp/sdk/result.h>

#include "box_tree.h"
#include "patch_mesh.h"

namespace robomosp::csg_cgal {

/// Curved faces lie within this distance of their triangles [m], larger ones within kChordBySize of
/// their radius; twice that where they are curved both ways, as spheres are.
inline constexpr double kChord = 5e-5;
inline constexpr double kChordBySize = 2.5e-4;

/// Refuses what only exact engines can make; check_csg_tree() has passed the node.
Result<void> check_kind(const CsgNode& node, std::size_t index);

/// The primitive, no imported one, in its own frame; `key` goes into the ids of its faces. Call
/// check_kind first.
Result<PatchMesh> tessellate(const CsgNode& node, std::uint64_t key);

/// With what its checks needed and operations will need again.
struct ImportedMesh {
  PatchMesh mesh;
  std::vector<Triangle> neighbours;
  BoxTree tree;
};
/// An imported mesh made fit for operations (repair.cpp); `notes` gets what had to be repaired.
/// Works on threads of `host`.
Result<ImportedMesh> imported_mesh(const CsgGeometry& geometry, double scale, std::uint64_t key,
                                   std::vector<std::string>& notes, const Host& host);

}  // namespace robomosp::csg_cgal
