// SPDX-License-Identifier: Apache-2.0
// Fillet, chamfer and mirror of a child's finished solids (layer: plugin).
#pragma once

#include <string>
#include <vector>

#include "boolean.h"

namespace robomosp::csg_occt {

/// Checks every solid like the result of a Boolean operation. `solids` in the frame of the node's
/// child (fillet, chamfer) or of the node (mirror). Errors have no location.
Result<std::vector<Solid>> run_modifier(const CsgNode& node, const std::vector<Solid>& solids,
                                        FaceMemory& faces, Progress& progress);

/// The tight box around solids, without tolerances [mm].
Bnd_Box tight_box(const std::vector<Solid>& solids, const gp_Trsf& pose);

/// Geometry of an edge between its two faces.
struct EdgeCorner {
  bool is_sharp = false;   ///< the normals differ; otherwise all other members are unset
  bool is_convex = false;  ///< material inside the corner
  double turn = 0;         ///< angle between the normals [rad]
};
/// Measured at the middle of the edge. Smooth for a seam, a degenerate edge or one without faces.
EdgeCorner corner_of(const TopoDS_Shape& edge, const TopoDS_Shape& one, const TopoDS_Shape& other);

/// Normalises the sign of an axis: the component of greatest magnitude becomes positive.
gp_Dir axis_direction(const gp_Dir& d);
/// True if both faces lie on the same surface, so that users see no edge between them.
bool are_one_surface(const TopoDS_Face& one, const TopoDS_Face& other);

/// The mirror image at the plane through `offset` times the normal [mm].
gp_Trsf mirror_trsf(const std::array<double, 6>& sizes);

}  // namespace robomosp::csg_occt
