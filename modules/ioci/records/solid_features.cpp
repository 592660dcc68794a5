// SPDX-License-Identifier: Apache-2.0
// Faces, edges, corners and plane sections of solids.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "ioci/records/solid_nodes.h"

namespace robomosp::ioci {
namespace {

using Point = std::array<double, 2>;

std::string_view feature_word(CsgFeature::Kind kind) {
  constexpr std::string_view kSurfaceWords[] = {"plane", "cylinder", "cone",   "sphere", "torus",
                                                "line",  "circle",   "corner", "other"};
  return kSurfaceWords[static_cast<std::size_t>(kind)];
}

Result<Value> features(CommandContext& ctx, const Map& args) {
  RMP_TRY_ASSIGN(const auto all,
                 ctx.app.derived.features(ctx.snapshot(), typed<model::Solid>(args), ctx.progress));
  List out;
  for (std::size_t i = 0; i < all->size(); ++i) {
    const CsgFeature& f = (*all)[i];
    if (has(args, "kind") && text_of(args, "kind") != feature_word(f.kind)) continue;
    Map m{{"index", i + 1}, {"kind", feature_word(f.kind)}, {"point", vec_value(f.point, "m")}};
    if (f.direction != Vec3{}) m.set("direction", vec_value(f.direction));
    if (f.radius > 0) m.set("radius", f.radius);
    if (f.size > 0) m.set("size", f.size);
    if (f.inward) m.set("inward", true);
    out.emplace_back(std::move(m));
  }
  return Value(std::move(out));
}

/// Centre of the circle through three points; nothing when they stand in a line.
std::optional<Point> centre_of(const Point& a, const Point& b, const Point& c) {
  const double bx = b[0] - a[0], by = b[1] - a[1], cx = c[0] - a[0], cy = c[1] - a[1];
  const double d = 2 * (bx * cy - by * cx);
  if (d == 0) return std::nullopt;
  const double b2 = bx * bx + by * by, c2 = cx * cx + cy * cy;
  return Point{a[0] + (cy * b2 - by * c2) / d, a[1] + (bx * c2 - cx * b2) / d};
}

/// The angle an arc turns through from a over b to c, positive counter-clockwise.
double swept_angle(const Point& centre, const Point& a, const Point& b, const Point& c) {
  const auto angle = [&](const Point& p) { return std::atan2(p[1] - centre[1], p[0] - centre[0]); };
  const auto from_a = [&](const Point& p) {
    const double t = std::fmod(angle(p) - angle(a) + 4 * std::numbers::pi, 2 * std::numbers::pi);
    return t;
  };
  const double to_b = from_a(b);
  double to_c = from_a(c);
  if (to_c == 0) to_c = 2 * std::numbers::pi;
  return to_b < to_c ? to_c : to_c - 2 * std::numbers::pi;
}

/// A loop as corners, and the area between its arcs and their chords; exact for lines, arcs and
/// circles. Splines count as the line through their points.
struct Outline {
  std::vector<Point> corners;
  double area = 0;  ///< counter-clockwise positive [m^2]
};

Outline outline_of(const CsgLoop& l) {
  Outline o;
  constexpr int kPieces = 24;  // of an arc, to tell what is inside of it
  double bulge = 0;
  std::vector<Point> exact;  // corners between which the bulges are
  const auto arc = [&](const Point& centre, const Point& a, double angle) {
    const double x = a[0] - centre[0], y = a[1] - centre[1];
    const double r2 = x * x + y * y;
    bulge += r2 * (angle - std::sin(angle)) / 2;
    for (int k = 1; k < kPieces; ++k) {
      const double t = angle * k / kPieces;
      o.corners.push_back({centre[0] + x * std::cos(t) - y * std::sin(t),
                           centre[1] + x * std::sin(t) + y * std::cos(t)});
    }
  };
  if (!l.curves.empty() && l.curves[0].kind == CsgCurve::Kind::circle) {
    const Point centre = l.curves[0].points[0];
    const double r = l.curves[0].points[1][0];
    const Point a{centre[0] + r, centre[1]};
    o.corners.push_back(a);
    arc(centre, a, 2 * std::numbers::pi);
    o.area = bulge;
    return o;
  }
  Point at = l.start;
  exact.push_back(at);
  o.corners.push_back(at);
  for (const CsgCurve& c : l.curves) {
    const auto centre = c.kind == CsgCurve::Kind::arc && c.points.size() == 2
                            ? centre_of(at, c.points[0], c.points[1])
                            : std::nullopt;
    if (centre) arc(*centre, at, swept_angle(*centre, at, c.points[0], c.points[1]));
    if (c.points.empty()) continue;
    for (std::size_t k = centre ? c.points.size() - 1 : 0; k < c.points.size(); ++k) {
      exact.push_back(c.points[k]);
      o.corners.push_back(c.points[k]);
    }
    at = c.points.back();
  }
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const Point &p = exact[i], &q = exact[(i + 1) % exact.size()];
    // About the start, so that a small loop far away keeps its digits.
    o.area +=
        ((p[0] - l.start[0]) * (q[1] - l.start[1]) - (q[0] - l.start[0]) * (p[1] - l.start[1])) / 2;
  }
  o.area += bulge;
  return o;
}

bool is_inside(const Point& p, const std::vector<Point>& corners) {
  bool inside = false;
  for (std::size_t i = 0, k = corners.size() - 1; i < corners.size(); k = i++) {
    const Point &a = corners[i], &b = corners[k];
    if ((a[1] > p[1]) != (b[1] > p[1]) &&
        p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0])
      inside = !inside;
  }
  return inside;
}

/// Area of a region: holes and islands by how many loops they are in.
double area_of(const CsgProfile& profile) {
  std::vector<Outline> outlines;
  for (const CsgLoop& l : profile.loops) outlines.push_back(outline_of(l));
  double area = 0;
  for (std::size_t i = 0; i < outlines.size(); ++i) {
    std::size_t depth = 0;
    for (std::size_t k = 0; k < outlines.size(); ++k)
      if (k != i && is_inside(outlines[i].corners[0], outlines[k].corners)) ++depth;
    area += (depth % 2 == 0 ? 1 : -1) * std::fabs(outlines[i].area);
  }
  return area;
}

Result<Value> section(CommandContext& ctx, const Map& args) {
  const auto plane = pose_from(*args.find("plane"));
  const model::Solid& s = content<model::Solid>(ctx, args);
  const double chord = has(args, "chord") ? real(args, "chord") : s.chord;
  RMP_TRY_ASSIGN(const auto profile,
                 ctx.app.derived.section(ctx.snapshot(), typed<model::Solid>(args),
                                         plane.value_or(Pose{}), chord, ctx.progress));
  return Value(Map{{"loops", profile_value(*profile)}, {"area", area_of(*profile)}});
}

const char* const kFeaturePlate =
    "local plate = solid.create{name = \"plate\", root = {kind = \"difference\", children = {\n"
    "  {kind = \"box\", name = \"body\", x = 0.2, y = 0.1, z = 0.01},\n"
    "  {kind = \"cylinder\", name = \"bore\", radius = 0.01, height = 0.03, position = {0, 0, "
    "-0.01}}}}}\n";

}  // namespace

RMP_COMMANDS(solid_feature_commands) {
  std::vector<CommandSpec> all;
  all.push_back(
      {.name = "solid.features",
       .classic = "",
       .summary = "Lists the faces, edges and corners of a solid to which parts can be mated.",
       .details = "The numbers stay the same as long as the tree does not change.",
       .example = std::string(kFeaturePlate) +
                  "local holes = plate:features{kind = \"cylinder\"}\n"
                  "assert(#holes == 1 and holes[1].inward and math.abs(holes[1].radius - 0.01) < "
                  "1e-12)",
       .params = {self("solid"),
                  [] {
                    ParamSpec p = field("kind", "enum", "", "Only features of this type.");
                    p.choices = {"plane", "cylinder", "cone",   "sphere", "torus",
                                 "line",  "circle",   "corner", "other"};
                    return p;
                  }()},
       .returns = {"list",
                   "",
                   "",
                   {field("index", "int", "", "Its number in the whole list."),
                    field("kind", "string", "",
                          "plane, cylinder, cone, sphere, torus or other (faces), line or circle "
                          "(edges; other as well), corner."),
                    field("point", "vec3", "m",
                          "Centroid of a plane, middle of a line, centre of a circle, sphere or "
                          "torus, a point in the middle of the axis of a cylinder or cone."),
                    field("direction", "vec3", "",
                          "Outward normal of a plane, axis, or direction of a line."),
                    field("radius", "real", "m", "Radius; for a torus that of its ring."),
                    field("size", "real", "", "Area of a face [m^2], length of an edge [m]."),
                    field("inward", "bool", "", "Whether it is the wall of a hole.")}},
       .effect = Effect::reads,
       .run = features});
  all.push_back(
      {.name = "solid.section",
       .classic = "",
       .summary =
           "Returns the section of a solid with a plane, as a profile in the plane's x and y.",
       .details = "The loops can be used as the profile of a prism. Lines, arcs and circles are "
                  "exact, other curves are within the chord.",
       .example =
           std::string(kFeaturePlate) +
           "local cut = plate:section{plane = {position = {0, 0, 0.005}}}\n"
           "assert(#cut.loops == 2 and math.abs(cut.area - (0.2 * 0.1 - math.pi * 0.01^2)) "
           "< 1e-9)\n"
           "solid.create{name = \"copy\", root = {kind = \"prism\", height = 0.01, profile = "
           "cut.loops}}",
       .params =
           {self("solid"),
            needed("plane", "pose", "", "The plane z = 0 of this frame, relative to the solid."),
            above_zero(optional(
                "chord", "real", "m",
                "Greatest distance of a chord from a curve; by default the chord of the solid."))},
       .returns = {"map",
                   "",
                   "",
                   {field("loops", "list", "",
                          "Closed outlines; an outline within another is a hole."),
                    field("area", "real", "m^2", "Area of the section.")}},
       .effect = Effect::reads,
       .run = section});
  return all;
}

}  // namespace robomosp::ioci
