// SPDX-License-Identifier: Apache-2.0
#include "scaling.h"

#include <algorithm>
#include <cmath>

#include <robomosp/sdk/csg_scale.h>

#include <BRepBuilderAPI_GTransform.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_Curve.hxx>
#include <Geom_BSplineCurve.hxx>
#include <Geom_BSplineSurface.hxx>
#include <Geom_Line.hxx>
#include <Geom_Plane.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopTools_MapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <gp_GTrsf.hxx>
#include <gp_Trsf.hxx>

#include "content.h"

namespace robomosp::csg_occt {
namespace {

// What the stretched surfaces enclose against the image of what was enclosed before, relative.
constexpr double kSlack = 1e-6;
// Of a parallelogram's sides that a flat face's surface may miss.
constexpr double kFlat = 1e-13;

using Factors = std::array<double, 3>;

bool is_even(const Factors& f) { return f[0] == f[1] && f[1] == f[2]; }

double greatest_pair(const Factors& f) { return std::max({f[0] * f[1], f[1] * f[2], f[0] * f[2]}); }

/// The flux through a face in a frame whose origin stays: x' = A x and n' dA' = det(A) A^-T n dA,
/// so that x'.n' dA' = det(A) x.n dA.
Integrals image(const Integrals& in, const Factors& f) {
  const double volume = f[0] * f[1] * f[2];
  Integrals out;
  out.volume = in.volume * volume;
  for (std::size_t k = 0; k < 3; ++k) out.first[k] = in.first[k] * volume * f[k];
  constexpr std::array<std::array<std::size_t, 2>, 6> kPairs{
      {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};
  for (std::size_t k = 0; k < 6; ++k)
    out.second[k] = in.second[k] * volume * f[kPairs[k][0]] * f[kPairs[k][1]];
  out.trim_doubt = in.trim_doubt * greatest_pair(f);
  out.area = is_even(f) ? in.area * f[0] * f[0] : 0;
  return out;
}

/// The plane of a face whose surface is a parallelogram.
Handle(Geom_Plane) plane_of(const TopoDS_Face& face, TopLoc_Location& place) {
  const auto surface = Handle(Geom_BSplineSurface)::DownCast(BRep_Tool::Surface(face, place));
  if (surface.IsNull() || surface->UDegree() != 1 || surface->VDegree() != 1 ||
      surface->NbUPoles() != 2 || surface->NbVPoles() != 2 || surface->IsURational() ||
      surface->IsVRational())
    return {};
  const gp_XYZ origin = surface->Pole(1, 1).XYZ();
  const gp_XYZ u = surface->Pole(2, 1).XYZ() - origin, v = surface->Pole(1, 2).XYZ() - origin;
  const gp_XYZ rest = surface->Pole(2, 2).XYZ() - origin - u - v;
  const gp_XYZ normal = u.Crossed(v);
  if (rest.Modulus() > kFlat * (u.Modulus() + v.Modulus()) || !(normal.Modulus() > 0)) return {};
  return new Geom_Plane(gp_Ax3(gp_Pnt(origin), gp_Dir(normal), gp_Dir(u)));
}

/// Flat faces that became splines are made planes again, and straight edges between them lines:
/// what comes after is quicker and more accurate on those, and features tell what they are.
void flatten(const TopoDS_Shape& shape) {
  BRep_Builder builder;
  TopTools_MapOfShape flat;
  for (TopExp_Explorer f(shape, TopAbs_FACE); f.More(); f.Next()) {
    const TopoDS_Face& face = TopoDS::Face(f.Current());
    TopLoc_Location place;
    const Handle(Geom_Plane) plane = plane_of(face, place);
    if (plane.IsNull()) continue;
    // Curves in the face's parameters are worked out of those in space where a face is a plane.
    for (TopExp_Explorer e(face, TopAbs_EDGE); e.More(); e.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(e.Current());
      builder.UpdateEdge(edge, Handle(Geom2d_Curve)(), face, BRep_Tool::Tolerance(edge));
    }
    builder.UpdateFace(face, plane, place, BRep_Tool::Tolerance(face));
    flat.Add(face.Oriented(TopAbs_FORWARD));
  }
  if (flat.IsEmpty()) return;
  TopTools_IndexedDataMapOfShapeListOfShape sides;
  TopExp::MapShapesAndAncestors(shape, TopAbs_EDGE, TopAbs_FACE, sides);
  for (int i = 1; i <= sides.Extent(); ++i) {
    const TopoDS_Edge& edge = TopoDS::Edge(sides.FindKey(i));
    bool is_between = true;
    for (const TopoDS_Shape& face : sides(i))
      is_between = is_between && flat.Contains(face.Oriented(TopAbs_FORWARD));
    if (!is_between || BRep_Tool::Degenerated(edge)) continue;
    TopLoc_Location place;
    double first = 0, last = 0;
    Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, place, first, last);
    while (const auto trimmed = Handle(Geom_TrimmedCurve)::DownCast(curve))
      curve = trimmed->BasisCurve();
    const auto spline = Handle(Geom_BSplineCurve)::DownCast(curve);
    if (spline.IsNull() || spline->Degree() != 1 || spline->NbPoles() != 2 || spline->IsRational())
      continue;
    const gp_Pnt from = spline->Value(first), to = spline->Value(last);
    const double length = from.Distance(to);
    if (!(length > 0)) continue;
    const Handle(Geom_Line) line = new Geom_Line(from, gp_Dir(gp_Vec(from, to)));
    builder.UpdateEdge(edge, line, place, BRep_Tool::Tolerance(edge));
    builder.Range(edge, 0, length);
  }
}

TopoDS_Shape stretched_shape(const TopoDS_Shape& shape, const Factors& factors) {
  if (is_even(factors)) {
    gp_Trsf scale;
    scale.SetScale(gp_Pnt(), factors[0]);
    return BRepBuilderAPI_Transform(shape, scale, true).Shape();
  }
  gp_GTrsf scale;
  for (int k = 0; k < 3; ++k) scale.SetValue(k + 1, k + 1, factors[static_cast<std::size_t>(k)]);
  TopoDS_Shape made = BRepBuilderAPI_GTransform(shape, scale, true).Shape();
  flatten(made);
  return made;
}

Error invalid() {
  return error(ErrorCode::plugin_failed, "the stretched solid is not valid",
               "Scale its parts instead, or use more similar factors.");
}

Result<Solid> stretched_solid(const TopoDS_Shape& shape, const Factors& factors, FaceMemory& faces,
                              const Progress& progress) {
  const TopoDS_Shape made = stretched_shape(shape, factors);
  TopExp_Explorer before(shape, TopAbs_FACE), after(made, TopAbs_FACE);
  double want = 0, got = 0, doubt = 0;
  for (; before.More() && after.More(); before.Next(), after.Next()) {
    if (before.Current().Orientation() != after.Current().Orientation()) return invalid();
    const double sign = before.Current().Orientation() == TopAbs_REVERSED ? -1 : 1;
    Integrals of = image(faces.of_face(TopoDS::Face(before.Current()), progress), factors);
    const TopoDS_Face& face = TopoDS::Face(after.Current());
    const Integrals measured = faces.of_face(face, progress);
    if (!is_even(factors)) of.area = measured.area;
    want += sign * of.volume;
    got += sign * measured.volume;
    doubt += of.trim_doubt + measured.trim_doubt;
    faces.learn(face, of);
  }
  if (before.More() || after.More()) return invalid();
  Solid solid = measured(made, faces, progress);
  const double extent = std::sqrt(solid.box.SquareExtent());
  if (!(std::abs(got - want) <= kSlack * want + doubt * extent) || !is_sound(made))
    return invalid();
  faces.set_verified(made);
  return solid;
}

}  // namespace

Result<std::vector<Solid>> stretched(const std::vector<Solid>& solids, const Factors& factors,
                                     FaceMemory& faces, const Progress& progress) {
  std::vector<Solid> result;
  for (const Solid& solid : solids) {
    if (progress.cancelled()) return cancelled_error();
    const gp_Pnt low = solid.box.CornerMin(), high = solid.box.CornerMax();
    for (int k = 1; k <= 3; ++k)
      if (const double size =
              (high.Coord(k) - low.Coord(k)) * factors[static_cast<std::size_t>(k - 1)];
          size > 2 * kCsgGreatestLength * kMillimetresPerMetre)
        return error(ErrorCode::invalid_argument,
                     "the stretched solid is " + csg_number_text(size / kMillimetresPerMetre) +
                         " m long; at most " + csg_number_text(2 * kCsgGreatestLength) +
                         " m are made",
                     "Give smaller factors.");
    RMP_TRY_ASSIGN(Solid made, stretched_solid(solid.shape, factors, faces, progress));
    result.push_back(std::move(made));
  }
  return result;
}

Result<Solid> ellipsoid(const Factors& half, FaceMemory& faces, const Progress& progress) {
  const double r = std::max({half[0], half[1], half[2]});
  const TopoDS_Shape ball = BRepPrimAPI_MakeSphere(r).Solid();
  if (is_even(half)) return measured(ball, faces);
  RMP_TRY_ASSIGN(Solid solid,
                 stretched_solid(ball, {half[0] / r, half[1] / r, half[2] / r}, faces, progress));
  const TopExp_Explorer found(solid.shape, TopAbs_FACE);
  const TopoDS_Face& face = TopoDS::Face(found.Current());
  Integrals of = faces.of_face(face);
  of.area = ellipsoid_area(half[0], half[1], half[2]);
  faces.learn(face, of);
  return solid;
}

}  // namespace robomosp::csg_occt
