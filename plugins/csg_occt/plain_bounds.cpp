// SPDX-License-Identifier: Apache-2.0
#include "plain_bounds.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include <BRep_Tool.hxx>
#include <Geom_Circle.hxx>
#include <Geom_ConicalSurface.hxx>
#include <Geom_CylindricalSurface.hxx>
#include <Geom_Line.hxx>
#include <Geom_Plane.hxx>
#include <Geom_RectangularTrimmedSurface.hxx>
#include <Geom_TrimmedCurve.hxx>
#include <TopExp_Explorer.hxx>
#include <TopoDS.hxx>
#include <gp_Circ.hxx>

namespace robomosp::csg_occt {
namespace {

bool is_plain(const TopoDS_Face& face) {
  TopLoc_Location place;
  Handle(Geom_Surface) surface = BRep_Tool::Surface(face, place);
  while (const auto trimmed = Handle(Geom_RectangularTrimmedSurface)::DownCast(surface))
    surface = trimmed->BasisSurface();
  return !surface.IsNull() && (surface->IsKind(STANDARD_TYPE(Geom_Plane)) ||
                               surface->IsKind(STANDARD_TYPE(Geom_CylindricalSurface)) ||
                               surface->IsKind(STANDARD_TYPE(Geom_ConicalSurface)));
}

struct Reach {
  std::array<gp_XYZ, 3> axes;
  std::array<double, 3> low, high;

  void add(const gp_XYZ& p) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = axes[k].Dot(p);
      low[k] = std::min(low[k], x);
      high[k] = std::max(high[k], x);
    }
  }

  bool add(const TopoDS_Edge& edge) {
    if (BRep_Tool::Degenerated(edge)) return true;
    TopLoc_Location place;
    double first = 0, last = 0;
    Handle(Geom_Curve) curve = BRep_Tool::Curve(edge, place, first, last);
    while (const auto trimmed = Handle(Geom_TrimmedCurve)::DownCast(curve))
      curve = trimmed->BasisCurve();
    if (curve.IsNull()) return false;
    const bool is_moved = !place.IsIdentity();
    for (const double t : {first, last}) {
      gp_Pnt p = curve->Value(t);
      if (is_moved) p.Transform(place.Transformation());
      add(p.XYZ());
    }
    if (curve->IsKind(STANDARD_TYPE(Geom_Line))) return true;
    const auto round = Handle(Geom_Circle)::DownCast(curve);
    if (round.IsNull()) return false;
    gp_Circ circle = round->Circ();
    if (is_moved) circle.Transform(place.Transformation());
    const gp_XYZ x = circle.XAxis().Direction().XYZ(), y = circle.YAxis().Direction().XYZ();
    for (std::size_t k = 0; k < 3; ++k) {
      const double dx = axes[k].Dot(x), dy = axes[k].Dot(y);
      const double centre = axes[k].Dot(circle.Location().XYZ());
      const double reach = circle.Radius() * std::hypot(dx, dy);
      if (centre + reach <= high[k] && centre - reach >= low[k]) continue;
      const double top = std::atan2(dy, dx);
      for (const double sign : {1.0, -1.0}) {
        double t = std::fmod((sign > 0 ? top : top + kTurn / 2) - first, kTurn);
        if (t < 0) t += kTurn;
        if (t > last - first) continue;
        low[k] = std::min(low[k], centre + sign * reach);
        high[k] = std::max(high[k], centre + sign * reach);
      }
    }
    return true;
  }
};

}  // namespace

bool PlainBounds::widen(Bnd_Box& box, const TopoDS_Shape& solid, const gp_Trsf& pose) {
  gp_Trsf whole = pose;
  if (!solid.Location().IsIdentity()) whole = pose * solid.Location().Transformation();
  const gp_Mat turn = whole.VectorialPart();
  Key key;
  key.mix(std::bit_cast<std::uint64_t>(solid.TShape().get()));
  for (int i = 1; i <= 3; ++i)
    for (int j = 1; j <= 3; ++j) key.mix(turn(i, j));
  auto [place, is_new] = known_.try_emplace(key);
  Extent& extent = place->second;
  if (is_new) {
    constexpr double kFar = std::numeric_limits<double>::max();
    Reach reach{{turn.Row(1), turn.Row(2), turn.Row(3)}, {kFar, kFar, kFar}, {-kFar, -kFar, -kFar}};
    const TopoDS_Shape bare = solid.Located(TopLoc_Location());
    extent.is_plain = true;
    for (TopExp_Explorer e(bare, TopAbs_FACE); e.More() && extent.is_plain; e.Next())
      extent.is_plain = is_plain(TopoDS::Face(e.Current()));
    for (TopExp_Explorer e(bare, TopAbs_EDGE); e.More() && extent.is_plain; e.Next())
      extent.is_plain = reach.add(TopoDS::Edge(e.Current()));
    extent.is_plain = extent.is_plain && reach.low[0] <= reach.high[0];
    extent.low = reach.low;
    extent.high = reach.high;
  }
  if (!extent.is_plain) return false;
  const gp_XYZ& move = whole.TranslationPart();
  box.Update(extent.low[0] + move.X(), extent.low[1] + move.Y(), extent.low[2] + move.Z(),
             extent.high[0] + move.X(), extent.high[1] + move.Y(), extent.high[2] + move.Z());
  return true;
}

}  // namespace robomosp::csg_occt
