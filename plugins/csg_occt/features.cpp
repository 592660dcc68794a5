// SPDX-License-Identifier: Apache-2.0
// The faces, edges and corners of a solid that other things can be placed on, in an order that does
// not depend on how the solid came about.
#include <algorithm>
#include <cmath>
#include <tuple>

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepGProp.hxx>
#include <BRepTools.hxx>
#include <BRep_Tool.hxx>
#include <GCPnts_AbscissaPoint.hxx>
#include <GProp_GProps.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Vertex.hxx>

#include "engine.h"
#include "modifiers.h"

namespace robomosp::csg_occt {
namespace {

// Positions are ordered in steps of this [m], so that rounding does not change the order.
constexpr double kFeatureOrderStep = 1e-7;
// Surfaces are one when they differ by no more than this [rad, mm].
constexpr double kSameDirection = 1e-9, kSamePlace = 1e-6;

bool is_on(const gp_Ax1& axis, const gp_Ax1& other) {
  return axis.IsParallel(other, kSameDirection) &&
         gp_Vec(axis.Location(), other.Location()).Crossed(gp_Vec(axis.Direction())).Magnitude() <
             kSamePlace;
}

}  // namespace

gp_Dir axis_direction(const gp_Dir& d) {
  double greatest = d.X();
  for (const double c : {d.Y(), d.Z()})
    if (std::abs(c) > std::abs(greatest) + 1e-9) greatest = c;
  return greatest < 0 ? d.Reversed() : d;
}

bool are_one_surface(const TopoDS_Face& one, const TopoDS_Face& other) {
  const BRepAdaptor_Surface a(one, false), b(other, false);
  if (a.GetType() != b.GetType()) return false;
  const auto same = [](double x, double y) { return std::abs(x - y) < kSamePlace; };
  switch (a.GetType()) {
    case GeomAbs_Plane:
      return a.Plane().Axis().IsParallel(b.Plane().Axis(), kSameDirection) &&
             a.Plane().Distance(b.Plane().Location()) < kSamePlace;
    case GeomAbs_Cylinder:
      return is_on(a.Cylinder().Axis(), b.Cylinder().Axis()) &&
             same(a.Cylinder().Radius(), b.Cylinder().Radius());
    case GeomAbs_Cone:
      return is_on(a.Cone().Axis(), b.Cone().Axis()) &&
             a.Cone().Apex().Distance(b.Cone().Apex()) < kSamePlace;
    case GeomAbs_Sphere:
      return a.Sphere().Location().Distance(b.Sphere().Location()) < kSamePlace &&
             same(a.Sphere().Radius(), b.Sphere().Radius());
    case GeomAbs_Torus:
      return is_on(a.Torus().Axis(), b.Torus().Axis()) &&
             a.Torus().Location().Distance(b.Torus().Location()) < kSamePlace &&
             same(a.Torus().MajorRadius(), b.Torus().MajorRadius()) &&
             same(a.Torus().MinorRadius(), b.Torus().MinorRadius());
    default: return false;
  }
}

namespace {

class Lister {
 public:
  Lister(FaceMemory& faces, const Progress& progress) : faces_(faces), progress_(progress) {}

  Result<std::vector<CsgFeature>> run(const std::vector<Solid>& solids, const gp_Trsf& pose) {
    for (const Solid& s : solids) {
      for (TopExp_Explorer e(s.shape, TopAbs_FACE); e.More(); e.Next()) {
        if (progress_.cancelled()) return cancelled_error();
        add_face(TopoDS::Face(e.Current()), pose);
      }
      TopTools_IndexedDataMapOfShapeListOfShape faces_of;
      TopExp::MapShapesAndUniqueAncestors(s.shape, TopAbs_EDGE, TopAbs_FACE, faces_of);
      TopTools_IndexedDataMapOfShapeListOfShape edges_of;  // of corners
      for (int i = 1; i <= faces_of.Extent(); ++i) {
        if (i % 64 == 0 && progress_.cancelled()) return cancelled_error();
        const TopoDS_Edge& edge = TopoDS::Edge(faces_of.FindKey(i));
        const TopTools_ListOfShape& sides = faces_of(i);
        if (BRep_Tool::Degenerated(edge)) {
          add_tip(edge, sides, pose);
          continue;
        }
        if (sides.Extent() == 1 ||
            are_one_surface(TopoDS::Face(sides.First()), TopoDS::Face(sides.Last())))
          continue;
        add_edge(edge, pose);
        const TopoDS_Vertex a = TopExp::FirstVertex(edge), b = TopExp::LastVertex(edge);
        if (a.IsSame(b)) continue;  // where a round edge begins is no corner
        for (const TopoDS_Vertex& v : {a, b}) {
          if (!edges_of.Contains(v)) edges_of.Add(v, TopTools_ListOfShape());
          edges_of.ChangeFromKey(v).Append(edge);
        }
      }
      for (int i = 1; i <= edges_of.Extent(); ++i)
        add_corner(TopoDS::Vertex(edges_of.FindKey(i)), pose);
    }
    const auto step = [](double x) { return std::llround(x / kFeatureOrderStep); };
    const auto key = [&](const CsgFeature& f) {
      return std::tuple(rank(f.kind), step(f.point[2]), step(f.point[1]), step(f.point[0]),
                        step(f.radius), step(f.direction[2]), step(f.direction[1]),
                        step(f.direction[0]), f.inward, step(std::sqrt(f.size)));
    };
    std::stable_sort(features_.begin(), features_.end(),
                     [&](const CsgFeature& a, const CsgFeature& b) { return key(a) < key(b); });
    return std::move(features_);
  }

 private:
  /// Faces, edges, corners.
  static int rank(CsgFeature::Kind kind) {
    switch (kind) {
      case CsgFeature::Kind::line:
      case CsgFeature::Kind::circle: return 1;
      case CsgFeature::Kind::corner: return 2;
      default: return 0;
    }
  }

  void add_face(const TopoDS_Face& face, const gp_Trsf& pose) {
    const BRepAdaptor_Surface surface(face, true);
    const bool is_reversed = face.Orientation() == TopAbs_REVERSED;
    CsgFeature f;
    f.size = faces_.of_face(face).area / (kMillimetresPerMetre * kMillimetresPerMetre);
    double u0 = 0, u1 = 0, v0 = 0, v1 = 0;
    BRepTools::UVBounds(face, u0, u1, v0, v1);
    const double u = (u0 + u1) / 2, v = (v0 + v1) / 2;
    gp_Pnt point = surface.Value(u, v);
    gp_Dir direction;
    bool has_direction = true;
    const auto set = [&](CsgFeature::Kind kind, const gp_Ax3& frame, double radius) {
      f.kind = kind;
      f.radius = radius / kMillimetresPerMetre;
      direction = axis_direction(frame.Direction());
      // The normal of a right-handed surface of these kinds points away from the axis.
      f.inward = is_reversed == frame.Direct();
    };
    const auto foot = [&](const gp_Ax1& axis) {
      const gp_XYZ d = axis.Direction().XYZ(), a = axis.Location().XYZ();
      point = gp_Pnt(a + d * (point.XYZ() - a).Dot(d));
    };
    switch (surface.GetType()) {
      case GeomAbs_Plane: {
        f.kind = CsgFeature::Kind::plane;
        GProp_GProps properties;
        BRepGProp::SurfaceProperties(face, properties);
        point = properties.CentreOfMass();
        const gp_Pln plane = surface.Plane();
        const gp_Ax3& frame = plane.Position();
        direction =
            is_reversed == frame.Direct() ? frame.Direction().Reversed() : frame.Direction();
        break;
      }
      case GeomAbs_Cylinder:
        set(CsgFeature::Kind::cylinder, surface.Cylinder().Position(), surface.Cylinder().Radius());
        foot(surface.Cylinder().Axis());
        break;
      case GeomAbs_Cone:
        foot(surface.Cone().Axis());
        set(CsgFeature::Kind::cone, surface.Cone().Position(), surface.Value(u, v).Distance(point));
        break;
      case GeomAbs_Sphere:
        set(CsgFeature::Kind::sphere, surface.Sphere().Position(), surface.Sphere().Radius());
        point = surface.Sphere().Location();
        has_direction = false;
        break;
      case GeomAbs_Torus:
        set(CsgFeature::Kind::torus, surface.Torus().Position(), surface.Torus().MajorRadius());
        point = surface.Torus().Location();
        f.inward = false;
        break;
      default: has_direction = false; break;
    }
    finish(std::move(f), point, has_direction ? &direction : nullptr, pose);
  }

  void add_edge(const TopoDS_Edge& edge, const gp_Trsf& pose) {
    const BRepAdaptor_Curve curve(edge);
    CsgFeature f;
    f.size = GCPnts_AbscissaPoint::Length(curve) / kMillimetresPerMetre;
    if (curve.GetType() == GeomAbs_Line) {
      f.kind = CsgFeature::Kind::line;
      const gp_Dir along = axis_direction(curve.Line().Direction());
      finish(std::move(f), curve.Value((curve.FirstParameter() + curve.LastParameter()) / 2),
             &along, pose);
    } else if (curve.GetType() == GeomAbs_Circle) {
      f.kind = CsgFeature::Kind::circle;
      f.radius = curve.Circle().Radius() / kMillimetresPerMetre;
      const gp_Dir axis = axis_direction(curve.Circle().Axis().Direction());
      finish(std::move(f), curve.Circle().Location(), &axis, pose);
    }
  }

  /// The apex of a cone is a corner, the pole of a sphere is not.
  void add_tip(const TopoDS_Edge& edge, const TopTools_ListOfShape& sides, const gp_Trsf& pose) {
    for (const TopoDS_Shape& side : sides)
      if (BRepAdaptor_Surface(TopoDS::Face(side), false).GetType() == GeomAbs_Cone)
        return add_corner(TopExp::FirstVertex(edge), pose);
  }

  void add_corner(const TopoDS_Vertex& vertex, const gp_Trsf& pose) {
    CsgFeature f;
    f.kind = CsgFeature::Kind::corner;
    finish(std::move(f), BRep_Tool::Pnt(vertex), nullptr, pose);
  }

  void finish(CsgFeature f, gp_Pnt point, const gp_Dir* direction, const gp_Trsf& pose) {
    point.Transform(pose);
    f.point = metres(point.XYZ());
    if (direction) {
      gp_Dir d = direction->Transformed(pose);
      if (f.kind != CsgFeature::Kind::plane) d = axis_direction(d);
      f.direction = unit(d);
    }
    features_.push_back(std::move(f));
  }

  FaceMemory& faces_;
  const Progress& progress_;
  std::vector<CsgFeature> features_;
};

}  // namespace

Result<std::vector<CsgFeature>> OcctCsgEngine::features(const CsgShape& shape,
                                                        Progress& progress) const {
  return guarded("listing the features", [&]() -> Result<std::vector<CsgFeature>> {
    RMP_TRY_ASSIGN(const OcctShape* own, own_shape(shape));
    const auto claim = gate_.claim(own->lineage(), progress);
    if (!claim || progress.cancelled()) return cancelled_error();
    return Lister(faces_, progress).run(own->solids(), own->pose());
  });
}

}  // namespace robomosp::csg_occt
