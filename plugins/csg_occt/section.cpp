// SPDX-License-Identifier: Apache-2.0
// What a plane cuts out of a solid as a profile, and the solid as the text of a file.
#include <algorithm>
#include <cmath>
#include <limits>
#include <locale>
#include <numbers>
#include <sstream>

#include <BRepAdaptor_Curve.hxx>
#include <BRepAlgoAPI_Common.hxx>
#include <BRepBndLib.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_Transform.hxx>
#include <BRepTools.hxx>
#include <BRepTools_WireExplorer.hxx>
#include <BRep_Builder.hxx>
#include <TopExp_Explorer.hxx>
#include <TopTools_ListOfShape.hxx>
#include <TopoDS.hxx>
#include <TopoDS_Compound.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Face.hxx>
#include <TopoDS_Wire.hxx>

#include "content.h"
#include "engine.h"
#include "profile.h"

namespace robomosp::csg_occt {
namespace {

// Pieces of one line or circle are joined where they differ by no more than this [mm].
constexpr double kSame = 1e-6;
constexpr std::size_t kMostSplinePoints = 4'096;
constexpr double kFinestChord = 1e-9;  // [m]

/// A piece of a section's outline [mm].
struct Stretch {
  CsgCurve::Kind kind = CsgCurve::Kind::line;
  gp_XY a{}, b{};
  gp_XY centre{};
  double radius = 0, sweep = 0;  // of an arc, counter-clockwise > 0
  std::vector<gp_XY> points{};   // of a spline, without a
};

gp_XY flat(const gp_Pnt& p) { return {p.X(), p.Y()}; }
std::array<double, 2> metres(const gp_XY& p) {
  return {p.X() / kMillimetresPerMetre, p.Y() / kMillimetresPerMetre};
}

double section_distance(const gp_XY& p, const gp_XY& a, const gp_XY& b) {
  const gp_XY d = b - a;
  const double l = d.SquareModulus();
  const double t = l > 0 ? std::clamp((p - a).Dot(d) / l, 0.0, 1.0) : 0;
  return (p - a - d * t).Modulus();
}

/// Points on the curve through which a spline stays within `chord` of it.
Result<std::vector<gp_XY>> fitted(const BRepAdaptor_Curve& curve, double from, double to,
                                  double chord) {
  constexpr std::size_t kFine = 8;  // chords of the curve per span, to measure against
  for (std::size_t n = 2; n <= kMostSplinePoints; n *= 2) {
    const auto at = [&](std::size_t span, std::size_t fine) {
      const double t =
          (static_cast<double>(span) + static_cast<double>(fine) / kFine) / static_cast<double>(n);
      return flat(curve.Value(from + (to - from) * t));
    };
    std::vector<gp_XY> points;
    for (std::size_t i = 0; i <= n; ++i) points.push_back(at(i, 0));
    const NaturalSpline spline(points);
    double worst = 0;
    for (std::size_t s = 0; s < n && worst <= chord; ++s)
      for (std::size_t k = 1; k < kFine; ++k) {
        const double low = spline.knots()[s], high = spline.knots()[s + 1];
        const gp_XY p = spline.at(low + (high - low) * static_cast<double>(k) / kFine);
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t f = 0; f < kFine; ++f)
          least = std::min(least, section_distance(p, at(s, f), at(s, f + 1)));
        worst = std::max(worst, least);
      }
    if (worst <= chord) return points;
  }
  return error(ErrorCode::invalid_argument,
               "a curve of the section cannot be drawn within the chord by " +
                   std::to_string(kMostSplinePoints) + " points",
               "Request a larger chord.");
}

Result<Stretch> stretch_of(const TopoDS_Edge& edge, double chord) {
  const BRepAdaptor_Curve curve(edge);
  double from = curve.FirstParameter(), to = curve.LastParameter();
  if (edge.Orientation() == TopAbs_REVERSED) std::swap(from, to);
  Stretch s;
  s.a = flat(curve.Value(from));
  s.b = flat(curve.Value(to));
  switch (curve.GetType()) {
    case GeomAbs_Line: return s;
    case GeomAbs_Circle: {
      s.kind = CsgCurve::Kind::arc;
      s.centre = flat(curve.Circle().Location());
      s.radius = curve.Circle().Radius();
      s.sweep = (to - from) * (curve.Circle().Axis().Direction().Z() > 0 ? 1 : -1);
      return s;
    }
    default: {
      s.kind = CsgCurve::Kind::spline;
      RMP_TRY_ASSIGN(s.points, fitted(curve, from, to, chord));
      s.points.erase(s.points.begin());
      return s;
    }
  }
}

/// Appends `next` to `s` when both are parts of one line or circle.
bool join(Stretch& s, const Stretch& next) {
  if (s.kind != next.kind || s.kind == CsgCurve::Kind::spline) return false;
  if (s.kind == CsgCurve::Kind::line) {
    if (section_distance(s.b, s.a, next.b) > kSame || (s.b - s.a).Dot(next.b - next.a) <= 0)
      return false;
    s.b = next.b;
    return true;
  }
  if ((s.centre - next.centre).Modulus() > kSame || std::abs(s.radius - next.radius) > kSame ||
      s.sweep * next.sweep <= 0)
    return false;
  s.b = next.b;
  s.sweep += next.sweep;
  return true;
}

CsgLoop drawn(std::vector<Stretch> stretches) {
  std::vector<Stretch> joined;
  for (Stretch& s : stretches)
    if (joined.empty() || !join(joined.back(), s)) joined.push_back(std::move(s));
  if (joined.size() > 1 && join(joined.back(), joined.front())) joined.erase(joined.begin());
  CsgLoop loop;
  if (joined.size() == 1 && joined[0].kind == CsgCurve::Kind::arc &&
      std::abs(joined[0].sweep) > 2 * std::numbers::pi - 1e-9) {
    loop.curves.push_back(
        {CsgCurve::Kind::circle,
         {metres(joined[0].centre), {joined[0].radius / kMillimetresPerMetre, 0}}});
    return loop;
  }
  loop.start = metres(joined[0].a);
  for (const Stretch& s : joined) {
    CsgCurve curve{s.kind, {}};
    if (s.kind == CsgCurve::Kind::arc) {
      const gp_XY r = s.a - s.centre;
      const double c = std::cos(s.sweep / 2), sn = std::sin(s.sweep / 2);
      curve.points.push_back(
          metres(s.centre + gp_XY(r.X() * c - r.Y() * sn, r.X() * sn + r.Y() * c)));
    }
    for (const gp_XY& p : s.points) curve.points.push_back(metres(p));
    if (s.kind != CsgCurve::Kind::spline) curve.points.push_back(metres(s.b));
    loop.curves.push_back(std::move(curve));
  }
  loop.curves.back().points.back() = loop.start;
  return loop;
}

/// The part of the plane z = 0 within the solid, as faces.
Result<std::vector<TopoDS_Face>> cut_faces(const TopoDS_Shape& solid, Progress& progress) {
  Bnd_Box box;
  BRepBndLib::Add(solid, box, false);
  const gp_Pnt low = box.CornerMin(), high = box.CornerMax();
  std::vector<TopoDS_Face> faces;
  if (low.Z() > 0 || high.Z() < 0) return faces;
  const double size = std::sqrt(box.SquareExtent()), margin = 0.1 * size + 1;
  const TopoDS_Face plane = BRepBuilderAPI_MakeFace(gp_Pln(), low.X() - margin, high.X() + margin,
                                                    low.Y() - margin, high.Y() + margin)
                                .Face();
  for (const double fuzzy : {0.0, 1e-6, 1e-5}) {
    TopTools_ListOfShape objects, tools;
    objects.Append(plane);
    tools.Append(solid);
    BRepAlgoAPI_Common common;
    common.SetArguments(objects);
    common.SetTools(tools);
    common.SetNonDestructive(true);
    common.SetToFillHistory(false);
    common.SetFuzzyValue(fuzzy * size);
    const Handle(ProgressBridge) bridge = new ProgressBridge(progress, 0, 0.9, "cutting the solid");
    common.Build(bridge->Start());
    if (progress.cancelled()) return cancelled_error();
    if (!common.IsDone() || common.HasErrors() || common.Shape().IsNull() ||
        !is_sound(common.Shape()))
      continue;
    for (TopExp_Explorer e(common.Shape(), TopAbs_FACE); e.More(); e.Next())
      faces.push_back(TopoDS::Face(e.Current()));
    return faces;
  }
  return error(ErrorCode::plugin_failed, "Open CASCADE could not cut the solid with this plane",
               "Move or turn the plane slightly.");
}

}  // namespace

Result<CsgProfile> OcctCsgEngine::section(const CsgShape& shape, const Pose& plane, double chord,
                                          Progress& progress) const {
  return guarded("cutting the solid", [&]() -> Result<CsgProfile> {
    RMP_TRY_ASSIGN(const OcctShape* own, own_shape(shape));
    const auto pose = to_trsf(plane);
    if (!pose)
      return error(ErrorCode::invalid_argument,
                   "the plane's pose is not a rigid motion; its rotation must be orthonormal with "
                   "determinant +1 and all its numbers finite");
    if (std::any_of(plane.p.begin(), plane.p.end(),
                    [](double x) { return !(std::abs(x) <= kCsgGreatestLength); }))
      return error(ErrorCode::invalid_argument,
                   "the plane is farther than " + csg_number_text(kCsgGreatestLength) + " m",
                   "Place it at the solid.");
    if (!(chord >= kFinestChord) || !std::isfinite(chord))
      return error(ErrorCode::invalid_argument, "the chord is " + csg_number_text(chord) +
                                                    " m; it must be at least " +
                                                    csg_number_text(kFinestChord) + " m");
    const auto claim = gate_.claim(own->lineage(), progress);
    if (!claim || progress.cancelled()) return cancelled_error();
    const gp_Trsf into_plane = pose->Inverted() * own->pose();
    CsgProfile profile;
    for (const Solid& solid : own->solids()) {
      RMP_TRY_ASSIGN(const std::vector<TopoDS_Face> faces,
                     cut_faces(placed(solid.shape, into_plane), progress));
      for (const TopoDS_Face& face : faces)
        for (TopExp_Explorer w(face, TopAbs_WIRE); w.More(); w.Next()) {
          if (progress.cancelled()) return cancelled_error();
          std::vector<Stretch> stretches;
          for (BRepTools_WireExplorer e(TopoDS::Wire(w.Current()), face); e.More(); e.Next()) {
            RMP_TRY_ASSIGN(Stretch s, stretch_of(e.Current(), chord * kMillimetresPerMetre));
            stretches.push_back(std::move(s));
          }
          if (!stretches.empty()) profile.loops.push_back(drawn(std::move(stretches)));
        }
    }
    return profile;
  });
}

Result<CsgGeometry> OcctCsgEngine::geometry(const CsgShape& shape, Progress& progress) const {
  return guarded("writing the solid", [&]() -> Result<CsgGeometry> {
    RMP_TRY_ASSIGN(const OcctShape* own, own_shape(shape));
    const auto claim = gate_.claim(own->lineage(), progress);
    if (!claim || progress.cancelled()) return cancelled_error();
    TopoDS_Shape whole;
    if (own->solids().size() == 1) {
      whole = own->solids()[0].shape;
    } else {
      BRep_Builder builder;
      TopoDS_Compound compound;
      builder.MakeCompound(compound);
      for (const Solid& solid : own->solids()) builder.Add(compound, solid.shape);
      whole = compound;
    }
    // A copy whose curves and surfaces lie where they are seen, without placements or triangles.
    const TopoDS_Shape resolved = BRepBuilderAPI_Transform(whole, own->pose(), true).Shape();
    if (progress.cancelled()) return cancelled_error();
    std::ostringstream out;
    out.imbue(std::locale::classic());
    const Handle(ProgressBridge) bridge = new ProgressBridge(progress, 0, 1, "writing the solid");
    BRepTools::Write(resolved, out, false, false, TopTools_FormatVersion_CURRENT, bridge->Start());
    if (progress.cancelled()) return cancelled_error();
    CsgGeometry geometry;
    geometry.form = CsgGeometry::Form::brep;
    geometry.brep = std::move(out).str();
    return geometry;
  });
}

}  // namespace robomosp::csg_occt
