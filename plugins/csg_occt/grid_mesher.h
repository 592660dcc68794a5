// SPDX-License-Identifier: Apache-2.0
// Meshes spheres and tori, and zones of them that are rectangles in their two angles, by a grid: a
// hundred times faster than OCCT does; and cones between two circles by rings, of which OCCT makes
// as many as triangles would be square (layer: plugin).
#pragma once

#include <robomosp/sdk/csg.h>

#include <TopoDS_Face.hxx>

namespace robomosp::csg_occt {

/// Writes triangles into the face and points into its edges, as mesh_plain_face() does. False, and
/// nothing written, when the face is none of these, when opposite edges do not match, or when the
/// grid would not be as fine as asked for.
bool mesh_grid_face(const TopoDS_Face& face, const MeshQuality& quality);

}  // namespace robomosp::csg_occt
