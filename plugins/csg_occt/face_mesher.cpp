// SPDX-License-Identifier: Apache-2.0
#include "face_mesher.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <vector>

#include "edge_points.h"
#include "occt_support.h"
#include "polygon_mesher.h"

#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_Curve.hxx>
#include <Geom_Circle.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_Line.hxx>
#include <Geom_Plane.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <Poly_PolygonOnTriangulation.hxx>
#include <Poly_Triangulation.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Vertex.hxx>

namespace robomosp::csg_occt {
namespace {

Handle(Geom_Surface) basis(Handle(Geom_Surface) surface) {
  while (const auto trimmed = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface))
    surface = trimmed->BasisSurface();
  return surface;
}
Handle(Geom_Curve) basis(Handle(Geom_Curve) curve) {
  while (const auto trimmed = Handle(Geom_TrimmedCurve)::DownCast(curve))
    curve = trimmed->BasisCurve();
  return curve;
}

class PlainFaceMesher {
 public:
  PlainFaceMesher(const TopoDS_Face& face, const MeshQuality& quality)
      : face_(TopoDS::Face(face.Oriented(TopAbs_FORWARD))), quality_(quality) {}

  bool run() {
    TopLoc_Location of_surface;  // triangles are in the face's frame, not in the surface's
    const Handle(Geom_Surface) surface = basis(BRep_Tool::Surface(face_, of_surface));
    place_ = face_.Location();
    to_face_ = place_.Transformation().Inverted();
    if (const auto plane = Handle(Geom_Plane)::DownCast(surface)) {
      frame_ = plane->Position();
      if (!of_surface.IsIdentity()) frame_.Transform(of_surface.Transformation());
    } else {
      is_cylinder_ = true;
      radius_ = Handle(Geom_CylindricalSurface)::DownCast(surface)->Radius();
    }
    for (TopExp_Explorer e(face_, TopAbs_EDGE); e.More(); e.Next())
      if (!add_edge(TopoDS::Edge(e.Current()))) return false;
    if (!link()) return false;
    auto triangles = triangulate_polygon(corners_, next_);
    if (!triangles || triangles->empty()) return false;
    if (is_cylinder_ && !is_fine(*triangles)) return false;
    write(*triangles);
    return true;
  }

 private:
  using Index = std::uint32_t;

  struct Chain {
    TopoDS_Edge edge;
    bool forward = true;
    EdgePoints along;                    // in the direction of the edge's parameter
    std::vector<PolygonCorner> corners;  // the same
    std::vector<Index> nodes;            // the same, once linked
    std::size_t after = 0;               // the chain that follows
    const PolygonCorner& start() const { return forward ? corners.front() : corners.back(); }
    const PolygonCorner& end() const { return forward ? corners.back() : corners.front(); }
  };

  bool add_edge(const TopoDS_Edge& edge) {
    if (edge.Orientation() != TopAbs_FORWARD && edge.Orientation() != TopAbs_REVERSED) return false;
    Chain chain;
    chain.edge = edge;
    chain.forward = edge.Orientation() == TopAbs_FORWARD;
    const TopoDS_Edge bare = TopoDS::Edge(edge.Oriented(TopAbs_FORWARD));
    chain.along = points_along(bare, quality_);
    if (chain.along.points.size() < 2) return false;
    chain.corners.reserve(chain.along.points.size());
    if (is_cylinder_) {
      double first = 0, last = 0;
      const Handle(Geom2d_Curve) trim = BRep_Tool::CurveOnSurface(edge, face_, first, last);
      if (trim.IsNull()) return false;
      for (const double t : chain.along.parameters) {
        const gp_Pnt2d uv = trim->Value(t);
        chain.corners.push_back({-uv.Y(), uv.X()});  // the sweep goes around the axis
      }
    } else {
      // A sweep aligned with nothing meets no two corners at once.
      constexpr double c = 0.8253356149096783, s = 0.5646424733950354;  // of 0.6 rad
      const gp_XYZ x = frame_.XDirection().XYZ() * c + frame_.YDirection().XYZ() * s,
                   y = frame_.YDirection().XYZ() * c - frame_.XDirection().XYZ() * s;
      const gp_XYZ origin = frame_.Location().XYZ();
      if (!frame_.Direct()) return false;
      for (const gp_Pnt& p : chain.along.points) {
        const gp_XYZ q = p.XYZ() - origin;
        chain.corners.push_back({q.Dot(x), q.Dot(y)});
      }
    }
    chains_.push_back(std::move(chain));
    return true;
  }

  static double distance(const PolygonCorner& a, const PolygonCorner& b) {
    return std::max(std::abs(a.x - b.x), std::abs(a.y - b.y));
  }

  // Chains follow each other where they share a vertex; at a seam that is not enough.
  bool link() {
    std::unordered_multimap<const void*, std::size_t> starts;
    const auto vertex = [](const Chain& c, bool at_start) -> const void* {
      const TopoDS_Edge bare = TopoDS::Edge(c.edge.Oriented(TopAbs_FORWARD));
      const TopoDS_Vertex v =
          at_start == c.forward ? TopExp::FirstVertex(bare) : TopExp::LastVertex(bare);
      return v.IsNull() ? nullptr : v.TShape().get();
    };
    for (std::size_t k = 0; k < chains_.size(); ++k) starts.emplace(vertex(chains_[k], true), k);
    std::vector<bool> is_followed(chains_.size(), false);
    std::vector<Index> first(chains_.size());
    // Numbers: each chain's points but its last, which is the first of the chain after it.
    for (std::size_t k = 0; k < chains_.size(); ++k) {
      first[k] = static_cast<Index>(corners_.size());
      Chain& c = chains_[k];
      const std::size_t n = c.corners.size();
      for (std::size_t i = 0; i + 1 < n; ++i) {
        corners_.push_back(c.forward ? c.corners[i] : c.corners[n - 1 - i]);
        points_.push_back(c.forward ? c.along.points[i] : c.along.points[n - 1 - i]);
        next_.push_back(static_cast<Index>(corners_.size()));
      }
      const auto [from, to] = starts.equal_range(vertex(c, false));
      double nearest = 1e-3;  // [mm] or [rad]; only a seam has two to choose from
      c.after = chains_.size();
      for (auto it = from; it != to; ++it)
        if (const double d = distance(c.end(), chains_[it->second].start()); d < nearest) {
          if (c.after < chains_.size()) return false;
          c.after = it->second;
        }
      if (c.after == chains_.size() || is_followed[c.after]) return false;
      is_followed[c.after] = true;
    }
    for (std::size_t k = 0; k < chains_.size(); ++k) {
      Chain& c = chains_[k];
      const std::size_t n = c.corners.size();
      next_[first[k] + n - 2] = first[c.after];
      for (std::size_t i = 0; i + 1 < n; ++i) c.nodes.push_back(first[k] + static_cast<Index>(i));
      c.nodes.push_back(first[c.after]);
      if (!c.forward) std::reverse(c.nodes.begin(), c.nodes.end());
    }
    return true;
  }

  // Around a cylinder a triangle departs from the surface by what its span of angle says.
  bool is_fine(const std::vector<std::array<Index, 3>>& triangles) const {
    const double share = std::min(1.0, quality_.chord * kMillimetresPerMetre / radius_);
    const double widest =
        std::min(2 * std::acos(1 - share), std::max(quality_.angle, kLeastAngle)) * (1 + 1e-6);
    return std::all_of(triangles.begin(), triangles.end(), [&](const auto& t) {
      const auto [low, high] = std::minmax({corners_[t[0]].y, corners_[t[1]].y, corners_[t[2]].y});
      return high - low <= widest;
    });
  }

  void write(const std::vector<std::array<Index, 3>>& triangles) {
    const Handle(Poly_Triangulation) mesh = new Poly_Triangulation(
        static_cast<int>(points_.size()), static_cast<int>(triangles.size()), false);
    const bool is_moved = !place_.IsIdentity();
    for (std::size_t i = 0; i < points_.size(); ++i)
      mesh->SetNode(static_cast<int>(i) + 1,
                    is_moved ? points_[i].Transformed(to_face_) : points_[i]);
    for (std::size_t i = 0; i < triangles.size(); ++i)
      mesh->SetTriangle(static_cast<int>(i) + 1,
                        Poly_Triangle(static_cast<int>(triangles[i][0]) + 1,
                                      static_cast<int>(triangles[i][1]) + 1,
                                      static_cast<int>(triangles[i][2]) + 1));
    mesh->Deflection(quality_.chord * kMillimetresPerMetre);
    BRep_Builder builder;
    builder.UpdateFace(face_, mesh);
    std::vector<Handle(Poly_PolygonOnTriangulation)> polygons;
    for (const Chain& c : chains_) {
      const auto n = static_cast<int>(c.nodes.size());
      const Handle(Poly_PolygonOnTriangulation) polygon = new Poly_PolygonOnTriangulation(n, true);
      for (int i = 1; i <= n; ++i) {
        polygon->SetNode(i, static_cast<int>(c.nodes[static_cast<std::size_t>(i - 1)]) + 1);
        polygon->SetParameter(i, c.along.parameters[static_cast<std::size_t>(i - 1)]);
      }
      polygon->Deflection(quality_.chord * kMillimetresPerMetre);
      polygons.push_back(polygon);
    }
    for (std::size_t k = 0; k < chains_.size(); ++k) {
      const Chain& c = chains_[k];
      std::size_t twin = k;
      if (is_cylinder_)
        for (std::size_t j = 0; j < chains_.size(); ++j)
          if (j != k && chains_[j].edge.IsSame(c.edge)) twin = j;
      if (twin == k) builder.UpdateEdge(c.edge, polygons[k], mesh, place_);
      else if (c.forward) builder.UpdateEdge(c.edge, polygons[k], polygons[twin], mesh, place_);
    }
  }

  static constexpr double kLeastAngle = 1e-3;

  TopoDS_Face face_;
  const MeshQuality& quality_;
  TopLoc_Location place_;
  gp_Trsf to_face_;
  bool is_cylinder_ = false;
  double radius_ = 0;
  gp_Ax3 frame_;
  std::vector<Chain> chains_;
  std::vector<PolygonCorner> corners_;
  std::vector<gp_Pnt> points_;
  std::vector<Index> next_;
};

}  // namespace

bool is_plain_face(const TopoDS_Face& face) {
  TopLoc_Location place;
  const Handle(Geom_Surface) surface = basis(BRep_Tool::Surface(face, place));
  if (surface.IsNull()) return false;
  if (Handle(Geom_Plane)::DownCast(surface).IsNull() &&
      Handle(Geom_CylindricalSurface)::DownCast(surface).IsNull())
    return false;
  for (TopExp_Explorer e(face, TopAbs_EDGE); e.More(); e.Next()) {
    double first = 0, last = 0;
    TopLoc_Location edge_place;
    const TopoDS_Edge& edge = TopoDS::Edge(e.Current());
    if (BRep_Tool::Degenerated(edge)) return false;
    const Handle(Geom_Curve) curve = basis(BRep_Tool::Curve(edge, edge_place, first, last));
    if (curve.IsNull() || (Handle(Geom_Line)::DownCast(curve).IsNull() &&
                           Handle(Geom_Circle)::DownCast(curve).IsNull()))
      return false;
  }
  return true;
}

bool mesh_plain_face(const TopoDS_Face& face, const MeshQuality& quality) {
  return PlainFaceMesher(face, quality).run();
}

}  // namespace robomosp::csg_occt
