// SPDX-License-Identifier: Apache-2.0
#include "primitives.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeRevol.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <BRep_Builder.hxx>
#include <Standard_ConstructionError.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <gp.hxx>
#include <gp_Ax1.hxx>
#include <gp_Circ.hxx>
#include <gp_Trsf.hxx>

namespace robomosp::csg_occt {
namespace {

// Nearer points [mm] are one to OCCT (Precision::Confusion) with some to spare.
constexpr double kConfused = 1e-6;

TopoDS_Shape rounded_box(const TopoDS_Shape& sharp, double radius) {
  if (radius <= 0) return sharp;
  const std::lock_guard lock(fillet_mutex());
  BRepFilletAPI_MakeFillet fillet(sharp);
  TopTools_IndexedMapOfShape edges;
  TopExp::MapShapes(sharp, TopAbs_EDGE, edges);
  for (int i = 1; i <= edges.Extent(); ++i) fillet.Add(radius, TopoDS::Edge(edges(i)));
  fillet.Build();
  if (!fillet.IsDone()) throw Standard_ConstructionError("the fillet could not be built");
  const TopExp_Explorer solid(fillet.Shape(), TopAbs_SOLID);
  if (!solid.More()) throw Standard_ConstructionError("the fillet left no solid");
  return solid.Current();
}

// Its profile turned about the axis: much quicker than the fillet algorithm.
TopoDS_Shape rounded_cylinder(double radius, double height, double fillet) {
  if (radius - fillet < kConfused) fillet = radius;
  const auto at = [](double r, double z) { return gp_Pnt(r, 0, z); };
  const double flat = radius - fillet;
  BRepBuilderAPI_MakeWire wire;
  const auto line = [&](const gp_Pnt& a, const gp_Pnt& b) {
    if (a.Distance(b) >= kConfused) wire.Add(BRepBuilderAPI_MakeEdge(a, b).Edge());
  };
  // Counter-clockwise seen against y, on circles as such: what they sweep is a torus or a sphere
  // by its kind, which is measured and meshed quickly.
  const auto arc = [&](double z, const gp_Pnt& a, const gp_Pnt& b) {
    const gp_Circ circle(gp_Ax2(at(flat, z), gp_Dir(0, -1, 0), gp::DX()), fillet);
    wire.Add(BRepBuilderAPI_MakeEdge(circle, a, b).Edge());
  };
  line(at(0, 0), at(flat, 0));
  arc(fillet, at(flat, 0), at(radius, fillet));
  line(at(radius, fillet), at(radius, height - fillet));
  arc(height - fillet, at(radius, height - fillet), at(flat, height));
  line(at(flat, height), at(0, height));
  line(at(0, height), at(0, 0));
  const TopoDS_Face profile =
      BRepBuilderAPI_MakeFace(gp_Pln(gp::Origin(), gp_Dir(0, -1, 0)), wire.Wire()).Face();
  const TopExp_Explorer solid(BRepPrimAPI_MakeRevol(profile, gp::OZ()).Shape(), TopAbs_SOLID);
  if (!solid.More()) throw Standard_ConstructionError("the fillet left no solid");
  return solid.Current();
}

/// A closed polyhedron; faces are loops of corners, counter-clockwise from outside. Corners at the
/// same place are one, faces that lose their area by that are left out.
TopoDS_Shape polyhedron(const std::vector<gp_Pnt>& corners,
                        const std::vector<std::vector<std::size_t>>& faces) {
  std::vector<std::size_t> first(corners.size());
  std::vector<TopoDS_Vertex> vertices(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    first[i] = i;
    // Only frustums, which have eight corners, collapse sides.
    for (std::size_t k = 0; k < i && k < 8; ++k)
      if (corners[i].IsEqual(corners[k], 0.0)) {
        first[i] = first[k];
        break;
      }
    if (first[i] == i) vertices[i] = BRepBuilderAPI_MakeVertex(corners[i]).Vertex();
  }
  BRep_Builder builder;
  TopoDS_Shell shell;
  builder.MakeShell(shell);
  std::map<std::pair<std::size_t, std::size_t>, TopoDS_Edge> edges;
  for (const auto& face : faces) {
    std::vector<std::size_t> loop;
    for (const std::size_t c : face)
      if (loop.empty() || (first[c] != loop.back() && first[c] != loop.front()))
        loop.push_back(first[c]);
    if (loop.size() < 3) continue;
    TopoDS_Wire wire;
    builder.MakeWire(wire);
    gp_XYZ normal(0, 0, 0);
    for (std::size_t k = 0; k < loop.size(); ++k) {
      const std::size_t a = loop[k], b = loop[(k + 1) % loop.size()];
      normal += (corners[a].XYZ() - corners[loop[0]].XYZ())
                    .Crossed(corners[b].XYZ() - corners[loop[0]].XYZ());
      TopoDS_Edge& edge = edges[std::minmax(a, b)];
      if (edge.IsNull())
        edge = BRepBuilderAPI_MakeEdge(vertices[std::min(a, b)], vertices[std::max(a, b)]).Edge();
      builder.Add(wire, edge.Oriented(a < b ? TopAbs_FORWARD : TopAbs_REVERSED));
    }
    wire.Closed(true);
    const gp_Pln plane(corners[loop[0]], gp_Dir(normal));
    builder.Add(shell, BRepBuilderAPI_MakeFace(plane, wire, false).Face());
  }
  shell.Closed(true);
  TopoDS_Solid solid;
  builder.MakeSolid(solid);
  builder.Add(solid, shell);
  return solid;
}

// The four sides are planar because matching sides of both rectangles are parallel. `top_at` is the
// x of the top's middle.
TopoDS_Shape frustum(double base_x, double base_y, double top_x, double top_y, double height,
                     double top_at = 0) {
  std::vector<gp_Pnt> corners;
  const auto rectangle = [&](double x, double y, double z, double at) {
    for (const int k : {0, 1, 2, 3})
      corners.emplace_back(at + (k == 1 || k == 2 ? x / 2 : -x / 2), k >= 2 ? y / 2 : -y / 2, z);
  };
  rectangle(base_x, base_y, 0, 0);
  rectangle(top_x, top_y, height, top_at);
  std::vector<std::vector<std::size_t>> faces{{3, 2, 1, 0}, {4, 5, 6, 7}};
  for (std::size_t k = 0; k < 4; ++k) faces.push_back({k, (k + 1) % 4, 4 + (k + 1) % 4, 4 + k});
  return polyhedron(corners, faces);
}

TopoDS_Shape pyramid(std::size_t sides, double radius, double top_radius, double height) {
  std::vector<gp_Pnt> corners;
  const auto polygon = [&](double r, double z) {
    for (std::size_t k = 0; k < sides; ++k) {
      const double angle = kCsgFullTurn * static_cast<double>(k) / static_cast<double>(sides);
      corners.emplace_back(r * std::cos(angle), r * std::sin(angle), z);
    }
  };
  polygon(radius, 0);
  const bool is_pointed = top_radius == 0;
  if (is_pointed) corners.emplace_back(0, 0, height);
  else polygon(top_radius, height);
  std::vector<std::vector<std::size_t>> faces(is_pointed ? 1 : 2);
  for (std::size_t k = 0; k < sides; ++k) {
    const std::size_t after = (k + 1) % sides;
    faces[0].insert(faces[0].begin(), k);
    if (!is_pointed) faces[1].push_back(sides + k);
    if (is_pointed) faces.push_back({k, after, sides});
    else faces.push_back({k, after, sides + after, sides + k});
  }
  return polyhedron(corners, faces);
}

}  // namespace

std::timed_mutex& fillet_mutex() {
  static std::timed_mutex mutex;
  return mutex;
}

Result<void> check_kind(const CsgNode& node, std::size_t index) {
  if (node.kind != CsgKind::imported || node.geometry->form != CsgGeometry::Form::mesh) return {};
  return error(ErrorCode::unsupported,
               "the imported solid" +
                   (node.geometry->source.empty() ? "" : " from " + node.geometry->source) +
                   " is a triangle mesh, and this engine works on exact surfaces only",
               "Choose a CSG engine with the tag \"mesh\" (plugin csg_cgal), or import an exact "
               "format such as STEP.",
               csg_node_text(node, index));
}

bool has_content(CsgKind kind) {
  return kind == CsgKind::prism || kind == CsgKind::revolution || kind == CsgKind::imported;
}

std::size_t count_of(double size) { return static_cast<std::size_t>(std::lround(size)); }

std::span<const gp_Trsf> turns_of(CsgKind kind, const std::array<double, 6>& sizes) {
  // Angles that no user aligns a part with.
  const auto make = [](const gp_Dir& axis, std::initializer_list<double> angles) {
    std::vector<gp_Trsf> turns;
    for (const double angle : angles) {
      turns.emplace_back();
      turns.back().SetRotation(gp_Ax1(gp::Origin(), axis), angle);
    }
    return turns;
  };
  static const std::vector<gp_Trsf> about_z = make(gp::DZ(), {0.6161, 2.2733}),
                                    about_centre =
                                        make(gp_Dir(-0.5723, 0.8201, 0), {0.7053, 2.1347});
  switch (kind) {
    case CsgKind::sphere: return about_centre;
    case CsgKind::cylinder:
    case CsgKind::cone:
    case CsgKind::torus: return about_z;
    case CsgKind::revolution:
      if (std::abs(sizes[0]) >= kCsgFullTurn) return about_z;
      return {};
    default: return {};
  }
}

TopoDS_Shape build_primitive(CsgKind kind, const std::array<double, 6>& sizes) {
  std::array<double, 6> s = sizes;
  for (double& x : s) x *= kMillimetresPerMetre;
  switch (kind) {
    case CsgKind::box: {
      const gp_Pnt low(-s[0] / 2, -s[1] / 2, 0);
      return rounded_box(BRepPrimAPI_MakeBox(low, s[0], s[1], s[2]).Solid(), s[3]);
    }
    case CsgKind::cylinder:
      if (s[2] > 0) return rounded_cylinder(s[0], s[1], s[2]);
      return BRepPrimAPI_MakeCylinder(s[0], s[1]).Solid();
    case CsgKind::cone:
      // OCCT has no cone of equal radii; below its own tolerance the difference means nothing.
      if (std::abs(s[0] - s[1]) < 1e-7)
        return BRepPrimAPI_MakeCylinder((s[0] + s[1]) / 2, s[2]).Solid();
      return BRepPrimAPI_MakeCone(s[0], s[1], s[2]).Solid();
    case CsgKind::sphere: return BRepPrimAPI_MakeSphere(s[0]).Solid();
    case CsgKind::torus: return BRepPrimAPI_MakeTorus(s[0], s[1]).Solid();
    case CsgKind::frustum: return frustum(s[0], s[1], s[2], s[3], s[4]);
    case CsgKind::wedge: return frustum(s[0], s[1], s[3], s[1], s[2], (s[3] - s[0]) / 2);
    case CsgKind::pyramid: return pyramid(count_of(sizes[0]), s[1], s[2], s[3]);
    default: throw Standard_ConstructionError("not a primitive");
  }
}

}  // namespace robomosp::csg_occt
