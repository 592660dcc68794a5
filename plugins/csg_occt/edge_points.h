// SPDX-License-Identifier: Apache-2.0
// Points that meshes of neighbouring faces share along an edge (layer: plugin).
#pragma once

#include <vector>

#include <robomosp/sdk/csg.h>

#include <TopoDS_Edge.hxx>
#include <gp_Pnt.hxx>

namespace robomosp::csg_occt {

/// Points along an edge with their parameters, in the direction of the parameter.
struct EdgePoints {
  std::vector<gp_Pnt> points;
  std::vector<double> parameters;
};

/// Those that a neighbouring face has already, else new ones where OCCT's mesher would put them.
/// The edge is not degenerated and oriented forward.
EdgePoints points_along(const TopoDS_Edge& edge, const MeshQuality& quality);

}  // namespace robomosp::csg_occt
