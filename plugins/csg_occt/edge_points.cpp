// SPDX-License-Identifier: Apache-2.0
#include "edge_points.h"

#include <algorithm>

#include "occt_support.h"

#include <BRepAdaptor_Curve.hxx>
#include <BRep_CurveRepresentation.hxx>
#include <BRep_ListIteratorOfListOfCurveRepresentation.hxx>
#include <BRep_TEdge.hxx>
#include <GCPnts_TangentialDeflection.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <Precision.hxx>

namespace robomosp::csg_occt {
namespace {

/// Those that a neighbouring face has already.
bool find_points(const TopoDS_Edge& edge, EdgePoints& out) {
  const Handle(BRep_TEdge)& t = Handle(BRep_TEdge)::DownCast(edge.TShape());
  for (BRep_ListIteratorOfListOfCurveRepresentation it(t->Curves()); it.More(); it.Next()) {
    const Handle(BRep_CurveRepresentation)& r = it.Value();
    if (!r->IsPolygonOnTriangulation()) continue;
    const Handle(Poly_PolygonOnTriangulation)& polygon = r->PolygonOnTriangulation();
    const Handle(Poly_Triangulation)& mesh = r->Triangulation();
    if (!polygon->HasParameters()) continue;
    const gp_Trsf place = (edge.Location() * r->Location()).Transformation();
    const bool is_moved = place.Form() != gp_Identity;
    for (int i = 1; i <= polygon->NbNodes(); ++i) {
      gp_Pnt p = mesh->Node(polygon->Nodes()(i));
      if (is_moved) p.Transform(place);
      out.points.push_back(p);
      out.parameters.push_back(polygon->Parameters()->Value(i));
    }
    return true;
  }
  return false;
}

// As BRepMesh divides an edge: half the quality asked for, at least three chords on a circle.
void make_points(const TopoDS_Edge& edge, const MeshQuality& quality, EdgePoints& out) {
  const BRepAdaptor_Curve curve(edge);
  const double first = curve.FirstParameter(), last = curve.LastParameter();
  if (curve.GetType() == GeomAbs_Line) {
    out.parameters = {first, last};
    out.points = {curve.Value(first), curve.Value(last)};
    return;
  }
  const GCPnts_TangentialDeflection divided(
      curve, first, last, std::max(quality.angle / 2, Precision::Angular()),
      std::max(quality.chord * kMillimetresPerMetre / 2, Precision::Confusion()), 4);
  for (int i = 1; i <= divided.NbPoints(); ++i) {
    out.parameters.push_back(divided.Parameter(i));
    out.points.push_back(divided.Value(i));
  }
}

}  // namespace

EdgePoints points_along(const TopoDS_Edge& edge, const MeshQuality& quality) {
  EdgePoints along;
  if (!find_points(edge, along)) make_points(edge, quality, along);
  return along;
}

}  // namespace robomosp::csg_occt
