// SPDX-License-Identifier: Apache-2.0
#include "modifiers.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include <BOPAlgo_ArgumentAnalyzer.hxx>
#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepAlgoAPI_Cut.hxx>
#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeWire.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepFilletAPI_MakeChamfer.hxx>
#include <BRepFilletAPI_MakeFillet.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRep_Tool.hxx>
#include <GCPnts_AbscissaPoint.hxx>
#include <GC_MakeArcOfCircle.hxx>
#include <GeomAPI_ProjectPointOnCurve.hxx>
#include <Geom_Curve.hxx>
#include <ShapeUpgrade_UnifySameDomain.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>

#include <robomosp/sdk/csg_select.h>

#include "content.h"
#include "primitives.h"

namespace robomosp::csg_occt {
namespace {

// Faces that meet at less than this [rad] are smooth: there is nothing to round.
constexpr double kSmooth = 1e-3;
// Directions and positions are the same within this [rad, share of the size].
constexpr double kAligned = 1e-6;
// The material taken away or added may differ from what straight edges would give by this share:
// corners and bends count.
constexpr double kPlausible = 0.75;
// Prisms cut off along edges take exactly their volume, within this share.
constexpr double kExactCut = 1e-9;

using Test = CsgEdgeTest::Kind;

gp_Vec normal_at(const TopoDS_Edge& edge, const TopoDS_Face& face, double parameter) {
  double first = 0, last = 0;
  const Handle(Geom2d_Curve) trim = BRep_Tool::CurveOnSurface(edge, face, first, last);
  if (trim.IsNull()) return {};
  const gp_Pnt2d uv = trim->Value(parameter);
  gp_Pnt p;
  gp_Vec du, dv;
  BRepAdaptor_Surface(face, false).D1(uv.X(), uv.Y(), p, du, dv);
  gp_Vec n = du.Crossed(dv);
  if (n.Magnitude() < 1e-12) return {};
  n.Normalize();
  return face.Orientation() == TopAbs_REVERSED ? n.Reversed() : n;
}

/// A sharp edge of one of the solids.
struct Edge {
  TopoDS_Edge edge;
  std::size_t solid = 0;
  EdgeCorner corner;
  double length = 0;
};

Bnd_Box box_of(const TopoDS_Edge& edge) {
  Bnd_Box box;
  BRepBndLib::AddOptimal(edge, box, false, false);
  box.SetGap(0);
  return box;
}

class Selector {
 public:
  Selector(const std::vector<Solid>& solids, const std::vector<CsgEdgeTest>& tests)
      : solids_(solids), tests_(tests) {
    const bool asks_extent = std::any_of(tests.begin(), tests.end(), [](const CsgEdgeTest& t) {
      return t.kind >= Test::top && t.kind <= Test::front;
    });
    if (!asks_extent) return;
    whole_ = tight_box(solids, gp_Trsf());
    slack_ = 1e-6 + kAligned * std::sqrt(whole_.SquareExtent());
  }

  std::vector<Edge> run(const Progress& progress) const {
    std::vector<Edge> chosen;
    for (std::size_t s = 0; s < solids_.size(); ++s) {
      if (progress.cancelled()) return {};
      TopTools_IndexedDataMapOfShapeListOfShape faces_of;
      TopExp::MapShapesAndUniqueAncestors(solids_[s].shape, TopAbs_EDGE, TopAbs_FACE, faces_of);
      for (int i = 1; i <= faces_of.Extent(); ++i) {
        const TopTools_ListOfShape& faces = faces_of(i);
        if (faces.Extent() != 2) continue;
        const EdgeCorner corner = corner_of(faces_of.FindKey(i), faces.First(), faces.Last());
        if (!corner.is_sharp) continue;
        Edge edge{TopoDS::Edge(faces_of.FindKey(i)), s, corner, 0};
        if (std::all_of(tests_.begin(), tests_.end(),
                        [&](const CsgEdgeTest& test) { return meets(edge, test.kind); }))
          chosen.push_back(std::move(edge));
      }
    }
    for (const CsgEdgeTest& test : tests_)
      if (test.kind == Test::near && chosen.size() > 1) keep_nearest(chosen, test.point);
    for (Edge& e : chosen) e.length = GCPnts_AbscissaPoint::Length(BRepAdaptor_Curve(e.edge), 1e-3);
    return chosen;
  }

 private:
  bool meets(const Edge& e, Test test) const {
    const BRepAdaptor_Curve curve(e.edge);
    const auto is_along = [&](int axis) {
      if (curve.GetType() != GeomAbs_Line) return false;
      gp_XYZ d = curve.Line().Direction().XYZ();
      d.SetCoord(axis, 0);
      return d.Modulus() <= kAligned;
    };
    const auto is_at = [&](int axis, bool greatest) {
      const Bnd_Box box = box_of(e.edge);
      return greatest ? box.CornerMin().Coord(axis) >= whole_.CornerMax().Coord(axis) - slack_
                      : box.CornerMax().Coord(axis) <= whole_.CornerMin().Coord(axis) + slack_;
    };
    switch (test) {
      case Test::parallel_x: return is_along(1);
      case Test::parallel_y: return is_along(2);
      case Test::parallel_z: return is_along(3);
      case Test::straight: return curve.GetType() == GeomAbs_Line;
      case Test::round: return curve.GetType() == GeomAbs_Circle;
      case Test::convex: return e.corner.is_convex;
      case Test::concave: return !e.corner.is_convex;
      case Test::top: return is_at(3, true);
      case Test::bottom: return is_at(3, false);
      case Test::right: return is_at(1, true);
      case Test::left: return is_at(1, false);
      case Test::back: return is_at(2, true);
      case Test::front: return is_at(2, false);
      case Test::near: return true;
    }
    return false;
  }

  static void keep_nearest(std::vector<Edge>& edges, const Vec3& point) {
    const gp_Pnt p(point[0] * kMillimetresPerMetre, point[1] * kMillimetresPerMetre,
                   point[2] * kMillimetresPerMetre);
    const auto distance = [&](const Edge& e) {
      double first = 0, last = 0;
      const Handle(Geom_Curve) curve = BRep_Tool::Curve(e.edge, first, last);
      double least = std::min(p.Distance(curve->Value(first)), p.Distance(curve->Value(last)));
      const GeomAPI_ProjectPointOnCurve foot(p, curve, first, last);
      if (foot.NbPoints() > 0) least = std::min(least, foot.LowerDistance());
      return least;
    };
    std::size_t best = 0;
    double least = distance(edges[0]);
    for (std::size_t i = 1; i < edges.size(); ++i)
      if (const double d = distance(edges[i]); d < least) {
        least = d;
        best = i;
      }
    edges = {edges[best]};
  }

  const std::vector<Solid>& solids_;
  const std::vector<CsgEdgeTest>& tests_;
  Bnd_Box whole_;
  double slack_ = 0;
};

/// Area of what a straight edge loses (convex) or gains (concave) across.
double section_area(CsgKind kind, double size, double turn) {
  const double inner = std::numbers::pi - turn;  // angle of the corner
  if (kind == CsgKind::chamfer) return size * size * std::sin(inner) / 2;
  return size * size * (1 / std::tan(inner / 2) - turn / 2);
}

bool meets_itself(const TopoDS_Shape& shape) {
  BOPAlgo_ArgumentAnalyzer analyzer;
  analyzer.SetShape1(shape);
  analyzer.ArgumentTypeMode() = false;
  analyzer.SelfInterMode() = true;
  analyzer.SmallEdgeMode() = false;
  analyzer.Perform();
  return analyzer.HasFaulty();
}

/// The solid with the edges worked, or nothing.
std::optional<Solid> worked(CsgKind kind, double size, const Solid& solid,
                            const std::vector<Edge>& edges, FaceMemory& faces) {
  TopoDS_Shape shape;
  double expected = 0, much = 0;
  try {
    TopTools_IndexedDataMapOfShapeListOfShape faces_of;
    TopExp::MapShapesAndUniqueAncestors(solid.shape, TopAbs_EDGE, TopAbs_FACE, faces_of);
    const auto build = [&](auto& maker) {
      for (const Edge& e : edges)
        if (maker.Contour(e.edge) == 0) maker.Add(size, e.edge);
      // Contours go on along edges that are tangent to those chosen.
      for (int c = 1; c <= maker.NbContours(); ++c)
        for (int k = 1; k <= maker.NbEdges(c); ++k) {
          const TopoDS_Edge& edge = maker.Edge(c, k);
          const TopTools_ListOfShape* sides = faces_of.Seek(edge);
          if (!sides || sides->Extent() != 2) continue;
          const EdgeCorner corner = corner_of(edge, sides->First(), sides->Last());
          const double change = section_area(kind, size, corner.turn) *
                                GCPnts_AbscissaPoint::Length(BRepAdaptor_Curve(edge), 1e-3);
          expected += corner.is_convex ? -change : change;
          much += change;
        }
      maker.Build();
      if (maker.IsDone()) shape = maker.Shape();
    };
    if (kind == CsgKind::fillet) {
      BRepFilletAPI_MakeFillet maker(solid.shape);
      build(maker);
    } else {
      BRepFilletAPI_MakeChamfer maker(solid.shape);
      build(maker);
    }
    if (shape.IsNull()) return {};
    TopExp_Explorer found(shape, TopAbs_SOLID);
    if (!found.More()) return {};
    shape = found.Current();
    found.Next();
    if (found.More()) return {};
    // Before the integrals, which take minutes where the outlines of faces run wild.
    if (!is_sound(shape)) return {};
    Solid made = measured(shape, faces);
    if (!(made.volume > 0)) return {};
    if (std::abs(made.volume - solid.volume - expected) > kPlausible * much) return {};
    if (meets_itself(shape)) return {};
    return made;
  } catch (const Standard_Failure&) {
    return {};
  }
}

/// The prism that a fillet or bevel removes along a straight convex edge between two planes; null
/// for other edges.
TopoDS_Shape corner_prism(CsgKind kind, double size, const Edge& e,
                          const TopTools_ListOfShape& sides) {
  const BRepAdaptor_Curve curve(e.edge);
  if (curve.GetType() != GeomAbs_Line || !e.corner.is_convex) return {};
  const double first = curve.FirstParameter(), last = curve.LastParameter();
  const gp_Pnt start = curve.Value(first);
  const double half = (std::numbers::pi - e.corner.turn) / 2;  // of the corner's angle
  const double reach = kind == CsgKind::fillet ? size / std::tan(half) : size;
  const TopoDS_Face faces[] = {TopoDS::Face(sides.First()), TopoDS::Face(sides.Last())};
  gp_Vec inward[2];
  for (std::size_t i = 0; i < 2; ++i) {
    if (BRepAdaptor_Surface(faces[i], false).GetType() != GeomAbs_Plane) return {};
    gp_Vec along(curve.Line().Direction());
    for (TopExp_Explorer found(faces[i], TopAbs_EDGE); found.More(); found.Next())
      if (found.Current().IsSame(e.edge)) {
        if (found.Current().Orientation() == TopAbs_REVERSED) along.Reverse();
        break;
      }
    // The face lies to the left of its edges.
    inward[i] = normal_at(e.edge, faces[i], (first + last) / 2).Crossed(along);
    if (inward[i].Magnitude() < 0.5) return {};
    inward[i].Normalize();
  }
  const gp_Pnt ends[] = {start.Translated(inward[0] * reach), start.Translated(inward[1] * reach)};
  BRepBuilderAPI_MakeWire outline;
  outline.Add(BRepBuilderAPI_MakeEdge(start, ends[0]).Edge());
  if (kind == CsgKind::fillet) {
    const gp_Vec middle = (inward[0] + inward[1]).Normalized();
    const gp_Pnt nearest = start.Translated(middle * (size / std::sin(half) - size));
    outline.Add(
        BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(ends[0], nearest, ends[1]).Value()).Edge());
  } else {
    outline.Add(BRepBuilderAPI_MakeEdge(ends[0], ends[1]).Edge());
  }
  outline.Add(BRepBuilderAPI_MakeEdge(ends[1], start).Edge());
  if (!outline.IsDone()) return {};
  BRepBuilderAPI_MakeFace face(outline.Wire(), true);
  if (!face.IsDone()) return {};
  return BRepPrimAPI_MakePrism(face.Face(), gp_Vec(start, curve.Value(last))).Shape();
}

/// Straight edges worked by cutting prisms off, or nothing. Open CASCADE's own fillets and bevels
/// fail where one is as wide as a face, or two of them meet in a line. Only where the solid loses
/// exactly the prisms: edges that share a corner, or end at faces that are not square to them, are
/// not cut so.
std::optional<Solid> cut_along(CsgKind kind, double size, const Solid& solid,
                               const std::vector<Edge>& edges, FaceMemory& faces) {
  try {
    TopTools_IndexedDataMapOfShapeListOfShape faces_of;
    TopExp::MapShapesAndUniqueAncestors(solid.shape, TopAbs_EDGE, TopAbs_FACE, faces_of);
    TopTools_ListOfShape whole, prisms;
    whole.Append(solid.shape);
    double removed = 0;
    for (const Edge& e : edges) {
      const TopTools_ListOfShape* sides = faces_of.Seek(e.edge);
      if (!sides || sides->Extent() != 2) return {};
      const TopoDS_Shape prism = corner_prism(kind, size, e, *sides);
      if (prism.IsNull()) return {};
      prisms.Append(prism);
      removed += section_area(kind, size, e.corner.turn) * e.length;
    }
    BRepAlgoAPI_Cut cut;
    cut.SetArguments(whole);
    cut.SetTools(prisms);
    cut.Build();
    if (!cut.IsDone() || cut.HasErrors()) return {};
    TopExp_Explorer found(cut.Shape(), TopAbs_SOLID);
    if (!found.More()) return {};
    const TopoDS_Shape shape = found.Current();
    found.Next();
    if (found.More() || !is_sound(shape)) return {};
    Solid made = measured(shape, faces);
    if (!(made.volume > 0)) return {};
    if (std::abs(solid.volume - removed - made.volume) > kExactCut * solid.volume) return {};
    if (meets_itself(shape)) return {};
    return made;
  } catch (const Standard_Failure&) {
    return {};
  }
}

/// Where several faces make one closed band (four quarters of a cylinder), one seam of it stays:
/// Open CASCADE 7.6 does not end when it unites bands of more than two faces. Planes have none.
void keep_seams(ShapeUpgrade_UnifySameDomain& unify, const TopoDS_Shape& shape) {
  TopTools_IndexedDataMapOfShapeListOfShape faces_of;
  TopExp::MapShapesAndUniqueAncestors(shape, TopAbs_EDGE, TopAbs_FACE, faces_of);
  TopTools_IndexedMapOfShape faces;
  std::vector<std::size_t> band;  // of each face, to the first of those joined so far
  const auto number = [&](const TopoDS_Shape& face) {
    const auto i = static_cast<std::size_t>(faces.Add(face)) - 1;
    if (i == band.size()) band.push_back(i);
    return i;
  };
  const auto first_of = [&](std::size_t i) {
    while (band[i] != i) i = band[i] = band[band[i]];
    return i;
  };
  for (int i = 1; i <= faces_of.Extent(); ++i) {
    const TopTools_ListOfShape& sides = faces_of(i);
    if (sides.Extent() != 2) continue;
    const TopoDS_Face one = TopoDS::Face(sides.First()), other = TopoDS::Face(sides.Last());
    if (BRepAdaptor_Surface(one, false).GetType() == GeomAbs_Plane || !are_one_surface(one, other))
      continue;
    const std::size_t a = first_of(number(one)), b = first_of(number(other));
    if (a == b) unify.KeepShape(faces_of.FindKey(i));
    else band[b] = a;
  }
}

/// The solid with faces of one plane, cylinder or other surface that touch made one, and edges of
/// one curve likewise: boxes that are flush have the edges of the prism they make. The solid itself
/// where nothing is to be made one, or where what Open CASCADE makes of it is not sound.
Solid as_one_body(const Solid& solid, FaceMemory& faces) {
  try {
    ShapeUpgrade_UnifySameDomain unify(solid.shape, true, true, false);
    keep_seams(unify, solid.shape);
    unify.Build();
    const auto count = [](const TopoDS_Shape& shape) {
      TopTools_IndexedMapOfShape edges;
      TopExp::MapShapes(shape, TopAbs_EDGE, edges);
      return edges.Extent();
    };
    TopExp_Explorer found(unify.Shape(), TopAbs_SOLID);
    if (!found.More()) return solid;
    const TopoDS_Shape shape = found.Current();
    found.Next();
    if (found.More() || count(shape) == count(solid.shape) || !is_sound(shape)) return solid;
    Solid one = measured(shape, faces);
    return std::abs(one.volume - solid.volume) <= 1e-9 * solid.volume ? one : solid;
  } catch (const Standard_Failure&) {
    return solid;
  }
}

Result<std::vector<Solid>> work_edges(const CsgNode& node, const std::vector<Solid>& given,
                                      FaceMemory& faces, Progress& progress) {
  std::vector<Solid> solids;
  for (const Solid& solid : given) {
    if (progress.cancelled()) return cancelled_error();
    solids.push_back(as_one_body(solid, faces));
  }
  const bool is_fillet = node.kind == CsgKind::fillet;
  RMP_TRY_ASSIGN(const std::vector<CsgEdgeTest> tests, parse_csg_select(node.select));
  const std::vector<Edge> chosen = Selector(solids, tests).run(progress);
  if (progress.cancelled()) return cancelled_error();
  if (chosen.empty())
    return error(ErrorCode::invalid_argument,
                 tests.empty() ? "the solid has no sharp edges"
                               : "no sharp edge is selected by \"" + node.select + "\"",
                 "Choose other edges, or remove the node.");
  std::unique_lock lock(fillet_mutex(), std::defer_lock);
  while (!lock.try_lock_for(std::chrono::milliseconds(20)))
    if (progress.cancelled()) return cancelled_error();
  const double size = node.sizes[0] * kMillimetresPerMetre;
  std::vector<Solid> result;
  for (std::size_t s = 0; s < solids.size(); ++s) {
    if (progress.cancelled()) return cancelled_error();
    std::vector<Edge> edges;
    std::copy_if(chosen.begin(), chosen.end(), std::back_inserter(edges),
                 [&](const Edge& e) { return e.solid == s; });
    if (edges.empty()) {
      result.push_back(solids[s]);
      continue;
    }
    std::optional<Solid> made = worked(node.kind, size, solids[s], edges, faces);
    if (!made) made = cut_along(node.kind, size, solids[s], edges, faces);
    if (!made) {
      if (progress.cancelled()) return cancelled_error();
      const std::string what =
          std::string(is_fillet ? "radius " : "distance ") + csg_number_text(node.sizes[0]) + " m";
      const std::string which =
          edges.size() == 1 ? "the edge" : std::to_string(edges.size()) + " edges";
      const bool is_smaller_right =
          worked(node.kind, size / 8, solids[s], edges, faces).has_value();
      if (is_smaller_right)
        return error(ErrorCode::invalid_argument,
                     "the " + what + " is too large for " + which + " it is applied to",
                     "Make it smaller, or choose other edges.");
      return error(ErrorCode::plugin_failed,
                   "Open CASCADE cannot work on " + which + " with the " + what +
                       ", nor with an eighth of it",
                   "Choose fewer edges: those that meet in one corner at odd angles are the usual "
                   "cause.");
    }
    faces.set_verified(made->shape);
    result.push_back(std::move(*made));
  }
  return result;
}

Result<std::vector<Solid>> mirrored(const CsgNode& node, const std::vector<Solid>& solids,
                                    FaceMemory& faces, const Progress& progress) {
  const gp_Trsf image = mirror_trsf(node.sizes);
  std::vector<Solid> result;
  for (const Solid& solid : solids) {
    if (progress.cancelled()) return cancelled_error();
    TopoDS_Shape shape = BRepBuilderAPI_Transform(solid.shape, image, true).Shape();
    if (faces.of(shape, progress).volume < 0) shape.Reverse();
    result.push_back(measured(shape, faces));
    if (std::abs(result.back().volume - solid.volume) > 1e-9 * solid.volume || !is_sound(shape))
      return error(ErrorCode::plugin_failed, "the mirror image is not a valid solid",
                   "Mirror its parts instead.");
    faces.set_verified(shape);
  }
  return result;
}

}  // namespace

EdgeCorner corner_of(const TopoDS_Shape& shape, const TopoDS_Shape& one,
                     const TopoDS_Shape& other) {
  const TopoDS_Edge& edge = TopoDS::Edge(shape);
  if (BRep_Tool::Degenerated(edge) || one.IsSame(other)) return {};
  const TopoDS_Face &a = TopoDS::Face(one), &b = TopoDS::Face(other);
  double first = 0, last = 0;
  const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, first, last);
  if (curve.IsNull()) return {};
  const double middle = (first + last) / 2;
  gp_Pnt p;
  gp_Vec along;
  curve->D1(middle, p, along);
  const gp_Vec n = normal_at(edge, a, middle), m = normal_at(edge, b, middle);
  if (along.Magnitude() < 1e-12 || n.Magnitude() == 0 || m.Magnitude() == 0) return {};
  for (TopExp_Explorer e(a, TopAbs_EDGE); e.More(); e.Next())
    if (e.Current().IsSame(edge)) {
      if (e.Current().Orientation() == TopAbs_REVERSED) along.Reverse();
      break;
    }
  EdgeCorner corner;
  corner.turn = n.Angle(m);
  corner.is_sharp = corner.turn > kSmooth;
  // The face lies to the left of its edges.
  corner.is_convex = m.Dot(n.Crossed(along)) < 0;
  return corner;
}

gp_Trsf mirror_trsf(const std::array<double, 6>& sizes) {
  const gp_Dir normal(sizes[0], sizes[1], sizes[2]);
  gp_Trsf t;
  t.SetMirror(gp_Ax2(gp_Pnt(normal.XYZ() * (sizes[3] * kMillimetresPerMetre)), normal));
  return t;
}

Result<std::vector<Solid>> run_modifier(const CsgNode& node, const std::vector<Solid>& solids,
                                        FaceMemory& faces, Progress& progress) {
  if (node.kind == CsgKind::mirror) return mirrored(node, solids, faces, progress);
  return work_edges(node, solids, faces, progress);
}

}  // namespace robomosp::csg_occt
