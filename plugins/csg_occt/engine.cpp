// SPDX-License-Identifier: Apache-2.0
#include "engine.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <BRepAdaptor_Curve.hxx>
#include <BRepAdaptor_Surface.hxx>
#include <BRepBndLib.hxx>
#include <BRepClass_FaceClassifier.hxx>
#include <BRep_Tool.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_IndexedMapOfShape.hxx>
#include <TopoDS.hxx>

#include "modifiers.h"
#include "plain_bounds.h"

namespace robomosp::csg_occt {
namespace {

bool contains(const Bnd_Box& box, const Bnd_Box& part, double slack) {
  const gp_Pnt al = box.CornerMin(), ah = box.CornerMax();
  const gp_Pnt bl = part.CornerMin(), bh = part.CornerMax();
  for (int i = 1; i <= 3; ++i)
    if (bl.Coord(i) < al.Coord(i) - slack || bh.Coord(i) > ah.Coord(i) + slack) return false;
  return true;
}

// The optimal algorithm is slow and can fail on odd shapes; the plain one never does and is only
// looser: what lies within the box by the plain one need not be looked at again.
void widen(Bnd_Box& box, const TopoDS_Shape& part, double tolerance, bool is_plain_tight) {
  Bnd_Box plain, tight;
  BRepBndLib::Add(part, plain, false);
  if (plain.IsVoid() || contains(box, plain, 2 * tolerance)) return;
  try {
    if (!is_plain_tight) BRepBndLib::AddOptimal(part, tight, false, false);
  } catch (const Standard_Failure&) {
    tight.SetVoid();
  }
  if (tight.IsVoid()) tight = plain;
  tight.SetGap(0);
  box.Add(tight);
}

void widen(Bnd_Box& box, const TopoDS_Edge& edge) {
  if (BRep_Tool::Degenerated(edge)) return;
  const GeomAbs_CurveType type = BRepAdaptor_Curve(edge).GetType();
  if (type == GeomAbs_Line) return;
  widen(box, edge, BRep_Tool::Tolerance(edge), type == GeomAbs_Circle || type == GeomAbs_Ellipse);
}

// A face made of straight lines reaches no further than its edges. A sphere or a torus can bulge
// beyond them where its normal points along an axis.
void widen(Bnd_Box& box, const TopoDS_Face& face) {
  const BRepAdaptor_Surface surface(face, false);
  gp_XYZ centre, axis;
  double ring = 0, tube = 0;
  switch (surface.GetType()) {
    case GeomAbs_Plane:
    case GeomAbs_Cylinder:
    case GeomAbs_Cone: return;
    case GeomAbs_Sphere:
      centre = surface.Sphere().Location().XYZ();
      tube = surface.Sphere().Radius();
      break;
    case GeomAbs_Torus:
      centre = surface.Torus().Location().XYZ();
      axis = surface.Torus().Axis().Direction().XYZ();
      ring = surface.Torus().MajorRadius();
      tube = surface.Torus().MinorRadius();
      break;
    default: widen(box, face, BRep_Tool::Tolerance(face), false); return;
  }
  for (int i = 1; i <= 3; ++i)
    for (const double sign : {-1.0, 1.0}) {
      gp_XYZ e(0, 0, 0);
      e.SetCoord(i, sign);
      // Along its own axis a torus is highest on a whole circle, of which any point will do: where
      // the circle leaves the face there is an edge.
      gp_XYZ out = e - axis * axis.Dot(e);
      if (ring > 0 && out.Modulus() < 1e-9)
        out = axis.Crossed(std::abs(axis.X()) < 0.7 ? gp_XYZ(1, 0, 0) : gp_XYZ(0, 1, 0));
      const gp_Pnt p(centre + e * tube + (ring > 0 ? out.Normalized() * ring : gp_XYZ(0, 0, 0)));
      if (!box.IsOut(p)) continue;
      BRepClass_FaceClassifier classifier(face, p, BRep_Tool::Tolerance(face));
      if (classifier.State() == TopAbs_IN || classifier.State() == TopAbs_ON) box.Add(p);
    }
}

std::array<Vec3, 2> tight_bounds(const std::vector<Solid>& solids, const gp_Trsf& pose) {
  const Bnd_Box box = tight_box(solids, pose);
  const gp_Pnt low = box.CornerMin(), high = box.CornerMax();
  const auto metres = [](const gp_Pnt& p) {
    return Vec3{p.X() / kMillimetresPerMetre, p.Y() / kMillimetresPerMetre,
                p.Z() / kMillimetresPerMetre};
  };
  return {metres(low), metres(high)};
}

std::vector<std::string> note_texts(const Plan& plan, const CsgTree& tree, const Value& value) {
  std::vector<std::string> texts;
  for (const Note& note : value.notes) {
    std::size_t t = plan.root.term;
    for (const std::uint32_t step : note.path)
      if (step < plan.terms[t].items.size()) t = plan.terms[t].items[step].term;
    const std::size_t node = plan.terms[t].node;
    texts.push_back(csg_node_text(tree.nodes[node], node) + ": " + note.text + ".");
  }
  if (value.solids.size() > 1)
    texts.push_back("The solid consists of " + std::to_string(value.solids.size()) +
                    " separate pieces.");
  return texts;
}

}  // namespace

// Tests and benchmarks compare the shortcut with the general way.
OcctCsgEngine::OcctCsgEngine() {
  const char* variable = std::getenv("ROBOMOSP_CSG_PRISMATIC");
  const std::string_view choice = variable ? variable : "on";
  shortcut_ = choice == "off" ? Shortcut::off : choice == "only" ? Shortcut::only : Shortcut::on;
  silence_messenger();
}

Result<std::shared_ptr<const CsgShape>> OcctCsgEngine::evaluate(const CsgTree& tree,
                                                                Progress& progress) const {
  using Shape = Result<std::shared_ptr<const CsgShape>>;
  return guarded("evaluating the solid", [&]() -> Shape {
    if (progress.cancelled()) return cancelled_error();
    RMP_TRY_ASSIGN(const Plan plan, make_plan(tree, progress));
    RMP_TRY_ASSIGN(const ValuePtr value,
                   evaluate_plan(plan, tree, cache_, faces_, gate_, shortcut_, progress));
    const auto claim = gate_.claim(value->lineage, progress);
    if (!claim || progress.cancelled()) return cancelled_error();
    const auto bounds = tight_bounds(value->solids, plan.root.pose);
    progress.report(1, "solid evaluated");
    return std::shared_ptr<const CsgShape>(
        std::make_shared<OcctShape>(value, plan.root.pose, bounds, note_texts(plan, tree, *value)));
  });
}

Result<Mesh> OcctCsgEngine::mesh(const CsgShape& shape, const MeshQuality& quality,
                                 Progress& progress) const {
  return guarded("meshing the solid", [&]() -> Result<Mesh> {
    RMP_TRY_ASSIGN(const OcctShape* own, own_shape(shape));
    const auto claim = gate_.claim(own->lineage(), progress);
    if (!claim) return cancelled_error();
    return mesh_solids(own->solids(), own->pose(), quality, progress);
  });
}

Result<Moments> OcctCsgEngine::moments(const CsgShape& shape, Progress& progress) const {
  return guarded("integrating the solid", [&]() -> Result<Moments> {
    RMP_TRY_ASSIGN(const OcctShape* own, own_shape(shape));
    const auto claim = gate_.claim(own->lineage(), progress);
    if (!claim) return cancelled_error();
    Integrals sum;
    for (const Solid& s : own->solids()) {
      if (progress.cancelled()) return cancelled_error();
      sum.add(faces_.of(s.shape, progress));
    }
    return to_moments(sum, own->pose(), extent_of(own->solids()));
  });
}

Result<CsgEngine::Partition> OcctCsgEngine::partition(std::span<const PlacedShape> parts,
                                                      Progress& progress) const {
  return guarded("separating overlapping parts", [&]() -> Result<Partition> {
    std::vector<PlacedSolids> placed_parts;
    Lineage lineage;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::string where = "part " + std::to_string(i);
      if (!parts[i].shape)
        return error(ErrorCode::invalid_argument, "there is no shape", "Evaluate it first.", where);
      RMP_TRY_ASSIGN(const OcctShape* own, own_shape(*parts[i].shape).in(where));
      const auto pose = to_trsf(parts[i].placement);
      if (!pose)
        return error(ErrorCode::invalid_argument,
                     "placement is not a rigid motion; its rotation must be orthonormal with "
                     "determinant +1 and all its numbers finite",
                     {}, where);
      placed_parts.push_back(
          {own->solids(), is_identity(*pose) ? own->pose() : *pose * own->pose()});
      merge(lineage, own->lineage());
    }
    const auto claim = gate_.claim(std::move(lineage), progress);
    if (!claim) return cancelled_error();
    return partition_solids(placed_parts, faces_, progress);
  });
}

// Corners, then bent edges, then curved faces.
Bnd_Box tight_box(const std::vector<Solid>& solids, const gp_Trsf& pose) {
  Bnd_Box box;
  PlainBounds plain;
  for (const Solid& s : solids) {
    if (plain.widen(box, s.shape, pose)) continue;
    const TopoDS_Shape shape = placed(s.shape, pose);
    TopTools_IndexedMapOfShape corners, edges;
    TopExp::MapShapes(shape, TopAbs_VERTEX, corners);
    TopExp::MapShapes(shape, TopAbs_EDGE, edges);
    for (int i = 1; i <= corners.Extent(); ++i) box.Add(BRep_Tool::Pnt(TopoDS::Vertex(corners(i))));
    for (int i = 1; i <= edges.Extent(); ++i) widen(box, TopoDS::Edge(edges(i)));
    for (TopExp_Explorer e(shape, TopAbs_FACE); e.More(); e.Next())
      widen(box, TopoDS::Face(e.Current()));
  }
  return box;
}

Result<const OcctShape*> own_shape(const CsgShape& shape) {
  if (const auto* own = dynamic_cast<const OcctShape*>(&shape)) return own;
  return error(ErrorCode::invalid_argument, "the shape was made by another engine",
               "Evaluate its tree again with the engine \"occt\".");
}

double extent_of(const std::vector<Solid>& solids) {
  Bnd_Box box;
  for (const Solid& s : solids) box.Add(s.box);
  return box.IsVoid() ? 0 : std::sqrt(box.SquareExtent());
}

}  // namespace robomosp::csg_occt
