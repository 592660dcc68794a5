// SPDX-License-Identifier: Apache-2.0
// Meshes plane and cylindrical faces with straight and circular edges, many times faster than OCCT
// does and with the same points on the edges, so that its meshes of other faces fit (layer:
// plugin).
#pragma once

#include <robomosp/sdk/csg.h>

#include <TopoDS_Face.hxx>

namespace robomosp::csg_occt {

/// Whether mesh_face() may be tried.
bool is_plain_face(const TopoDS_Face& face);

/// Writes triangles into the face and points into its edges; edges that another face has points on
/// keep them. False, and nothing written, when the outcome would not be right.
bool mesh_plain_face(const TopoDS_Face& face, const MeshQuality& quality);

}  // namespace robomosp::csg_occt
