// SPDX-License-Identifier: Apache-2.0
// The edges of a solid as curves, each with places, tangents and the normals of its two faces, in
// an order that does not depend on how the solid came about.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>
#include <vector>

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepLProp_SLProps.hxx>
#include <BRep_Tool.hxx>
#include <GCPnts_AbscissaPoint.hxx>
#include <GCPnts_TangentialDeflection.hxx>
#include <Geom2d_Curve.hxx>
#include <TopExp.hxx>
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

/// Positions are ordered in steps of this [m], so that rounding does not change the order.
constexpr double kOrderStep = 1e-7;
/// Between two places [rad], and at most so many on one edge.
constexpr double kMostTurn = std::numbers::pi / 6;
constexpr int kMostPlaces = 10'000;

class Tracer {
 public:
  Tracer(double chord, const gp_Trsf& pose, const Progress& progress)
      : chord_(chord * kMillimetresPerMetre), pose_(pose), progress_(progress) {}

  Result<std::vector<CsgEdge>> run(const std::vector<Solid>& solids) {
    for (const Solid& s : solids) {
      TopTools_IndexedDataMapOfShapeListOfShape faces_of;
      TopExp::MapShapesAndUniqueAncestors(s.shape, TopAbs_EDGE, TopAbs_FACE, faces_of);
      for (int i = 1; i <= faces_of.Extent(); ++i) {
        if (progress_.cancelled()) return cancelled_error();
        const TopoDS_Edge& edge = TopoDS::Edge(faces_of.FindKey(i));
        const TopTools_ListOfShape& sides = faces_of(i);
        if (BRep_Tool::Degenerated(edge) || sides.Extent() != 2) continue;
        const TopoDS_Face one = TopoDS::Face(sides.First()), other = TopoDS::Face(sides.Last());
        if (!are_one_surface(one, other)) add(edge, one, other);
      }
    }
    const auto step = [](double x) { return std::llround(x / kOrderStep); };
    const auto key = [&](const CsgEdge& e) {
      const Vec3 &a = e.points.front().position, &b = e.points.back().position,
                 &m = e.points[e.points.size() / 2].position;
      return std::tuple(e.kind, step(a[2] + b[2]), step(a[1] + b[1]), step(a[0] + b[0]), step(m[2]),
                        step(m[1]), step(m[0]), step(e.length), step(a[2]), step(a[1]), step(a[0]));
    };
    // Keys are made once, and edges moved once: there may be very many.
    std::vector<std::pair<decltype(key(edges_.front())), std::size_t>> order;
    order.reserve(edges_.size());
    for (std::size_t i = 0; i < edges_.size(); ++i) order.emplace_back(key(edges_[i]), i);
    std::sort(order.begin(), order.end());
    std::vector<CsgEdge> sorted;
    sorted.reserve(edges_.size());
    for (const auto& [known, i] : order) sorted.push_back(std::move(edges_[i]));
    return sorted;
  }

 private:
  void add(const TopoDS_Edge& edge, const TopoDS_Face& one, const TopoDS_Face& other) {
    const BRepAdaptor_Curve curve(edge);
    const double first = curve.FirstParameter(), last = curve.LastParameter();
    CsgEdge e;
    e.is_closed = TopExp::FirstVertex(edge).IsSame(TopExp::LastVertex(edge));
    e.length = GCPnts_AbscissaPoint::Length(curve) / kMillimetresPerMetre;
    std::vector<double> at;
    bool is_backwards = false;
    if (curve.GetType() == GeomAbs_Line) {
      e.kind = CsgEdge::Kind::line;
      const gp_Dir along = curve.Line().Direction().Transformed(pose_);
      is_backwards = !axis_direction(along).IsEqual(along, 1e-3);
      at = {first, last};
    } else if (curve.GetType() == GeomAbs_Circle) {
      e.kind = CsgEdge::Kind::circle;
      const gp_Circ circle = curve.Circle().Transformed(pose_);
      const gp_Dir about = circle.Axis().Direction();
      is_backwards = !axis_direction(about).IsEqual(about, 1e-3);
      e.centre = metres(circle.Location().XYZ());
      e.axis = unit(axis_direction(about));
      e.radius = circle.Radius() / kMillimetresPerMetre;
      e.angle = last - first;
      const double share = std::clamp(1 - chord_ / circle.Radius(), -1.0, 1.0);
      const double turn = std::clamp(2 * std::acos(share), e.angle / kMostPlaces, kMostTurn);
      const int count = std::max(1, static_cast<int>(std::ceil(e.angle / turn)));
      for (int i = 0; i <= count; ++i) at.push_back(first + e.angle * i / count);
    } else {
      const GCPnts_TangentialDeflection places(curve, kMostTurn,
                                               std::max(chord_, 1e-7 * e.length * 1e3), 3);
      for (int i = 1; i <= places.NbPoints(); ++i) at.push_back(places.Parameter(i));
    }
    if (is_backwards) std::reverse(at.begin(), at.end());
    const Side sides[] = {Side(edge, one), Side(edge, other)};
    for (const double t : at) {
      gp_Pnt position;
      gp_Vec tangent;
      curve.D1(t, position, tangent);
      CsgEdgePoint p;
      if (tangent.Magnitude() > 0) {
        const gp_Dir d = gp_Dir(is_backwards ? tangent.Reversed() : tangent).Transformed(pose_);
        p.tangent = unit(d);
      }
      p.position = metres(position.Transformed(pose_).XYZ());
      for (std::size_t s = 0; s < 2; ++s)
        if (const auto n = sides[s].normal(t, first, last))
          p.normals[s] = unit(n->Transformed(pose_));
      e.points.push_back(p);
    }
    // The face that looks further up comes first, of two alike the one further in y, then in x.
    const auto step = [](double x) { return std::llround(x / kOrderStep); };
    const auto rank = [&](const Vec3& n) { return std::tuple(step(n[2]), step(n[1]), step(n[0])); };
    const auto& start = e.points.front().normals;
    if (rank(start[0]) < rank(start[1]))
      for (CsgEdgePoint& p : e.points) std::swap(p.normals[0], p.normals[1]);
    edges_.push_back(std::move(e));
  }

  /// A face beside an edge.
  class Side {
   public:
    Side(const TopoDS_Edge& edge, const TopoDS_Face& face)
        : surface_(face), is_reversed_(face.Orientation() == TopAbs_REVERSED) {
      double first = 0, last = 0;
      path_ = BRep_Tool::CurveOnSurface(edge, face, first, last);
    }
    /// Outward. At a pole, where there is none, that of a place nearby on the edge.
    [[nodiscard]] std::optional<gp_Dir> normal(double t, double first, double last) const {
      if (path_.IsNull()) return {};
      for (const double share : {0.0, 1e-6, 1e-3}) {
        const gp_Pnt2d uv = path_->Value(t + share * ((first + last) / 2 - t));
        BRepLProp_SLProps properties(surface_, uv.X(), uv.Y(), 1, 1e-9);
        if (properties.IsNormalDefined())
          return is_reversed_ ? properties.Normal().Reversed() : properties.Normal();
      }
      return {};
    }

   private:
    BRepAdaptor_Surface surface_;
    Handle(Geom2d_Curve) path_;
    bool is_reversed_;
  };

  double chord_;  ///< [mm]
  gp_Trsf pose_;
  const Progress& progress_;
  std::vector<CsgEdge> edges_;
};

}  // namespace

Result<std::vector<CsgEdge>> OcctCsgEngine::edges(const CsgShape& shape, double chord,
                                                  Progress& progress) const {
  if (!(chord > 0) || !std::isfinite(chord))
    return error(ErrorCode::invalid_argument, "the chord is not a length above 0", "", "chord");
  return guarded("listing the edges", [&]() -> Result<std::vector<CsgEdge>> {
    RMP_TRY_ASSIGN(const OcctShape* own, own_shape(shape));
    const auto claim = gate_.claim(own->lineage(), progress);
    if (!claim || progress.cancelled()) return cancelled_error();
    return Tracer(chord, own->pose(), progress).run(own->solids());
  });
}

const void* OcctCsgEngine::extension(const char* id) const {
  return std::string_view(id) == CsgEdges::kExtensionId ? static_cast<const CsgEdges*>(this)
                                                        : nullptr;
}

}  // namespace robomosp::csg_occt
