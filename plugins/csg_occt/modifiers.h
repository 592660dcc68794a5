// SPDX-License-Identifier: Apache-2.0
// Fillet, chamfer and mirror: what is made of the finished solids of a child (layer: plugin).
#pragma once

#include <string>
#include <vector>

#include "boolean.h"

namespace robomosp::csg_occt {

/// Every solid checked like the result of a boolean operation. `solids` in the frame of the node's
/// child (fillet, chamfer) or of the node (mirror). Errors lack the place.
Result<std::vector<Solid>> run_modifier(const CsgNode& node, const std::vector<Solid>& solids,
                                        FaceMemory& faces, Progress& progress);

/// The tight box around solids, without tolerances [mm].
Bnd_Box tight_box(const std::vector<Solid>& solids, const gp_Trsf& pose);

/// How an edge lies between its two faces.
struct EdgeCorner {
  bool is_sharp = false;   ///< the normals differ; all else is unset when they do not
  bool is_convex = false;  ///< material inside the corner
  double turn = 0;         ///< angle between the normals [rad]
};
/// Measured half way along the edge. Smooth for a seam, a degenerate edge or a bare one.
EdgeCorner corner_of(const TopoDS_Shape& edge, const TopoDS_Shape& one, const TopoDS_Shape& other);

/// An axis has no front: the greatest of its components is made positive.
gp_Dir axis_direction(const gp_Dir& d);
/// Both faces lie on one and the same surface: what is between them is no edge to people.
bool are_one_surface(const TopoDS_Face& one, const TopoDS_Face& other);

/// The mirror image at the plane through `offset` times the normal [mm].
gp_Trsf mirror_trsf(const std::array<double, 6>& sizes);

}  // namespace robomosp::csg_occt
