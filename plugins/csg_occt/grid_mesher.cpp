// SPDX-License-Identifier: Apache-2.0
#include "grid_mesher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "edge_points.h"
#include "occt_support.h"

#include <BRepAdaptor_Surface.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_Curve.hxx>
#include <Geom2d_Line.hxx>
#include <Geom2d_TrimmedCurve.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>

namespace robomosp::csg_occt {
namespace {

/// Angles [rad] nearer than this are the same.
constexpr double kSameAngle = 1e-9;
/// Share by which rounding may exceed the quality asked for.
constexpr double kRounding = 1e-6;

class GridMesher {
 public:
  GridMesher(const TopoDS_Face& face, const MeshQuality& quality)
      : face_(TopoDS::Face(face.Oriented(TopAbs_FORWARD))),
        quality_(quality),
        chord_(quality.chord * kMillimetresPerMetre),
        surface_(face_, false) {}

  bool run() {
    switch (surface_.GetType()) {
      case GeomAbs_Sphere:
        radius_ = {surface_.Sphere().Radius(), surface_.Sphere().Radius()};
        break;
      case GeomAbs_Torus:
        radius_ = {surface_.Torus().MajorRadius() + surface_.Torus().MinorRadius(),
                   surface_.Torus().MinorRadius()};
        break;
      default: return false;
    }
    for (TopExp_Explorer e(face_, TopAbs_EDGE); e.More(); e.Next())
      if (sides_.size() == 4 || !add_side(TopoDS::Edge(e.Current()))) return false;
    if (sides_.size() != 4 || !sort_sides()) return false;
    if (!choose_angles() || !is_fine()) return false;
    write();
    return true;
  }

 private:
  /// An edge along which one of the two angles is constant.
  struct Side {
    TopoDS_Edge edge;
    std::size_t along = 0;       ///< the angle that varies: 0 = u, 1 = v
    double at = 0;               ///< the other one
    EdgePoints points;           ///< none of a degenerated edge
    std::vector<double> angles;  ///< of the points
    double first = 0, last = 0;  ///< parameters
    bool ascends = true;         ///< the angle grows with the parameter
    [[nodiscard]] bool is_point() const { return points.points.empty(); }
  };

  bool add_side(const TopoDS_Edge& edge) {
    if (edge.Orientation() != TopAbs_FORWARD && edge.Orientation() != TopAbs_REVERSED) return false;
    Side side;
    side.edge = edge;
    Handle(Geom2d_Curve) trim = BRep_Tool::CurveOnSurface(edge, face_, side.first, side.last);
    if (const auto part = Handle(Geom2d_TrimmedCurve)::DownCast(trim)) trim = part->BasisCurve();
    const auto line = Handle(Geom2d_Line)::DownCast(trim);
    if (line.IsNull()) return false;
    const gp_Dir2d way = line->Direction();
    if (std::abs(way.Y()) < kSameAngle) side.along = 0;
    else if (std::abs(way.X()) < kSameAngle) side.along = 1;
    else return false;
    const auto angle = [&](double t, std::size_t which) {
      const gp_Pnt2d uv = line->Value(t);
      return which == 0 ? uv.X() : uv.Y();
    };
    side.at = angle(side.first, 1 - side.along);
    side.ascends = angle(side.last, side.along) > angle(side.first, side.along);
    if (!BRep_Tool::Degenerated(edge)) {
      side.points = points_along(TopoDS::Edge(edge.Oriented(TopAbs_FORWARD)), quality_);
      if (side.points.points.size() < 2) return false;
    }
    for (const double t : side.points.parameters) side.angles.push_back(angle(t, side.along));
    if (!side.ascends) std::reverse(side.angles.begin(), side.angles.end());
    if (side.is_point())
      side.angles = {std::min(angle(side.first, side.along), angle(side.last, side.along)),
                     std::max(angle(side.first, side.along), angle(side.last, side.along))};
    sides_.push_back(std::move(side));
    return true;
  }

  /// Bottom, top (along u), left, right (along v).
  bool sort_sides() {
    std::sort(sides_.begin(), sides_.end(), [](const Side& a, const Side& b) {
      return a.along != b.along ? a.along < b.along : a.at < b.at;
    });
    for (const std::size_t k : {std::size_t{0}, std::size_t{2}}) {
      const Side &low = sides_[k], &high = sides_[k + 1], &across = sides_[2 - k];
      if (low.along != k / 2 || high.along != k / 2 || !(high.at - low.at > kSameAngle))
        return false;
      if (std::abs(across.angles.front() - low.at) > kSameAngle ||
          std::abs(across.angles.back() - high.at) > kSameAngle)
        return false;
    }
    return !sides_[2].is_point() && !sides_[3].is_point();
  }

  static bool agree(const std::vector<double>& a, const std::vector<double>& b) {
    return a.size() == b.size() &&
           std::equal(a.begin(), a.end(), b.begin(),
                      [](double x, double y) { return std::abs(x - y) < kSameAngle; });
  }
  static double widest(const std::vector<double>& angles) {
    double most = 0;
    for (std::size_t i = 1; i < angles.size(); ++i)
      most = std::max(most, angles[i] - angles[i - 1]);
    return most;
  }

  bool choose_angles() {
    const Side &bottom = sides_[0], &top = sides_[1];
    if (!agree(sides_[2].angles, sides_[3].angles)) return false;
    v_ = sides_[2].angles;
    if (bottom.is_point() && top.is_point()) {
      const double u0 = bottom.angles.front(), span = bottom.angles.back() - u0;
      const double count = std::ceil(span / widest(v_) * (1 - kRounding));
      for (int i = 0; i <= static_cast<int>(count); ++i) u_.push_back(u0 + span * i / count);
      return true;
    }
    u_ = bottom.is_point() ? top.angles : bottom.angles;
    return bottom.is_point() || top.is_point() || agree(bottom.angles, top.angles);
  }

  [[nodiscard]] bool is_fine() const {
    const double du = widest(u_), dv = widest(v_);
    return (radius_[0] * du * du + radius_[1] * dv * dv) / 8 <= chord_ * (1 + kRounding) &&
           std::max(du, dv) <= quality_.angle * (1 + kRounding);
  }

  void write() {
    // Where all of a row is one point, every triangle there has a node of its own.
    const auto columns = static_cast<int>(u_.size()), rows = static_cast<int>(v_.size());
    const bool has_south = sides_[0].is_point(), has_north = sides_[1].is_point();
    std::vector<int> row_start;
    int nodes = 0;
    const auto is_point = [&](int j) {
      return (j == 0 && has_south) || (j == rows - 1 && has_north);
    };
    for (int j = 0; j < rows; ++j) {
      row_start.push_back(nodes);
      nodes += is_point(j) ? columns - 1 : columns;
    }
    const auto node = [&](int i, int j) {
      return 1 + row_start[static_cast<std::size_t>(j)] +
             (is_point(j) ? std::min(i, columns - 2) : i);
    };
    const int triangles =
        (columns - 1) * (2 * (rows - 1) - (has_south ? 1 : 0) - (has_north ? 1 : 0));
    const Handle(Poly_Triangulation) mesh = new Poly_Triangulation(nodes, triangles, true);
    const TopLoc_Location place = face_.Location();
    const gp_Trsf to_face = place.Transformation().Inverted();
    const bool is_moved = !place.IsIdentity();
    const auto set = [&](int n, const gp_Pnt& p) {
      mesh->SetNode(n, is_moved ? p.Transformed(to_face) : p);
    };
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < (is_point(j) ? columns - 1 : columns); ++i) {
        const double u = u_[static_cast<std::size_t>(i)], v = v_[static_cast<std::size_t>(j)];
        set(node(i, j), surface_.Value(u, v));
        mesh->SetUVNode(node(i, j), gp_Pnt2d(u, v));
      }
    int t = 0;
    for (int j = 0; j + 1 < rows; ++j)
      for (int i = 0; i + 1 < columns; ++i) {
        const int a = node(i, j), b = node(i + 1, j), c = node(i + 1, j + 1), d = node(i, j + 1);
        if (!is_point(j)) mesh->SetTriangle(++t, Poly_Triangle(a, b, is_point(j + 1) ? d : c));
        if (!is_point(j + 1)) mesh->SetTriangle(++t, Poly_Triangle(a, c, d));
      }
    mesh->Deflection(chord_);

    std::vector<Handle(Poly_PolygonOnTriangulation)> polygons;
    for (std::size_t k = 0; k < sides_.size(); ++k) {
      const Side& side = sides_[k];
      const int count = side.along == 0 ? columns : rows, last = k % 2 == 0 ? 0 : 1;
      const Handle(Poly_PolygonOnTriangulation) polygon =
          new Poly_PolygonOnTriangulation(count, true);
      for (int n = 0; n < count; ++n) {
        const int step = side.ascends ? n : count - 1 - n;
        const int at =
            side.along == 0 ? node(step, last * (rows - 1)) : node(last * (columns - 1), step);
        polygon->SetNode(n + 1, at);
        const double share = static_cast<double>(n) / (count - 1);
        polygon->SetParameter(n + 1, side.is_point()
                                         ? side.first + share * (side.last - side.first)
                                         : side.points.parameters[static_cast<std::size_t>(n)]);
        if (!side.is_point()) set(at, side.points.points[static_cast<std::size_t>(n)]);
      }
      polygon->Deflection(chord_);
      polygons.push_back(polygon);
    }
    BRep_Builder builder;
    builder.UpdateFace(face_, mesh);
    for (std::size_t k = 0; k < sides_.size(); ++k) {
      const std::size_t opposite = k ^ 1U;
      const TopoDS_Edge& edge = sides_[k].edge;
      if (!edge.IsSame(sides_[opposite].edge)) builder.UpdateEdge(edge, polygons[k], mesh, place);
      else if (edge.Orientation() == TopAbs_FORWARD)
        builder.UpdateEdge(edge, polygons[k], polygons[opposite], mesh, place);
    }
  }

  TopoDS_Face face_;
  const MeshQuality& quality_;
  double chord_;  ///< [mm]
  BRepAdaptor_Surface surface_;
  std::array<double, 2> radius_{};  ///< greatest of the circles along u and v [mm]
  std::vector<Side> sides_;
  std::vector<double> u_, v_;
};

}  // namespace

bool mesh_grid_face(const TopoDS_Face& face, const MeshQuality& quality) {
  return GridMesher(face, quality).run();
}

}  // namespace robomosp::csg_occt
