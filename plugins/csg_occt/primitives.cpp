// SPDX-License-Identifier: Apache-2.0
#include "primitives.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <vector>

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakePolygon.hxx>
#include <BRepBuilderAPI_MakeSolid.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepLib.hxx>
#include <BRepPrimAPI_MakeBox.hxx>
#include <BRepPrimAPI_MakeCone.hxx>
#include <BRepPrimAPI_MakeCylinder.hxx>
#include <BRepPrimAPI_MakeRevol.hxx>
#include <BRepPrimAPI_MakeSphere.hxx>
#include <BRepPrimAPI_MakeTorus.hxx>
#include <GC_MakeArcOfCircle.hxx>
#include <Standard_ConstructionError.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Solid.hxx>
#include <gp.hxx>

namespace robomosp::csg_occt {
namespace {

// Nearer points [mm] are one to OCCT (Precision::Confusion) with some to spare.
constexpr double kConfused = 1e-6;

std::string spaced(std::string_view name) {
  std::string s(name);
  std::replace(s.begin(), s.end(), '_', ' ');
  return s;
}

TopoDS_Shape rounded_box(const TopoDS_Shape& sharp, double radius) {
  if (radius <= 0) return sharp;
  // The fillet algorithm keeps state in static variables.
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
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
  const double flat = radius - fillet, bulge = flat + fillet * std::sqrt(0.5),
               dip = fillet * (1 - std::sqrt(0.5));
  BRepBuilderAPI_MakeWire wire;
  const auto line = [&](const gp_Pnt& a, const gp_Pnt& b) {
    if (a.Distance(b) >= kConfused) wire.Add(BRepBuilderAPI_MakeEdge(a, b).Edge());
  };
  const auto arc = [&](const gp_Pnt& a, const gp_Pnt& through, const gp_Pnt& b) {
    wire.Add(BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(a, through, b).Value()).Edge());
  };
  line(at(0, 0), at(flat, 0));
  arc(at(flat, 0), at(bulge, dip), at(radius, fillet));
  line(at(radius, fillet), at(radius, height - fillet));
  arc(at(radius, height - fillet), at(bulge, height - dip), at(flat, height));
  line(at(flat, height), at(0, height));
  line(at(0, height), at(0, 0));
  const TopoDS_Face profile =
      BRepBuilderAPI_MakeFace(gp_Pln(gp::Origin(), gp_Dir(0, -1, 0)), wire.Wire()).Face();
  const TopExp_Explorer solid(BRepPrimAPI_MakeRevol(profile, gp::OZ()).Shape(), TopAbs_SOLID);
  if (!solid.More()) throw Standard_ConstructionError("the fillet left no solid");
  return solid.Current();
}

// The four sides are planar because matching sides of both rectangles are parallel.
TopoDS_Shape frustum(double base_x, double base_y, double top_x, double top_y, double height) {
  const auto corner = [](double x, double y, double z, int k) {
    return gp_Pnt(k == 1 || k == 2 ? x / 2 : -x / 2, k >= 2 ? y / 2 : -y / 2, z);
  };
  BRepBuilderAPI_Sewing sewing;
  const auto add_face = [&](std::initializer_list<gp_Pnt> corners) {
    BRepBuilderAPI_MakePolygon polygon;
    std::vector<gp_Pnt> distinct;
    for (const gp_Pnt& p : corners)
      if (distinct.empty() ||
          (!p.IsEqual(distinct.back(), 0.0) && !p.IsEqual(distinct.front(), 0.0)))
        distinct.push_back(p);
    if (distinct.size() < 3) return;
    for (const gp_Pnt& p : distinct) polygon.Add(p);
    polygon.Close();
    sewing.Add(BRepBuilderAPI_MakeFace(polygon.Wire(), true).Face());
  };
  const auto b = [&](int k) { return corner(base_x, base_y, 0, k % 4); };
  const auto t = [&](int k) { return corner(top_x, top_y, height, k % 4); };
  add_face({b(3), b(2), b(1), b(0)});
  add_face({t(0), t(1), t(2), t(3)});
  for (int k = 0; k < 4; ++k) add_face({b(k), b(k + 1), t(k + 1), t(k)});
  sewing.Perform();
  const TopExp_Explorer shell(sewing.SewedShape(), TopAbs_SHELL);
  if (!shell.More()) throw Standard_ConstructionError("the faces did not close");
  TopoDS_Solid solid = BRepBuilderAPI_MakeSolid(TopoDS::Shell(shell.Current())).Solid();
  if (!BRepLib::OrientClosedSolid(solid))
    throw Standard_ConstructionError("the faces did not close");
  return solid;
}

}  // namespace

std::size_t primitive_size_count(CsgKind kind) { return csg_size_count(kind); }

std::string_view primitive_name(CsgKind kind) { return csg_info(kind).name; }

Result<void> check_primitive(const CsgNode& node, std::size_t index) {
  const auto bad = [&](std::string what) {
    return error(ErrorCode::invalid_argument, std::move(what), {}, node_text(node, index));
  };
  const CsgNodeInfo* row = &csg_info(node.kind);
  if (row->kind != node.kind)
    return bad("kind " + std::to_string(static_cast<int>(node.kind)) +
               " is neither an operation nor a primitive");
  if (node.kind > CsgKind::frustum ||
      (node.kind > CsgKind::intersection && node.kind < CsgKind::box))
    return bad("this engine does not know the kind " + std::string(row->name));
  const auto metres = [](double x) { return number_text(x) + " m"; };
  const std::size_t count = primitive_size_count(node.kind);
  for (std::size_t k = 0; k < count; ++k) {
    const double size = node.sizes[k];
    const std::string name = std::string(row->name) + " " + spaced(row->sizes[k].name);
    const bool zero_ok = row->sizes[k].range == CsgRange::not_negative;
    if (!std::isfinite(size)) return bad(name + " is not a number");
    if (size < 0 && zero_ok) return bad(name + " is " + metres(size) + "; it must not be negative");
    if (size <= 0 && !zero_ok)
      return bad(name + " is " + metres(size) + "; it must be greater than 0");
    if (size != 0 && size < kSmallestLength)
      return bad(name + " is " + metres(size) + "; the smallest length is " +
                 metres(kSmallestLength));
    if (size > kGreatestLength)
      return bad(name + " is " + metres(size) + "; the greatest length is " +
                 metres(kGreatestLength));
  }
  const auto& s = node.sizes;
  const auto check_fillet = [&](double fillet, double smallest, const char* of) -> Result<void> {
    if (fillet < smallest / 2) return {};
    return bad(std::string(row->name) + " fillet is " + metres(fillet) +
               "; it must be less than half the smallest " + of + ", " + metres(smallest / 2));
  };
  if (node.kind == CsgKind::box) return check_fillet(s[3], std::min({s[0], s[1], s[2]}), "side");
  if (node.kind == CsgKind::cylinder)
    return check_fillet(s[2], std::min(2 * s[0], s[1]), "of diameter and height");
  if (node.kind == CsgKind::cone && s[0] == 0 && s[1] == 0)
    return bad("cone base radius and top radius are both 0 m; one must be greater than 0");
  if (node.kind == CsgKind::torus && s[1] >= s[0])
    return bad("torus tube radius is " + metres(s[1]) + "; it must be less than the ring radius, " +
               metres(s[0]));
  return {};
}

bool can_turn(CsgKind kind) { return kind == CsgKind::sphere || kind == CsgKind::torus; }

TopoDS_Shape build_primitive(CsgKind kind, const std::array<double, 6>& sizes, bool turned) {
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
    case CsgKind::sphere: {
      // Any direction that no user aligns a part with.
      const gp_Dir axis = turned ? gp_Dir(0.5318, 0.3711, 0.7613) : gp_Dir(0, 0, 1);
      return BRepPrimAPI_MakeSphere(gp_Ax2(gp_Pnt(0, 0, 0), axis), s[0]).Solid();
    }
    case CsgKind::torus: {
      const gp_Dir seam = turned ? gp_Dir(0.8161, 0.5779, 0) : gp_Dir(1, 0, 0);
      return BRepPrimAPI_MakeTorus(gp_Ax2(gp_Pnt(0, 0, 0), gp_Dir(0, 0, 1), seam), s[0], s[1])
          .Solid();
    }
    case CsgKind::frustum: return frustum(s[0], s[1], s[2], s[3], s[4]);
    default: throw Standard_ConstructionError("not a primitive");
  }
}

}  // namespace robomosp::csg_occt
