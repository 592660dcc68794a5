// SPDX-License-Identifier: Apache-2.0
#include "grid_mesher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "edge_points.h"
#include "occt_support.h"

#include <Adaptor3d_Curve.hxx>
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
#include <gp_Circ.hxx>
#include <gp_Lin.hxx>

namespace robomosp::csg_occt {
namespace {

/// Angles [rad] nearer than this are the same.
constexpr double kSameAngle = 1e-9;
/// Share by which rounding may exceed the quality asked for.
constexpr double kRounding = 1e-6;
/// Greatest ratio of a cone's rings that follow each other.
constexpr double kWidening = 4;

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
      case GeomAbs_Cone: is_cone_ = true; break;
      case GeomAbs_SurfaceOfRevolution:
        if (!measure_revolution()) return false;
        break;
      default: return false;
    }
    for (TopExp_Explorer e(face_, TopAbs_EDGE); e.More(); e.Next())
      if (sides_.size() == 4 || !add_side(TopoDS::Edge(e.Current()))) return false;
    if (sides_.size() != 4 || !sort_sides()) return false;
    if (is_cone_) return run_cone();
    if (choose_angles()) {
      if (!is_fine()) return false;
      write();
      return true;
    }
    return run_rings();
  }

 private:
  /// Radii of what an arc of a circle sweeps whose plane holds the axis, so that v is an angle.
  bool measure_revolution() {
    const Handle(Adaptor3d_Curve) meridian = surface_.BasisCurve();
    if (meridian->GetType() != GeomAbs_Circle) return false;
    const gp_Circ circle = meridian->Circle();
    const gp_Ax1 axis = surface_.AxeOfRevolution();
    const double off = gp_Vec(circle.Location(), axis.Location()).Dot(circle.Axis().Direction());
    if (std::abs(axis.Direction().Dot(circle.Axis().Direction())) > kSameAngle ||
        std::abs(off) > kSameAngle * circle.Radius())
      return false;
    radius_ = {gp_Lin(axis).Distance(circle.Location()) + circle.Radius(), circle.Radius()};
    return true;
  }

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

  /// A circle of a face, or a tip or pole.
  struct Ring {
    double v = 0;
    std::vector<double> u;
    bool is_tip = false;
    int first = 0;  ///< number of its first node
    [[nodiscard]] int count() const { return static_cast<int>(u.size()) - (is_tip ? 1 : 0); }
    [[nodiscard]] int node(std::size_t i) const {
      return 1 + first + std::min(static_cast<int>(i), count() - 1);
    }
  };

  /// Rings of a cone between its two rims. The rims are given, and have as few corners as their
  /// radii need; so few along a wider ring would leave the surface, so that each is at most a few
  /// times as wide as the one before. However long the cone, there are no others: its sides are
  /// straight.
  bool run_cone() {
    const Side &bottom = sides_[0], &top = sides_[1], &left = sides_[2], &right = sides_[3];
    if (bottom.is_point() && top.is_point()) return false;
    const auto radius = [&](double v) {
      return std::abs(surface_.Cone().RefRadius() + v * std::sin(surface_.Cone().SemiAngle()));
    };
    std::vector<Ring> rings(2);
    rings[0] = {bottom.at, bottom.angles, bottom.is_point()};
    rings[1] = {top.at, top.angles, top.is_point()};
    if (bottom.is_point()) rings[0].u = top.angles;
    if (top.is_point()) rings[1].u = bottom.angles;
    // Rings within are corners of the seam, which is no other face's; other sides have none.
    const bool is_whole = left.edge.IsSame(right.edge);
    const double r0 = radius(bottom.at), r1 = radius(top.at);
    const double low = std::min(r0, r1), high = std::max(r0, r1);
    if (!bottom.is_point() && !top.is_point() && high > kWidening * low) {
      if (!is_whole || !(low > 0)) return false;
      const int steps = static_cast<int>(std::ceil(std::log(high / low) / std::log(kWidening)));
      const double from = rings[0].u.front(), span = rings[0].u.back() - from;
      std::vector<Ring> inner;
      for (int i = 1; i < steps; ++i) {
        const double share = static_cast<double>(i) / steps;
        const double r = r0 * std::pow(r1 / r0, share);
        Ring ring;
        ring.v = bottom.at + (top.at - bottom.at) * (r - r0) / (r1 - r0);
        const double widest =
            std::min(quality_.angle, 2 * std::acos(1 - std::min(1.0, chord_ / r)));
        const int count = std::max(3, static_cast<int>(std::ceil(span / std::max(widest, 1e-3))));
        for (int k = 0; k <= count; ++k) ring.u.push_back(from + span * k / count);
        inner.push_back(std::move(ring));
      }
      rings.insert(rings.begin() + 1, inner.begin(), inner.end());
    }
    if (left.points.points.size() != 2 || right.points.points.size() != 2) return false;
    for (std::size_t k = 0; k < 2; ++k)
      for (const double at : {sides_[2].at, sides_[3].at}) {
        const auto& u = rings[k == 0 ? 0 : rings.size() - 1].u;
        if (std::abs((at == sides_[2].at ? u.front() : u.back()) - at) > kSameAngle) return false;
      }
    write_rings(rings);
    return true;
  }

  /// Rims of different radii need different numbers of corners: rings between them have those of
  /// the finer one.
  bool run_rings() {
    const Side &bottom = sides_[0], &top = sides_[1], &left = sides_[2], &right = sides_[3];
    if (bottom.is_point() || top.is_point() || !agree(left.angles, right.angles)) return false;
    const auto& finer = bottom.angles.size() > top.angles.size() ? bottom.angles : top.angles;
    for (const Side* rim : {&bottom, &top})
      if (std::abs(rim->angles.front() - left.at) > kSameAngle ||
          std::abs(rim->angles.back() - right.at) > kSameAngle)
        return false;
    v_ = left.angles;
    if (v_.size() < 3) return false;
    // A coarse rim's side is the one of a triangle that gets narrower towards the next ring: how
    // far the surface bulges over it is greatest at the rim unless the next ring is far wider.
    const auto rim_radius = [&](std::size_t rim, std::size_t next) {
      const double r = distance_from_axis(v_[rim]), more = distance_from_axis(v_[next]) - r;
      return more <= 2 * r ? r : 4 * std::pow(r + more, 3) / (27 * more * more);
    };
    const double dv = widest(v_), du = widest(finer);
    const auto fits = [&](double radius, double across) {
      return (radius * across * across + radius_[1] * dv * dv) / 8 <= chord_ * (1 + kRounding) &&
             std::max(across, dv) <= quality_.angle * (1 + kRounding);
    };
    if (!fits(radius_[0], du) || !fits(rim_radius(0, 1), widest(bottom.angles)) ||
        !fits(rim_radius(v_.size() - 1, v_.size() - 2), widest(top.angles)))
      return false;
    std::vector<Ring> rings;
    for (const double v : v_) rings.push_back({v, finer});
    rings.front().u = bottom.angles;
    rings.back().u = top.angles;
    write_rings(rings);
    return true;
  }

  [[nodiscard]] double distance_from_axis(double v) const {
    const gp_Ax1 axis = surface_.GetType() == GeomAbs_Torus    ? surface_.Torus().Axis()
                        : surface_.GetType() == GeomAbs_Sphere ? surface_.Sphere().Position().Axis()
                                                               : surface_.AxeOfRevolution();
    return gp_Lin(axis).Distance(surface_.Value(sides_[2].at, v));
  }

  void write_rings(std::vector<Ring>& rings) {
    int nodes = 0;
    for (Ring& r : rings) {
      r.first = nodes;
      nodes += r.count();
    }
    // Between two rings the next corner is that of the ring whose next one is nearer.
    std::vector<Poly_Triangle> triangles;
    for (std::size_t k = 0; k + 1 < rings.size(); ++k) {
      const Ring &a = rings[k], &b = rings[k + 1];
      std::size_t i = 0, j = 0;
      while (i + 1 < a.u.size() || j + 1 < b.u.size()) {
        const bool on_a = j + 1 == b.u.size() || (i + 1 < a.u.size() && a.u[i + 1] <= b.u[j + 1]);
        if (on_a) {
          // The tip has a node for each triangle, whose normals differ.
          if (!a.is_tip)
            triangles.emplace_back(a.node(i), a.node(i + 1), b.is_tip ? b.node(i) : b.node(j));
          ++i;
        } else {
          if (!b.is_tip)
            triangles.emplace_back(a.is_tip ? a.node(j) : a.node(i), b.node(j + 1), b.node(j));
          ++j;
        }
      }
    }
    const Handle(Poly_Triangulation) mesh =
        new Poly_Triangulation(nodes, static_cast<int>(triangles.size()), true);
    const TopLoc_Location place = face_.Location();
    const gp_Trsf to_face = place.Transformation().Inverted();
    const bool is_moved = !place.IsIdentity();
    const auto set = [&](int n, const gp_Pnt& p) {
      mesh->SetNode(n, is_moved ? p.Transformed(to_face) : p);
    };
    for (const Ring& r : rings)
      for (int i = 0; i < r.count(); ++i) {
        const double u = r.u[static_cast<std::size_t>(i)];
        set(r.node(static_cast<std::size_t>(i)), surface_.Value(u, r.v));
        mesh->SetUVNode(r.node(static_cast<std::size_t>(i)), gp_Pnt2d(u, r.v));
      }
    for (std::size_t i = 0; i < triangles.size(); ++i)
      mesh->SetTriangle(static_cast<int>(i) + 1, triangles[i]);
    mesh->Deflection(chord_);

    std::vector<Handle(Poly_PolygonOnTriangulation)> polygons;
    for (std::size_t k = 0; k < sides_.size(); ++k) {
      const Side& side = sides_[k];
      const Ring& rim = k == 0 ? rings.front() : rings.back();
      const std::size_t count = side.along == 0 ? rim.u.size() : rings.size();
      const Handle(Poly_PolygonOnTriangulation) polygon =
          new Poly_PolygonOnTriangulation(static_cast<int>(count), true);
      for (std::size_t n = 0; n < count; ++n) {
        const std::size_t step = side.ascends ? n : count - 1 - n;
        const Ring& ring = side.along == 0 ? rim : rings[step];
        const int at = side.along == 0 ? rim.node(step) : ring.node(k == 2 ? 0 : ring.u.size() - 1);
        polygon->SetNode(static_cast<int>(n) + 1, at);
        double parameter = side.first;
        if (side.along == 1 && side.points.points.size() == count) {
          parameter = side.points.parameters[n];
          set(at, side.points.points[n]);
        } else if (side.along == 1) {
          const double share = (ring.v - rings.front().v) / (rings.back().v - rings.front().v);
          parameter += (side.ascends ? share : 1 - share) * (side.last - side.first);
        } else if (side.is_point()) {
          parameter +=
              static_cast<double>(n) / static_cast<double>(count - 1) * (side.last - side.first);
        } else {
          parameter = side.points.parameters[n];
          set(at, side.points.points[n]);
        }
        polygon->SetParameter(static_cast<int>(n) + 1, parameter);
      }
      polygon->Deflection(chord_);
      polygons.push_back(polygon);
    }
    attach(mesh, place, polygons);
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
    attach(mesh, place, polygons);
  }

  void attach(const Handle(Poly_Triangulation) & mesh, const TopLoc_Location& place,
              const std::vector<Handle(Poly_PolygonOnTriangulation)>& polygons) {
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
  bool is_cone_ = false;
  std::array<double, 2> radius_{};  ///< greatest of the circles along u and v [mm]
  std::vector<Side> sides_;
  std::vector<double> u_, v_;
};

}  // namespace

bool mesh_grid_face(const TopoDS_Face& face, const MeshQuality& quality) {
  return GridMesher(face, quality).run();
}

}  // namespace robomosp::csg_occt
