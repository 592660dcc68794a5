// SPDX-License-Identifier: Apache-2.0
#include "content.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <locale>
#include <sstream>

#include <BRepBuilderAPI_MakeSolid.hxx>
#include <BRepBuilderAPI_Sewing.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepCheck_Analyzer.hxx>
#include <BRepPrimAPI_MakePrism.hxx>
#include <BRepPrimAPI_MakeRevol.hxx>
#include <BRepTools.hxx>
#include <BRep_Builder.hxx>
#include <BRep_Tool.hxx>
#include <Geom2d_Curve.hxx>
#include <Geom_Curve.hxx>
#include <Geom_Surface.hxx>
#include <ShapeFix_Shape.hxx>
#include <TopExp.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Shell.hxx>
#include <TopoDS_Solid.hxx>
#include <TopoDS_Vertex.hxx>
#include <gp.hxx>

#include "primitives.h"
#include "profile.h"

namespace robomosp::csg_occt {
namespace {

// A swept solid whose volume differs by more than this from that of its profile is not it.
constexpr double kSweptSlack = 1e-7;
// Faces of a file without solids are joined where they are no further apart [mm].
constexpr double kSewn = 1e-3;
// Parameters of faces beyond these are damage: angles [rad], others [mm, or without unit].
constexpr double kMostAngle = 1e3, kMostParameter = 1e9;

Result<Content> swept(const CsgNode& node, FaceMemory& faces, Progress& progress) {
  const bool is_prism = node.kind == CsgKind::prism;
  ProfileUse use;
  use.is_revolved = !is_prism;
  if (!is_prism) use.plane = gp_Pln(gp_Ax3(gp::Origin(), gp_Dir(0, -1, 0), gp_Dir(1, 0, 0)));
  RMP_TRY_ASSIGN(const std::vector<Region> regions, profile_regions(*node.profile, use, progress));
  const double height = node.sizes[0] * kMillimetresPerMetre;
  const double angle = std::min(node.sizes[0], kCsgFullTurn);
  Content content;
  for (const Region& region : regions) {
    if (progress.cancelled()) return cancelled_error();
    TopoDS_Shape shape;
    if (is_prism) shape = BRepPrimAPI_MakePrism(region.face, gp_Vec(0, 0, height)).Shape();
    else if (angle >= kCsgFullTurn * (1 - 1e-12))
      shape = BRepPrimAPI_MakeRevol(region.face, gp::OZ()).Shape();
    else shape = BRepPrimAPI_MakeRevol(region.face, gp::OZ(), angle).Shape();
    const TopExp_Explorer found(shape, TopAbs_SOLID);
    if (!found.More())
      return error(ErrorCode::plugin_failed, "the profile did not produce a solid",
                   "Simplify the profile.");
    TopoDS_Shape solid = found.Current();
    if (faces.of(solid, progress).volume < 0) solid.Reverse();
    content.solids.push_back(measured(solid, faces));
    const double want = is_prism ? region.area * height : region.moment_x * angle;
    if (!(std::abs(content.solids.back().volume - want) <= kSweptSlack * want) || !is_sound(solid))
      return error(ErrorCode::plugin_failed, "the profile did not produce a valid solid",
                   "Simplify the profile where its curves come close to each other or meet at a "
                   "sharp angle.");
  }
  return content;
}

// OCCT's reader prints to the program's output what it misses, and a damaged file may claim more
// entries than it has characters, which would take for ever.
bool is_plausible(std::string_view text) {
  if (text.find("CASCADE Topology V") == std::string_view::npos) return false;
  std::size_t from = 0;
  for (const std::string_view section :
       {"Locations ", "Curve2ds ", "Curves ", "Polygon3D ", "PolygonOnTriangulations ", "Surfaces ",
        "Triangulations ", "TShapes "}) {
    const std::size_t at = text.find(section, from);
    if (at == std::string_view::npos) return false;
    from = at + section.size();
    std::uint64_t count = 0;
    const auto read = std::from_chars(text.data() + from, text.data() + text.size(), count);
    if (read.ec != std::errc() || count > text.size()) return false;
  }
  return true;
}

/// Every face has a surface and every edge the curves that OCCT's checks take for granted.
bool is_complete(const TopoDS_Shape& shape) {
  for (TopExp_Explorer f(shape, TopAbs_FACE); f.More(); f.Next()) {
    const TopoDS_Face& face = TopoDS::Face(f.Current());
    const Handle(Geom_Surface) surface = BRep_Tool::Surface(face);
    if (surface.IsNull()) return false;
    for (TopExp_Explorer e(face, TopAbs_EDGE); e.More(); e.Next()) {
      const TopoDS_Edge& edge = TopoDS::Edge(e.Current());
      double first = 0, last = 0;
      const Handle(Geom2d_Curve) trim = BRep_Tool::CurveOnSurface(edge, face, first, last);
      if (trim.IsNull() || !(last > first) || !std::isfinite(last - first)) return false;
      // Angles of millions of turns come from damage, and take as long to go round.
      for (const double t : {first, last}) {
        const gp_Pnt2d uv = trim->Value(t);
        if (!(std::abs(uv.X()) < (surface->IsUPeriodic() ? kMostAngle : kMostParameter)) ||
            !(std::abs(uv.Y()) < (surface->IsVPeriodic() ? kMostAngle : kMostParameter)))
          return false;
      }
      if (BRep_Tool::Degenerated(edge)) continue;
      const Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, first, last);
      if (curve.IsNull() || !(last > first) || !std::isfinite(last - first)) return false;
      TopoDS_Vertex a, b;
      TopExp::Vertices(edge, a, b);
      if (a.IsNull() || b.IsNull()) return false;
    }
  }
  return true;
}

void append_solids(const TopoDS_Shape& shape, std::vector<TopoDS_Shape>& solids) {
  for (TopExp_Explorer e(shape, TopAbs_SOLID); e.More(); e.Next()) solids.push_back(e.Current());
}

std::vector<TopoDS_Shape> closed_solids(const TopoDS_Shape& shape, bool& is_sewn) {
  std::vector<TopoDS_Shape> solids;
  append_solids(shape, solids);
  if (!solids.empty() || !TopExp_Explorer(shape, TopAbs_FACE).More()) return solids;
  is_sewn = true;
  BRepBuilderAPI_Sewing sewing(kSewn);
  sewing.Add(shape);
  sewing.Perform();
  for (TopExp_Explorer e(sewing.SewedShape(), TopAbs_SHELL); e.More(); e.Next())
    if (BRep_Tool::IsClosed(e.Current()))
      solids.push_back(BRepBuilderAPI_MakeSolid(TopoDS::Shell(e.Current())).Solid());
  return solids;
}

Result<Content> imported(const CsgNode& node, FaceMemory& faces, Progress& progress) {
  const CsgGeometry& geometry = *node.geometry;
  const std::string from = geometry.source.empty() ? "" : " from " + geometry.source;
  const auto bad = [&](const std::string& what, std::string remedy) {
    return error(ErrorCode::invalid_argument, "the imported solid" + from + " " + what,
                 std::move(remedy));
  };
  if (!is_plausible(geometry.brep))
    return bad("is not in BREP format, or damaged", "Export it again.");
  TopoDS_Shape shape;
  try {
    std::istringstream in(geometry.brep);
    in.imbue(std::locale::classic());
    // OCCT's reader goes on for ever where a number is missing.
    in.exceptions(std::ios::failbit | std::ios::badbit);
    const Handle(ProgressBridge) bridge = new ProgressBridge(progress, 0, 0, "reading the solid");
    BRepTools::Read(shape, in, BRep_Builder(), bridge->Start());
  } catch (const Standard_Failure&) {
    shape.Nullify();
  } catch (const std::ios::failure&) {
    shape.Nullify();
  }
  if (progress.cancelled()) return cancelled_error();
  if (shape.IsNull()) return bad("is not in BREP format, or damaged", "Export it again.");
  if (!is_complete(shape)) return bad("lacks curves or surfaces", "Export it again.");
  if (node.sizes[0] != 1) {
    gp_Trsf scale;
    scale.SetScale(gp::Origin(), node.sizes[0]);
    shape = BRepBuilderAPI_Transform(shape, scale, true).Shape();
  }
  Content content;
  bool is_sewn = false, is_healed = false, is_turned = false;
  for (TopoDS_Shape solid : closed_solids(shape, is_sewn)) {
    if (progress.cancelled()) return cancelled_error();
    if (!is_sound(solid)) {
      ShapeFix_Shape fix(solid);
      fix.Perform();
      std::vector<TopoDS_Shape> fixed;
      append_solids(fix.Shape(), fixed);
      if (fixed.size() != 1 || !is_sound(fixed[0]))
        return bad("is not valid and could not be healed",
                   "Repair it in the program that made it, or export it with a finer tolerance.");
      solid = fixed[0];
      is_healed = true;
    }
    const double volume = faces.of(solid, progress).volume;
    if (volume < 0) {
      solid.Reverse();
      is_turned = true;
    }
    if (!(std::abs(volume) > 0)) return bad("has no volume", "Export it as a closed solid.");
    content.solids.push_back(measured(solid, faces));
  }
  if (content.solids.empty())
    return bad("contains no closed solid", "Export it as a solid, not as open surfaces.");
  if (content.solids.size() > 1) {
    // Bodies of one file may overlap; what is counted twice has to be counted once.
    BooleanCall call;
    call.kind = CsgKind::union_;
    call.objects.push_back(content.solids[0]);
    bool meet = false;
    for (std::size_t i = 1; i < content.solids.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k)
        meet |= boxes_meet(content.solids[i].box, content.solids[k].box);
      call.tools.push_back(content.solids[i]);
    }
    if (meet) {
      RMP_TRY_ASSIGN(BooleanOutcome together, run_boolean(call, faces, progress, 0, 0));
      content.solids = std::move(together.solids);
    }
  }
  if (is_sewn) content.notes.emplace_back("its faces were sewn into a closed solid");
  if (is_healed) content.notes.emplace_back("it was not valid and has been healed");
  if (is_turned) content.notes.emplace_back("it was inside out and has been flipped");
  return content;
}

}  // namespace

Result<Content> build_content(const CsgNode& node, FaceMemory& faces, Progress& progress) {
  if (node.kind == CsgKind::imported) return imported(node, faces, progress);
  return swept(node, faces, progress);
}

bool is_sound(const TopoDS_Shape& shape) { return BRepCheck_Analyzer(shape).IsValid(); }

}  // namespace robomosp::csg_occt
