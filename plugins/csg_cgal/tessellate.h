// SPDX-License-Identifier: GPL-3.0-or-later
// Primitives as closed triangle meshes. Polygons that approximate circles have the circle's area,
// so that volumes are correct although faces are accurate only within the chord (layer: plugin).
#pragma once

#include <robomosp/sdk/csg.h>
#include <robomosp/sdk/host.h>
#include <robomosp/sdk/result.h>

#include "box_tree.h"
#include "patch_mesh.h"

namespace robomosp::csg_cgal {

/// Curved faces lie within this distance of their triangles [m], larger ones within kChordBySize of
/// their radius; twice that for doubly curved faces such as spheres.
inline constexpr double kChord = 5e-5;
inline constexpr double kChordBySize = 2.5e-4;

/// Rejects nodes that only exact engines support; check_csg_tree() has accepted the node.
Result<void> check_kind(const CsgNode& node, std::size_t index);

/// A primitive other than an imported one, in its frame; `key` becomes part of the ids of its
/// faces. Call check_kind first.
Result<PatchMesh> tessellate(const CsgNode& node, std::uint64_t key);

/// With data of its checks that operations reuse.
struct ImportedMesh {
  PatchMesh mesh;
  std::vector<Triangle> neighbours;
  BoxTree tree;
};
/// An imported mesh prepared for operations (repair.cpp); `notes` receives the repairs. Works on
/// threads of `host`.
Result<ImportedMesh> imported_mesh(const CsgGeometry& geometry, double scale, std::uint64_t key,
                                   std::vector<std::string>& notes, const Host& host);

}  // namespace robomosp::csg_cgal
