// SPDX-License-Identifier: Apache-2.0
#include "sewing.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_MakeSolid.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepClass3d_SolidClassifier.hxx>
#include <BRepGProp.hxx>
#include <BRepLib.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Bnd_Box.hxx>
#include <GProp_GProps.hxx>
#include <Precision.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_DataMapOfShapeInteger.hxx>
#include <TopTools_IndexedDataMapOfShapeListOfShape.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopTools_ShapeMapHasher.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Iterator.hxx>

namespace robomosp::cad_exchange {
namespace {

/// Gaps up to these shares of the size are closed where faces are joined to a solid.
constexpr double kShares[] = {1e-6, 1e-5, 1e-4};
/// Open CASCADE's own resolution [mm].
constexpr double kResolution = 1e-6;

Bnd_Box box_of(const TopoDS_Shape& s) {
  Bnd_Box box;
  BRepBndLib::Add(s, box);
  return box;
}

double size_of(const std::vector<TopoDS_Face>& faces) {
  Bnd_Box box;
  for (const TopoDS_Face& f : faces) BRepBndLib::Add(f, box);
  return box.IsVoid() ? 0 : std::sqrt(box.SquareExtent());
}

TopoDS_Shape sewed(const std::vector<TopoDS_Face>& faces, double tolerance, bool by_all,
                   BRepBuilderAPI_Sewing& sewing) {
  sewing.Init(tolerance, true, true, true, by_all);
  for (const TopoDS_Face& f : faces) sewing.Add(f);
  sewing.Perform();
  return sewing.SewedShape();
}

/// Every edge is run as often forwards as backwards, and by no more than two faces: then it bounds
/// one body. Closed() of Open CASCADE is true of shells of several bodies that touch as well.
bool bounds_a_body(const TopoDS_Shape& shell) {
  TopTools_IndexedMapOfShape edges;
  TopExp::MapShapes(shell, TopAbs_EDGE, edges);
  std::vector<int> uses(static_cast<std::size_t>(edges.Extent()), 0);
  for (TopExp_Explorer f(shell, TopAbs_FACE); f.More(); f.Next())
    for (TopExp_Explorer e(f.Current(), TopAbs_EDGE); e.More(); e.Next())
      ++uses[static_cast<std::size_t>(edges.FindIndex(e.Current()) - 1)];
  for (int i = 1; i <= edges.Extent(); ++i)
    if (!BRep_Tool::Degenerated(TopoDS::Edge(edges(i))) &&
        uses[static_cast<std::size_t>(i - 1)] != 2)
      return false;
  return edges.Extent() > 0;
}

double volume_of(const TopoDS_Shape& s) {
  GProp_GProps g;
  BRepGProp::VolumeProperties(s, g);
  return g.Mass();
}

/// Indices of faces that close one after the other, a run for each body: found among the edges that
/// the faces share when any number of them may.
std::vector<std::vector<std::size_t>> runs_that_close(const std::vector<TopoDS_Face>& faces,
                                                      double tolerance) {
  BRepBuilderAPI_Sewing sewing;
  const TopoDS_Shape all = sewed(faces, tolerance, true, sewing);
  if (all.IsNull()) return {};
  TopTools_IndexedMapOfShape edges;
  TopExp::MapShapes(all, TopAbs_EDGE, edges);
  std::vector<std::vector<std::size_t>> runs;
  std::vector<std::size_t> run;
  std::map<int, int> open;  // uses of the edges of this run that are not two
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const TopoDS_Shape now = sewing.IsModifiedSubShape(faces[i]) ? sewing.ModifiedSubShape(faces[i])
                                                                 : TopoDS_Shape(faces[i]);
    for (TopExp_Explorer e(now, TopAbs_EDGE); e.More(); e.Next()) {
      const TopoDS_Edge edge = TopoDS::Edge(e.Current());
      if (BRep_Tool::Degenerated(edge)) continue;
      const int key = edges.FindIndex(edge);
      if (key == 0) continue;
      if (++open[key] == 2) open.erase(key);
    }
    run.push_back(i);
    if (open.empty()) {
      runs.push_back(std::move(run));
      run.clear();
    }
  }
  return runs;
}

/// The closed shells of these faces; what is left stays in `faces`.
std::vector<TopoDS_Shell> take_closed(std::vector<TopoDS_Face>& faces, double tolerance) {
  BRepBuilderAPI_Sewing sewing;
  const TopoDS_Shape all = sewed(faces, tolerance, false, sewing);
  std::vector<TopoDS_Shell> closed;
  if (all.IsNull()) return closed;
  TopTools_IndexedMapOfShape used;
  const auto take = [&](const TopoDS_Shell& shell) {
    if (!bounds_a_body(shell)) return;
    closed.push_back(shell);
    TopExp::MapShapes(shell, TopAbs_FACE, used);
  };
  for (TopExp_Explorer e(all, TopAbs_SHELL); e.More(); e.Next()) take(TopoDS::Shell(e.Current()));
  // A face that closes on itself, such as a sphere, is in no shell.
  for (TopExp_Explorer e(all, TopAbs_FACE, TopAbs_SHELL); e.More(); e.Next()) {
    TopoDS_Shell shell;
    BRep_Builder builder;
    builder.MakeShell(shell);
    builder.Add(shell, e.Current());
    shell.Closed(true);
    take(shell);
  }
  std::erase_if(faces, [&](const TopoDS_Face& f) {
    return used.Contains(sewing.IsModifiedSubShape(f) ? sewing.ModifiedSubShape(f)
                                                      : TopoDS_Shape(f));
  });
  return closed;
}

/// Solids of closed shells; one inside another is its cavity, one inside that a solid again.
void add_solids(const std::vector<TopoDS_Shell>& shells, Sewn& out) {
  struct Body {
    TopoDS_Solid solid;
    Bnd_Box box;
    double volume = 0;
    std::size_t depth = 0;
    std::size_t inside = 0;  ///< of the innermost around it
  };
  std::vector<Body> bodies;
  for (const TopoDS_Shell& shell : shells) {
    Body b;
    b.solid = BRepBuilderAPI_MakeSolid(shell).Solid();
    BRepLib::OrientClosedSolid(b.solid);
    b.box = box_of(b.solid);
    b.volume = volume_of(b.solid);
    if (b.volume < 0) {
      b.solid.Reverse();
      b.volume = -b.volume;
    }
    bodies.push_back(std::move(b));
  }
  std::stable_sort(bodies.begin(), bodies.end(),
                   [](const Body& a, const Body& b) { return a.volume > b.volume; });
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    // Two points, since one may lie where bodies touch.
    std::vector<gp_Pnt> points;
    for (TopExp_Explorer e(bodies[i].solid, TopAbs_EDGE); e.More() && points.size() < 2; e.Next()) {
      const TopoDS_Edge edge = TopoDS::Edge(e.Current());
      double from = 0, to = 0;
      if (BRep_Tool::Degenerated(edge)) continue;
      const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, from, to);
      if (!curve.IsNull()) points.push_back(curve->Value(0.47 * from + 0.53 * to));
    }
    for (std::size_t k = 0; k < i && !points.empty(); ++k) {
      if (bodies[k].box.IsOut(bodies[i].box)) continue;
      BRepClass3d_SolidClassifier where(bodies[k].solid);
      const bool is_in = std::all_of(points.begin(), points.end(), [&](const gp_Pnt& p) {
        where.Perform(p, Precision::Confusion());
        return where.State() == TopAbs_IN;
      });
      if (!is_in) continue;
      bodies[i].depth = std::max(bodies[i].depth, bodies[k].depth + 1);
      bodies[i].inside = k;  // the smallest comes last
    }
  }
  std::vector<std::size_t> at(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].depth % 2 == 1) {
      BRep_Builder builder;
      TopoDS_Solid& around = out.solids[at[bodies[i].inside]];
      for (TopExp_Explorer e(bodies[i].solid, TopAbs_SHELL); e.More(); e.Next())
        builder.Add(around, e.Current().Reversed());
      ++out.cavities;
      continue;
    }
    at[i] = out.solids.size();
    out.solids.push_back(bodies[i].solid);
  }
}

void append(Sewn& to, Sewn from) {
  to.solids.insert(to.solids.end(), from.solids.begin(), from.solids.end());
  to.open.insert(to.open.end(), from.open.begin(), from.open.end());
  to.gap = std::max(to.gap, from.gap);
  to.joined += from.joined;
  to.cavities += from.cavities;
}

}  // namespace

double area_of(const std::vector<TopoDS_Face>& faces) {
  double sum = 0;
  for (const TopoDS_Face& f : faces) {
    GProp_GProps g;
    BRepGProp::SurfaceProperties(f, g);
    sum += std::abs(g.Mass());
  }
  return sum;
}

Sewn sew(const std::vector<TopoDS_Face>& faces) {
  Sewn out;
  out.open = faces;
  const double size = size_of(faces);
  std::vector<TopoDS_Shell> shells;
  for (const double share : kShares) {
    const double tolerance = std::max(kResolution, share * size);
    const std::size_t before = out.open.size();
    if (before == 0) break;
    std::vector<char> taken(before, 0);
    if (before > 1)
      for (const auto& run : runs_that_close(out.open, tolerance)) {
        std::vector<TopoDS_Face> some;
        for (const std::size_t i : run) some.push_back(out.open[i]);
        const auto closed = take_closed(some, tolerance);
        if (!some.empty()) continue;
        shells.insert(shells.end(), closed.begin(), closed.end());
        for (const std::size_t i : run) taken[i] = 1;
      }
    std::vector<TopoDS_Face> rest;
    for (std::size_t i = 0; i < before; ++i)
      if (!taken[i]) rest.push_back(out.open[i]);
    if (!rest.empty()) {
      const auto closed = take_closed(rest, tolerance);
      shells.insert(shells.end(), closed.begin(), closed.end());
    }
    out.open = std::move(rest);
    if (out.open.size() < before) out.gap = tolerance;
  }
  out.joined = faces.size() - out.open.size();
  add_solids(shells, out);
  return out;
}

Sewn sew_groups(const TopoDS_Shape& shape) {
  Sewn out;
  std::vector<TopoDS_Face> own;
  for (TopoDS_Iterator it(shape); it.More(); it.Next()) {
    const TopoDS_Shape& part = it.Value();
    if (part.ShapeType() == TopAbs_SOLID) continue;
    if (part.ShapeType() == TopAbs_FACE) {
      own.push_back(TopoDS::Face(part));
    } else if (part.ShapeType() < TopAbs_FACE) {
      Sewn inner = sew_groups(part);
      own.insert(own.end(), inner.open.begin(), inner.open.end());
      inner.open.clear();
      append(out, std::move(inner));
    }
  }
  if (shape.ShapeType() == TopAbs_FACE) own.push_back(TopoDS::Face(shape));
  if (!own.empty()) append(out, sew(own));
  return out;
}

}  // namespace robomosp::cad_exchange
