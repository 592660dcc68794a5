// SPDX-License-Identifier: Apache-2.0
#include "document/validate.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include <robomosp/sdk/csg_check.h>
#include <robomosp/sdk/csg_select.h>
#include <robomosp/sdk/names.h>

#include "document/ranges.h"
#include "kernel/expression.h"
#include "kernel/fault.h"
#include "kernel/text.h"
#include "kernel/units.h"
#include "kernel/utf8.h"
#include "model/data.h"
#include "model/placement.h"
#include "model/solid_edit.h"
#include "model/step_fields.h"
#include "robotics/coordinates.h"
#include "spatial/principal.h"

namespace robomosp::document {

namespace {

using namespace model;
using text::quote;

Error fault(std::string message, std::string hint = {}) {
  return error(ErrorCode::invalid_argument, std::move(message), std::move(hint));
}

std::string shown(double v) { return text::print_rounded(v, 6); }

/// Names what a fault is about, `the density`, `the x of box "plate"`; put together only when there
/// is a fault, as records may have very many elements. Holds views: make it in the call.
class What {
 public:
  What(const char* words) : words_(words) {}         // NOLINT: implicit by design, here and below
  What(const std::string& words) : words_(words) {}  // NOLINT
  /// Words, then those of what they belong to.
  What(std::string_view words, const What& of) : words_(words), of_(&of) {}
  What(std::string_view words, std::string_view kind, std::string_view noun, const What& of)
      : words_(words), kind_(kind), noun_(noun), of_(&of) {}
  /// Words, then a name in quotes.
  static What named(std::string_view words, const std::string& name) {
    What what("");
    what.words_ = words;
    what.name_ = &name;
    return what;
  }
  [[nodiscard]] std::string text() const {
    std::string all(words_);
    all.append(kind_).append(noun_);
    if (name_) all += quote(*name_);
    return of_ ? all + of_->text() : all;  // few deep
  }

 private:
  std::string_view words_, kind_, noun_;
  const std::string* name_ = nullptr;
  const What* of_ = nullptr;
};

Result<void> finite(double v, const What& what) {
  if (std::isfinite(v)) return {};
  return fault(what.text() + " is " + text::print(v) + "; it must be a finite number");
}
Result<void> finite(std::span<const double> v, const What& what) {
  for (const double x : v) RMP_TRY(finite(x, what));
  return {};
}
Result<void> positive(double v, const What& what, const char* unit) {
  RMP_TRY(finite(v, what));
  if (v > 0) return {};
  return fault(what.text() + " is " + shown(v) + unit + "; it must be greater than 0");
}
Result<void> not_negative(double v, const What& what, const char* unit) {
  RMP_TRY(finite(v, what));
  if (v >= 0) return {};
  return fault(what.text() + " is " + shown(v) + unit + "; it must not be negative");
}
/// Far beyond any robot, and far below where sums of lengths lose millimetres or overflow.
constexpr double kLongest = 1e4;   // m
constexpr double kHeaviest = 1e9;  // kg
Result<void> at_most(double v, double most, const What& what, const char* unit) {
  RMP_TRY(finite(v, what));
  if (std::fabs(v) <= most) return {};
  return fault(what.text() + " is " + shown(v) + unit + "; at most " + shown(most) + unit +
               " is allowed");
}
Result<void> placement(const Placement& p, const What& what) {
  RMP_TRY(finite(p.position, {"the position of ", what}));
  RMP_TRY(finite(p.angles, {"an angle of the placement of ", what}));
  if (p.notation > AngleRepresentation::zyz || p.coordinates > PositionRepresentation::spherical)
    return fault("the placement of " + what.text() + " has an unknown notation");
  return {};
}
Result<void> near(const Placement& p, const What& what) {
  RMP_TRY(placement(p, what));
  for (const double x : position(p))
    RMP_TRY(at_most(x, kLongest, {"a coordinate of ", what}, " m"));
  return {};
}
Result<void> choice(const ProviderChoice& p, const std::string& what) {
  for (const auto& [name, value] : p.params) {
    const std::string which = "parameter " + quote(name) + " of " + what;
    if (!is_name(name) || name.find(' ') != std::string::npos || name == "point")
      return bad_name(name, "parameter of " + what);
    if (const auto* v = std::get_if<double>(&value)) RMP_TRY(finite(*v, which));
    if (const auto* v = std::get_if<std::vector<double>>(&value)) RMP_TRY(finite(*v, which));
  }
  return {};
}

/// Names seen so far within one record.
class Names {
 public:
  explicit Names(const char* what) : what_(what) {}
  Result<void> add(const std::string& name) {
    if (!is_name(name)) return bad_name(name, what_);
    if (!seen_.insert(name).second)
      return error(
          ErrorCode::conflict,
          "there are two " +
              (std::string_view(what_) == "axis" ? std::string("axes") : std::string(what_) + "s") +
              " named " + quote(name),
          "Give each its own name.");
    return {};
  }

 private:
  const char* what_;
  std::unordered_set<std::string_view> seen_;  // the record's own
};

Result<void> check_size(const CsgSize& size, double value, const std::string& which) {
  const std::string unit = size.unit.empty() ? "" : " " + std::string(size.unit);
  const char* tail = unit.c_str();
  switch (size.range) {
    case CsgRange::positive: return positive(value, which, tail);
    case CsgRange::not_negative: return not_negative(value, which, tail);
    case CsgRange::any: return finite(value, which);
    case CsgRange::count: break;
  }
  if (value >= 1 && value <= 10'000 && value == std::floor(value)) return {};
  return fault(which + " is " + text::print(value) + "; it must be a whole number from 1 to 10000");
}

using Point = std::array<double, 2>;

/// Shorter than any line that can be made or drawn; engines work to about 1e-7 mm.
constexpr double kShortest = 1e-9;  // m

double distance(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

Result<void> check_curve(const CsgCurve& c, const Point& start, const std::string& what) {
  const auto points = c.points.size();
  switch (c.kind) {
    case CsgCurve::Kind::line:
      if (points != 1) return fault(what + " must have one point, its end");
      if (distance(start, c.points[0]) < kShortest)
        return fault(what + " ends where it begins", "Remove it.");
      return {};
    case CsgCurve::Kind::arc: {
      if (points != 2) return fault(what + " must have two points, one on the arc and its end");
      const Point &by = c.points[0], &end = c.points[1];
      const double cross =
          (by[0] - start[0]) * (end[1] - start[1]) - (by[1] - start[1]) * (end[0] - start[0]);
      const double longest =
          std::max({distance(start, by), distance(by, end), distance(start, end)});
      if (std::fabs(cross) < kShortest * longest)
        return fault("the three points of " + what + " are on a line or coincide",
                     "Use a line, or a circle in a separate loop.");
      return {};
    }
    case CsgCurve::Kind::spline: {
      if (points == 0) return fault(what + " has no points");
      const Point* before = &start;
      for (const Point& p : c.points) {
        if (distance(*before, p) < kShortest)
          return fault(what + " has the same point twice in a row", "Remove one of them.");
        before = &p;
      }
      return {};
    }
    case CsgCurve::Kind::circle:
      return fault(what + " cannot share a loop with other curves",
                   "Put the circle into a separate loop.");
  }
  return fault(what + " is of an unknown kind");
}

Result<void> check_loop(const CsgLoop& l, const std::string& loop) {
  if (l.curves.empty()) return fault(loop + " has no curves");
  if (l.curves.size() == 1 && l.curves[0].kind == CsgCurve::Kind::circle) {
    const auto& points = l.curves[0].points;
    if (points.size() != 2)
      return fault("the circle of " + loop + " needs its centre and its radius");
    for (const double x : points[0]) RMP_TRY(at_most(x, kLongest, "the centre of " + loop, " m"));
    RMP_TRY(positive(points[1][0], "the radius of " + loop, " m"));
    return at_most(points[1][0], kLongest, "the radius of " + loop, " m");
  }
  for (const double x : l.start) RMP_TRY(at_most(x, kLongest, "the start of " + loop, " m"));
  Point at = l.start;
  bool is_curved = false;
  for (std::size_t k = 0; k < l.curves.size(); ++k) {
    const CsgCurve& c = l.curves[k];
    const std::string curve = "curve " + std::to_string(k + 1) + " of " + loop;
    for (const Point& p : c.points)
      for (const double x : p) RMP_TRY(at_most(x, kLongest, "a coordinate of " + curve, " m"));
    RMP_TRY(check_curve(c, at, curve));
    at = c.points.back();
    is_curved = is_curved || c.kind == CsgCurve::Kind::arc || c.points.size() > 1;
  }
  const std::size_t edges = l.curves.size() + (distance(at, l.start) < kShortest ? 0 : 1);
  if (edges < 3 && !is_curved)
    return fault(loop + " encloses no area: it has fewer than three corners");
  return {};
}

Result<void> check_profile(const SolidNode& n, const std::string& of) {
  if (n.profile->loops.empty())
    return fault("the profile" + of + " has no loops", "Give it at least one outline.");
  for (std::size_t i = 0; i < n.profile->loops.size(); ++i) {
    const CsgLoop& l = n.profile->loops[i];
    const std::string loop = "loop " + std::to_string(i + 1) + " of the profile" + of;
    RMP_TRY(check_loop(l, loop));
    if (n.kind != CsgKind::revolution) continue;
    const bool is_circle = l.curves[0].kind == CsgCurve::Kind::circle;
    double least = is_circle ? l.curves[0].points[0][0] - l.curves[0].points[1][0] : l.start[0];
    if (!is_circle)
      for (const CsgCurve& c : l.curves)
        for (const Point& p : c.points) least = std::min(least, p[0]);
    if (least < -kShortest)
      return fault(loop + " reaches x = " + shown(least) + " m, beyond its axis of revolution",
                   "Keep x at 0 or more.");
  }
  return {};
}

/// What a kind has beside its sizes, and what no other kind may have.
Result<void> check_extras(const SolidNode& n, const std::string& of) {
  const CsgNodeInfo& info = csg_info(n.kind);
  const std::string node = std::string(info.name) + " " + quote(n.name);
  const auto foreign = [&](const char* what) {
    return fault(node + " has " + what + ", which its kind does not use");
  };
  const bool is_drawn = n.kind == CsgKind::prism || n.kind == CsgKind::revolution;
  if (is_drawn && !n.profile) return fault(node + " has no profile", "Give it at least one loop.");
  if (n.profile && !is_drawn) return foreign("a profile");
  if (n.profile) RMP_TRY(check_profile(n, of));

  if (n.kind == CsgKind::imported && !n.geometry)
    return fault(node + " has no geometry", "Import it from a file.");
  if (n.geometry && n.kind != CsgKind::imported) return foreign("a geometry");

  const bool is_custom = n.kind == CsgKind::custom;
  if (is_custom && n.primitive.name.empty())
    return fault(node + " names no primitive", "Give the name of a plugin's primitive.");
  if (is_custom && !is_name(n.primitive.name)) return bad_name(n.primitive.name, "primitive");
  if (!is_custom && (!n.primitive.name.empty() || !n.primitive.params.empty()))
    return foreign("a plugin's primitive");
  RMP_TRY(choice(n.primitive, node));

  if (!n.select.empty()) {
    if (n.kind != CsgKind::fillet && n.kind != CsgKind::chamfer)
      return foreign("a selection of edges");
    if (auto tests = parse_csg_select(n.select); !tests.ok())
      return std::move(tests).error().in(node);
  }
  return {};
}

Result<void> check_fillet(double fillet, double smallest, const char* of_what,
                          const std::string& of) {
  if (fillet == 0 || fillet < smallest / 2) return {};
  return fault("the fillet" + of + " is " + shown(fillet) +
               " m; it must be less than half the smallest " + of_what + ", " +
               shown(smallest / 2) + " m");
}

/// Sizes that are in range one by one and make no sense together.
Result<void> check_sizes_together(const SolidNode& n, const std::string& of) {
  const auto& v = n.sizes;
  if (n.is_centred && !model::height_of(n.kind))
    return fault("a " + std::string(csg_info(n.kind).name) + of + " cannot be centred",
                 "Only primitives with their base at z = 0 can be centred.");
  switch (n.kind) {
    case CsgKind::box: return check_fillet(v[3], std::min({v[0], v[1], v[2]}), "side", of);
    case CsgKind::cylinder:
      return check_fillet(v[2], std::min(2 * v[0], v[1]), "of diameter and height", of);
    case CsgKind::torus:
      if (v[1] >= v[0])
        return fault("tube_radius" + of + " is " + shown(v[1]) +
                     " m; it must be less than ring_radius, " + shown(v[0]) + " m");
      break;
    case CsgKind::wedge:
      if (v[3] > v[0])
        return fault("top_x" + of + " is " + shown(v[3]) + " m; it must not be greater than x, " +
                     shown(v[0]) + " m");
      break;
    case CsgKind::cone:
      if (v[0] == 0 && v[1] == 0)
        return fault("both radii" + of + " are 0", "Give one of them a size.");
      break;
    case CsgKind::mirror:
      if (std::hypot(v[0], v[1], v[2]) < 1e-12)
        return fault("the normal" + of + " is zero",
                     "It must be the direction that the plane faces.");
      if (v[4] != 0 && v[4] != 1)
        return fault("keep" + of + " is " + shown(v[4]) + "; it must be 1 or 0");
      break;
    case CsgKind::scale:
      for (std::size_t k = 0; k < 3; ++k)
        if (!(v[k] >= kCsgSmallestFactor && v[k] <= kCsgGreatestFactor))
          return fault(std::string(csg_info(n.kind).sizes[k].name) + of + " is " + shown(v[k]) +
                       "; a scale is from " + shown(kCsgSmallestFactor) + " to " +
                       shown(kCsgGreatestFactor));
      break;
    case CsgKind::linear_pattern:
      if (v[0] > 1 && std::hypot(v[1], v[2], v[3]) < kShortest)
        return fault("the copies" + of + " all lie at the same position", "Give dx, dy or dz.");
      break;
    case CsgKind::circular_pattern:
      if (v[0] > 1 && v[1] == 0)
        return fault("the copies" + of + " all lie at the same position", "Give the angle.");
      if (std::fabs(v[1]) > kCsgFullTurn + 1e-9)
        return fault("the angle" + of + " is " + shown(v[1]) +
                     " rad; at most a full turn is allowed");
      break;
    case CsgKind::pyramid:
      if (v[0] < 3) return fault("sides" + of + " is " + shown(v[0]) + "; it must be at least 3");
      break;
    case CsgKind::revolution:
      if (v[0] > kCsgFullTurn + 1e-9)
        return fault("the angle" + of + " is " + shown(v[0]) +
                     " rad; at most a full turn is allowed");
      break;
    default: break;
  }
  return {};
}

/// `children`: how many nodes it has inside.
Result<void> check_node(const Solid& s, std::size_t i, std::size_t children) {
  const SolidNode& n = s.nodes[i];
  const std::string node = "node " + quote(n.name);
  if (i == 0 ? n.parent != -1 : (n.parent < 0 || static_cast<std::size_t>(n.parent) >= i))
    return fault(i == 0 ? node + " is the root, so it cannot have a parent"
                        : node + " does not come after its parent",
                 "Every node except the first needs a parent, and parents come first.");
  if (n.parent >= 0) {
    const auto& p = s.nodes[static_cast<std::size_t>(n.parent)];
    const CsgNodeInfo& above = csg_info(p.kind);
    if (above.children == CsgChildren::none)
      return fault(node + " is inside " + std::string(above.name) + " " + quote(p.name) +
                       ", which is a primitive",
                   "Only an operation such as a union, or a modifier, can contain nodes.");
  }
  RMP_TRY(placement(n.placement, node));
  const CsgNodeInfo& info = csg_info(n.kind);
  if (info.kind != n.kind) return fault(node + " is of an unknown kind");
  const std::string of = " of " + std::string(info.name) + " " + quote(n.name);
  for (std::size_t k = 0; k < csg_size_count(n.kind); ++k)
    RMP_TRY(check_size(info.sizes[k], n.sizes[k], std::string(info.sizes[k].name) + of));
  RMP_TRY(check_sizes_together(n, of));
  RMP_TRY(check_extras(n, of));
  if (info.children != CsgChildren::one) return {};
  if (children == 1) return {};
  return fault(std::string(info.name) + " " + quote(n.name) + " has " +
                   (children == 0 ? std::string("no node") : std::to_string(children) + " nodes") +
                   " inside; it needs exactly one",
               children == 0 ? "Put one inside." : "Put them into a union.");
}

/// No body has a negative principal moment, nor one greater than the two others together.
Result<void> possible(const Sym3& inertia) {
  constexpr double kRounding = 1e-3;  ///< of figures that were rounded when written down
  const Vec3 p = spatial::principal(inertia).moments;
  const double slack = kRounding * p[2];
  if (p[0] >= -slack && p[0] + p[1] >= p[2] - slack) return {};
  return fault("the measured inertia has the principal moments " + shown(p[0]) + ", " +
                   shown(p[1]) + " and " + shown(p[2]) + " kg m^2, which are impossible for a body",
               p[0] < -slack ? "None may be negative; check the products of inertia and their sign."
                             : "None may be greater than the sum of the other two.");
}

Result<void> measured(const std::optional<MeasuredMass>& m) {
  if (!m) return {};
  RMP_TRY(positive(m->mass.mass, "the measured mass", " kg"));
  RMP_TRY(at_most(m->mass.mass, kHeaviest, "the measured mass", " kg"));
  for (const double x : m->mass.com)
    RMP_TRY(at_most(x, kLongest, "a coordinate of the measured centre of mass", " m"));
  const Sym3& s = m->mass.inertia;
  RMP_TRY(finite(std::array{s.xx, s.yy, s.zz, s.xy, s.yz, s.xz}, "the measured inertia"));
  for (const double v : {s.xx, s.yy, s.zz})
    RMP_TRY(not_negative(v, "a diagonal element of the measured inertia", " kg m^2"));
  return possible(s);
}

Result<void> check(const Material&, Subject&, const Watch&) { return {}; }

Result<void> check(const OtherContent& other, Subject& subject, const Watch&) {
  return check_names({info(other.kind()).type, other.data()}, subject);
}

Result<void> check(const Solid& s, Subject& subject, const Watch& watch) {
  RMP_TRY(measured(s.measured));
  Names names("node");
  std::vector<std::size_t> children(s.nodes.size());
  for (const SolidNode& n : s.nodes)
    if (n.parent >= 0 && static_cast<std::size_t>(n.parent) < children.size())
      ++children[static_cast<std::size_t>(n.parent)];
  for (std::size_t i = 0; i < s.nodes.size(); ++i) {
    RMP_TRY(watch.at(i));
    subject = {"node", i};
    RMP_TRY(names.add(s.nodes[i].name));
    RMP_TRY(check_node(s, i, children[i]));
  }
  return {};
}

Result<void> solid_or_object(AnyId id, const What& what) {
  if (!id)
    return fault(what.text() + " has neither a solid nor an object", "Give a solid or an object.");
  return {};
}

Result<void> check(const Object& o, Subject& subject, const Watch& watch) {
  RMP_TRY(measured(o.measured));
  Names names("part");
  for (std::size_t i = 0; i < o.parts.size(); ++i) {
    const ObjectPart& p = o.parts[i];
    RMP_TRY(watch.at(i));
    subject = {"part", i};
    RMP_TRY(names.add(p.name));
    const What part = What::named("part ", p.name);
    RMP_TRY(solid_or_object(p.what, part));
    RMP_TRY(placement(p.placement, part));
  }
  Names tcps("tool centre point");
  for (std::size_t i = 0; i < o.tcps.size(); ++i) {
    const ToolCentrePoint& t = o.tcps[i];
    subject = {"tcp", i};
    RMP_TRY(tcps.add(t.name));
    RMP_TRY(near(t.placement, "tool centre point " + quote(t.name)));
  }
  return {};
}

/// `kind` such as "given ", `of` such as ` of link "elbow"`.
Result<void> check_mass(const MassProperties& m, std::string_view kind, const What& of) {
  RMP_TRY(not_negative(m.mass, {"the ", kind, "mass", of}, " kg"));
  RMP_TRY(at_most(m.mass, kHeaviest, {"the ", kind, "mass", of}, " kg"));
  RMP_TRY(finite(m.com, {"the ", kind, "centre of mass", of}));
  const Sym3& s = m.inertia;
  RMP_TRY(finite(std::array{s.xx, s.yy, s.zz, s.xy, s.yz, s.xz}, {"the ", kind, "inertia", of}));
  for (const double v : {s.xx, s.yy, s.zz})
    RMP_TRY(not_negative(v, {"a diagonal element of the ", kind, "inertia", of}, " kg m^2"));
  return {};
}

Result<void> check_link(const Robot& r, std::size_t i) {
  const Link& l = r.links[i];
  const What link = What::named("link ", l.name), of = What::named(" of link ", l.name);
  if (l.parent < -1 || l.parent >= static_cast<std::int32_t>(i))
    return fault(link.text() + " does not come after its parent",
                 "Parents come first; -1 is the base.");
  if (l.origin) {
    RMP_TRY(near(*l.origin, {"the origin", of}));
    if (!(l.row == DhRow{}))
      return fault(link.text() + " has a row and an origin", "Keep only one of them.");
  }
  if (!(std::hypot(l.axis[0], l.axis[1], l.axis[2]) > 1e-9))
    return fault("the axis" + of.text() + " has no direction", "Give a vector such as (0, 0, 1).");
  if (l.mimic) {
    if (l.mimic->link < 0 || l.mimic->link >= static_cast<std::int32_t>(i))
      return fault("the joint" + of.text() + " follows a joint that does not come before it",
                   "A joint can only follow the joint of an earlier link.");
    for (const Link* joint : {&l, &r.links[static_cast<std::size_t>(l.mimic->link)]})
      if (!robotics::has_one_coordinate(joint->joint))
        return fault("the joint" + of.text() + " follows another one, but that of link " +
                         quote(joint->name) + " is neither revolute nor prismatic",
                     "Only joints of one coordinate can follow and be followed.");
  }
  if (!(l.lower <= l.upper))
    return fault("the lower limit" + of.text() + " is " + shown(l.lower) + " and the upper " +
                     shown(l.upper),
                 "The lower limit must not exceed the upper one.");
  if (l.given) RMP_TRY(check_mass(*l.given, "given ", of));
  for (const auto& p : l.parts) {
    RMP_TRY(solid_or_object(p.what, {"a part", of}));
    RMP_TRY(placement(p.placement, {"a part", of}));
  }
  return {};
}

Result<void> check(const std::vector<CollisionPairRule>& rules) {
  std::set<std::pair<std::string_view, std::string_view>> seen;
  for (const CollisionPairRule& p : rules) {
    if (!is_name(p.a)) return bad_name(p.a, "body of a pair");
    if (!is_name(p.b)) return bad_name(p.b, "body of a pair");
    if (!seen.insert(std::minmax<std::string_view>(p.a, p.b)).second)
      return fault("the pair of " + quote(p.a) + " and " + quote(p.b) + " has two rules",
                   "Keep one of them.");
  }
  return {};
}

/// The tools attached to a robot and the centre point that is its tool; whether objects have such
/// points shows when they are asked for, since they are records of their own.
Result<void> check_attached(const Robot& r, Subject& subject) {
  subject = {};
  if (r.attached.empty() && r.tcp.empty()) return {};
  const auto count = static_cast<std::int32_t>(r.links.size());
  std::unordered_set<std::string_view> taken{"tool", "base"};
  for (const Link& l : r.links) taken.insert(l.name);
  for (const RobotTool& t : r.tools) taken.insert(t.name);
  const AttachedTool* holder = nullptr;
  for (std::size_t i = 0; i < r.attached.size(); ++i) {
    const AttachedTool& t = r.attached[i];
    subject = {"attached", i};
    const std::string what = "the attached tool " + quote(t.name);
    if (!is_name(t.name) || t.name.find('.') != std::string::npos)
      return t.name.find('.') == std::string::npos
                 ? bad_name(t.name, "attached tool")
                 : fault(what + " has a dot in its name",
                         "Its centre points are named after a dot, as in torch.tip.");
    if (!taken.insert(t.name).second)
      return error(ErrorCode::conflict, "there are two links or tools named " + quote(t.name),
                   "Give each its own name.");
    RMP_TRY(solid_or_object(t.what, what));
    if (t.link < -1 || t.link >= count) return fault(what + " is not on a link of the robot");
    RMP_TRY(near(t.placement, what));
    if (r.tcp == t.name || r.tcp.starts_with(t.name + ".")) holder = &t;
  }
  subject = {};
  if (r.tcp.empty()) return {};
  if (!holder)
    return fault("the robot's tool is " + quote(r.tcp) + ", which is not on an attached tool",
                 "Attach the tool, or give no centre point.");
  if (holder->link != count - 1)
    return fault("the robot's tool is " + quote(r.tcp) + ", which is not on the last link",
                 "Its kinematics end there; name that centre point as tip instead.");
  return {};
}

/// Axes as the maker counts them: each of a joint of one coordinate, no two of one joint.
Result<void> check_maker_axes(const Robot& r, Subject& subject) {
  Names names("axis");
  const auto joint_of = [&](std::int32_t link, const std::string& what) -> Result<void> {
    if (link < 0 || link >= static_cast<std::int32_t>(r.links.size()))
      return fault(what + " does not belong to a link of the robot",
                   "Name the link that its joint moves.");
    const Link& l = r.links[static_cast<std::size_t>(link)];
    if (!robotics::has_one_coordinate(l.joint) || l.mimic)
      return fault(
          what + " is of link " + quote(l.name) + ", and its joint has no independent value",
          "Name a link with a revolute or prismatic joint that follows no other.");
    return {};
  };
  std::vector<bool> taken(r.links.size(), false);
  for (std::size_t i = 0; i < r.axes.size(); ++i) {
    const MakerAxis& a = r.axes[i];
    subject = {"axis", i};
    const std::string what = "axis " + quote(a.name);
    RMP_TRY(names.add(a.name));
    RMP_TRY(joint_of(a.link, what));
    const auto link = static_cast<std::size_t>(a.link);
    if (taken[link])
      return fault(
          what + " is of link " + quote(r.links[link].name) + ", as another axis already does",
          "Give each joint one axis; list further joints of this axis as its coupled ones.");
    taken[link] = true;
    if (a.sign != 1 && a.sign != -1)
      return fault("the sign of " + what + " is " + std::to_string(a.sign), "It is 1 or -1.");
    if (a.unit > AxisUnit::mm) return fault("the unit of " + what + " is unknown");
    const auto slides = [&](std::int32_t of) {
      return r.links[static_cast<std::size_t>(of)].joint == JointKind::prismatic;
    };
    if (slides(a.link) != (a.unit == AxisUnit::mm))
      return fault(what + " counts in " + (a.unit == AxisUnit::mm ? "mm" : "deg") + ", and joint " +
                       quote(r.links[link].name) + (slides(a.link) ? " slides" : " turns"),
                   slides(a.link) ? "Give it the unit mm." : "Give it the unit deg.");
    RMP_TRY(finite(a.offset, {"the offset of ", what}));
    RMP_TRY(at_most(a.offset, kLongest, {"the offset of ", what}, ""));
    std::set<std::int32_t> coupled{a.link};
    for (const AxisCoupling& c : a.coupled) {
      RMP_TRY(joint_of(c.link, "a coupled joint of " + what));
      RMP_TRY(at_most(c.ratio, kLongest, {"a ratio of ", what}, ""));
      if (!coupled.insert(c.link).second)
        return fault(what + " counts joint " +
                     quote(r.links[static_cast<std::size_t>(c.link)].name) + " twice");
      if (slides(c.link) != slides(a.link))
        return fault(what + " combines a revolute and a prismatic joint",
                     "Coupled joints must have the unit of the axis.");
    }
    if (std::isnan(a.lower) || std::isnan(a.upper) || a.lower > a.upper)
      return fault("the limits of " + what + " are " + shown(a.lower) + " to " + shown(a.upper),
                   "The lower limit comes first.");
  }
  subject = {};
  return {};
}

Result<void> check(const Robot& r, Subject& subject, const Watch& watch) {
  if (r.convention > Convention::mdh) return fault("the convention is unknown");
  if (r.mass_source > MassSource::designed) return fault("the source of masses is unknown");
  RMP_TRY(near(r.base, "the base"));
  RMP_TRY(near(r.tool, "the tool"));
  for (const auto& p : r.base_parts) {
    RMP_TRY(solid_or_object(p.what, "a part of the base"));
    RMP_TRY(placement(p.placement, "a part of the base"));
  }
  if (r.base_mass) RMP_TRY(check_mass(*r.base_mass, "", " of the base"));
  Names names("link");
  for (std::size_t i = 0; i < r.links.size(); ++i) {
    RMP_TRY(watch.at(i));
    subject = {"link", i};
    RMP_TRY(names.add(r.links[i].name));
    if (r.links[i].name == "base")
      return fault("a link cannot be named \"base\"",
                   "\"base\" is the frame that the first link is mounted on.");
    RMP_TRY(check_link(r, i));
  }
  const auto count = static_cast<std::int32_t>(r.links.size());
  const auto is_link = [count](std::int32_t link) { return link >= -1 && link < count; };
  if (r.payload) RMP_TRY(check_mass(*r.payload, "payload's ", " at the tool"));
  Names tools("tool");
  for (std::size_t i = 0; i < r.tools.size(); ++i) {
    const RobotTool& t = r.tools[i];
    subject = {"tool", i};
    RMP_TRY(tools.add(t.name));
    if (t.name == "tool")
      return fault("a further tool cannot be named \"tool\"",
                   "\"tool\" is the one on the last link.");
    if (!is_link(t.link))
      return fault("tool " + quote(t.name) + " is not attached to a link of the robot");
    RMP_TRY(near(t.placement, "tool " + quote(t.name)));
    if (t.payload) RMP_TRY(check_mass(*t.payload, "payload's ", " at tool " + quote(t.name)));
  }
  RMP_TRY(check_attached(r, subject));
  Names loops("loop");
  for (std::size_t i = 0; i < r.loops.size(); ++i) {
    const LoopClosure& l = r.loops[i];
    subject = {"loop", i};
    RMP_TRY(loops.add(l.name));
    if (l.kind > LoopKind::weld) return fault("loop " + quote(l.name) + " is of an unknown kind");
    if (!is_link(l.link_a) || !is_link(l.link_b) || l.link_a == l.link_b)
      return fault("loop " + quote(l.name) + " does not hold two links of the robot",
                   "Name two links, or a link and the base.");
    RMP_TRY(near(l.in_a, "a frame of loop " + quote(l.name)));
    RMP_TRY(near(l.in_b, "a frame of loop " + quote(l.name)));
  }
  RMP_TRY(check_maker_axes(r, subject));
  const std::vector<std::string_view> units = robotics::coordinate_units(r);
  Names poses("pose");
  for (std::size_t i = 0; i < r.poses.size(); ++i) {
    const NamedPose& p = r.poses[i];
    subject = {"pose", i};
    RMP_TRY(poses.add(p.name));
    RMP_TRY(finite(p.q, "a joint value of pose " + quote(p.name)));
    if (p.q.size() != units.size())
      return fault(
          "pose " + quote(p.name) + " has " + std::to_string(p.q.size()) +
          (p.q.size() == 1 ? " joint value; the robot has " : " joint values; the robot has ") +
          robotics::counted_coordinates(r));
    for (std::size_t k = 0; k + 3 < p.q.size(); k += units[k].empty() ? 4 : 1)
      if (units[k].empty() &&
          !(std::hypot(std::hypot(p.q[k], p.q[k + 1]), std::hypot(p.q[k + 2], p.q[k + 3])) > 1e-9))
        return fault("a quaternion of pose " + quote(p.name) + " is zero",
                     "Use 1 0 0 0 for no rotation.");
  }
  subject = {};
  RMP_TRY(check(r.pair_rules));
  RMP_TRY(choice(r.ik, "ik"));
  RMP_TRY(choice(r.inverse_dynamics, "inverse_dynamics"));
  RMP_TRY(choice(r.forward_dynamics, "forward_dynamics"));
  return choice(r.controller, "controller");
}

Result<void> check(const Trajectory& t, Subject& subject, const Watch& watch) {
  for (std::size_t i = 0; i < t.segments.size(); ++i) {
    RMP_TRY(watch.at(i));
    subject = {"segment", i};
    const std::string segment = "segment " + std::to_string(i + 1);
    const TrajectorySegment& s = t.segments[i];
    if (s.stored) {
      RMP_TRY(placement(s.placement, "the placement of " + segment));
      continue;
    }
    if (!is_name(s.shape.name)) return bad_name(s.shape.name, "shape of " + segment);
    RMP_TRY(choice(s.shape, segment));
    RMP_TRY(choice(s.law, "the law of " + segment));
    RMP_TRY(choice(s.orientation, "the orientation of " + segment));
    RMP_TRY(choice(s.turning, "the rotation timing law of " + segment));
    for (std::size_t k = 0; k < s.points.size(); ++k)
      RMP_TRY(placement(s.points[k], "point " + std::to_string(k + 1) + " of " + segment));
    for (std::size_t k = 0; k < s.joints.size(); ++k) {
      const std::string row = "joint vector " + std::to_string(k + 1) + " of " + segment;
      if (s.joints[k].empty() || s.joints[k].size() != s.joints.front().size())
        return fault(row + " has " + std::to_string(s.joints[k].size()) + " values, the first " +
                         std::to_string(s.joints.front().size()),
                     "All joint vectors of a segment must have one value for each joint.");
      for (const double q : s.joints[k])
        if (!std::isfinite(q)) return fault("a value of " + row + " is not a finite number", {});
    }
  }
  return {};
}

Result<void> check(const Signal& s) {
  const std::string signal = "signal " + quote(s.name);
  RMP_TRY(Expression::check_name(s.name, "signal"));
  if (s.kind > SignalKind::analogue) return fault(signal + " is of an unknown kind");
  RMP_TRY(finite(s.initial, "the initial value of " + signal));
  if (s.kind == SignalKind::digital) {
    if (s.initial != 0 && s.initial != 1)
      return fault("the initial value of " + signal + " is " + shown(s.initial),
                   "A digital signal must be 0 or 1.");
    if (!s.unit.empty())
      return fault(signal + " is digital but has the unit " + quote(s.unit), "Make it analogue.");
  } else if (!s.unit.empty()) {
    auto unit = units::parse(s.unit);
    if (!unit.ok()) return std::move(unit).error().in("the unit of " + signal);
  }
  return {};
}

Result<void> check_attachments(const World& w) {
  const auto has = [](const auto& list, const std::string& name) {
    return std::any_of(list.begin(), list.end(), [&](const auto& m) { return m.name == name; });
  };
  std::unordered_set<std::string> held;
  for (const Attachment& a : w.attachments) {
    if (!has(w.objects, a.object))
      return fault("there is no object " + quote(a.object) + " to be held by " + quote(a.robot),
                   "Name an object of the world.");
    if (!has(w.robots, a.robot))
      return fault("there is no robot " + quote(a.robot) + " to hold " + quote(a.object),
                   "Name a robot of the world.");
    if (!held.insert(a.object).second)
      return error(ErrorCode::conflict, "object " + quote(a.object) + " is attached twice",
                   "Keep one of its attachments.");
    if (!a.link.empty() && !is_name(a.link)) return bad_name(a.link, "link that holds an object");
    RMP_TRY(placement(a.tool_T_object, "the attached object " + quote(a.object)));
  }
  return {};
}

Result<void> check_bases(const World& w) {
  for (const PlacedRobot& r : w.robots) {
    if (r.base > BaseKind::serpentine)
      return fault("the base of robot " + quote(r.name) + " is of an unknown kind");
    if (r.base_trajectory.empty()) continue;
    if (r.base == BaseKind::fixed)
      return fault("robot " + quote(r.name) + " has a fixed base and the base trajectory " +
                       quote(r.base_trajectory),
                   "Make its base free_flying, free_floating or serpentine.");
    if (std::none_of(w.trajectories.begin(), w.trajectories.end(),
                     [&](const auto& t) { return t.name == r.base_trajectory; }))
      return fault("there is no trajectory " + quote(r.base_trajectory) +
                       " for the base of robot " + quote(r.name) + " to follow",
                   "Name a trajectory of the world.");
  }
  return {};
}

Result<void> check(const PlacedObject& o) {
  const What object = What::named("object ", o.name);
  RMP_TRY(solid_or_object(o.what, object));
  return placement(o.placement, object);
}

/// All but the objects. `names` knows those of the objects.
Result<void> check_others(const World& w, Names& names, Subject& subject) {
  for (std::size_t i = 0; i < w.robots.size(); ++i) {
    const PlacedRobot& r = w.robots[i];
    subject = {"robot", i};
    RMP_TRY(names.add(r.name));
    if (!r.robot) return fault("the placed robot " + quote(r.name) + " names no robot");
    RMP_TRY(placement(r.placement, "robot " + quote(r.name)));
    RMP_TRY(finite(r.q, "a joint value of robot " + quote(r.name)));
  }
  for (std::size_t i = 0; i < w.trajectories.size(); ++i) {
    const PlacedTrajectory& t = w.trajectories[i];
    subject = {"trajectory", i};
    RMP_TRY(names.add(t.name));
    if (!t.trajectory)
      return fault("the placed trajectory " + quote(t.name) + " names no trajectory");
    RMP_TRY(placement(t.placement, "trajectory " + quote(t.name)));
  }
  for (std::size_t i = 0; i < w.frames.size(); ++i) {
    subject = {"frame", i};
    RMP_TRY(names.add(w.frames[i].name));
    RMP_TRY(placement(w.frames[i].placement, "frame " + quote(w.frames[i].name)));
  }
  for (std::size_t i = 0; i < w.lights.size(); ++i) {
    const PlacedLight& l = w.lights[i];
    const std::string light = "light " + quote(l.name);
    subject = {"light", i};
    RMP_TRY(names.add(l.name));
    RMP_TRY(placement(l.placement, light));
  }
  for (std::size_t i = 0; i < w.tasks.size(); ++i) {
    const PlacedTask& t = w.tasks[i];
    subject = {"task", i};
    RMP_TRY(names.add(t.name));
    if (!t.task) return fault("the placed task " + quote(t.name) + " names no task");
    if (!t.robot.empty() && !is_name(t.robot)) return bad_name(t.robot, "robot of a task");
  }
  for (std::size_t i = 0; i < w.programs.size(); ++i) {
    const PlacedProgram& p = w.programs[i];
    subject = {"program", i};
    RMP_TRY(names.add(p.name));
    if (!p.program) return fault("the placed program " + quote(p.name) + " names no program");
    if (!p.robot.empty() && !is_name(p.robot)) return bad_name(p.robot, "robot of a program");
    for (const ProgramBinding& b : p.bindings) {
      RMP_TRY(finite(b.reach, "a reach of program " + quote(p.name)));
      RMP_TRY(finite(b.value, "a value of program " + quote(p.name)));
    }
  }
  Names signals("signal");
  for (std::size_t i = 0; i < w.signals.size(); ++i) {
    subject = {"signal", i};
    RMP_TRY(signals.add(w.signals[i].name));
    RMP_TRY(check(w.signals[i]));
  }
  subject = {};
  RMP_TRY(check_attachments(w));
  RMP_TRY(check_bases(w));
  return check(w.pair_rules);
}

Result<void> check(const World& w, Subject& subject, const Watch& watch) {
  RMP_TRY(finite(w.gravity, "gravity"));
  Names names("member");
  for (std::size_t i = 0; i < w.objects.size(); ++i) {
    RMP_TRY(watch.at(i));
    subject = {"object", i};
    RMP_TRY(names.add(w.objects[i].name));
    RMP_TRY(check(w.objects[i]));
  }
  return check_others(w, names, subject);
}

template <class Fn>
void for_each_other_name(const World& w, Fn&& fn) {
  const auto each = [&fn](const auto& list) {
    for (const auto& m : list) fn(m.name);
  };
  each(w.robots);
  each(w.trajectories);
  each(w.frames);
  each(w.lights);
  each(w.tasks);
  each(w.programs);
}

/// Calls `fn` for the objects in blocks that `other` does not have at the same places.
template <class Fn>
void for_each_own_object(const World& w, const World& other, Fn&& fn) {
  for (std::size_t i = 0; i < w.objects.size(); ++i) {
    if (i % w.objects.kBlock == 0 && w.objects.shares_block(other.objects, i))
      i += w.objects.kBlock - 1;
    else fn(w.objects[i]);
  }
}

/// A world that was `before`, which has passed. Faults are not reported in the order of
/// check(World).
Result<void> check_edited(const World& w, const World& before) {
  RMP_TRY(finite(w.gravity, "gravity"));
  Names names("member");
  Result<void> held;
  for_each_own_object(w, before, [&](const PlacedObject& o) {
    if (held.ok()) held = names.add(o.name);
    if (held.ok()) held = check(o);
  });
  RMP_TRY(std::move(held));
  Subject subject;
  RMP_TRY(check_others(w, names, subject));
  // A name that no object shared with the one before may have: it was there beside them or is new.
  std::unordered_set<std::string_view> known;
  for_each_own_object(before, w, [&](const PlacedObject& o) { known.insert(o.name); });
  for_each_other_name(before, [&](const std::string& name) { known.insert(name); });
  std::vector<std::string_view> fresh;
  const auto look = [&](const std::string& name) {
    if (!known.contains(name)) fresh.push_back(name);
  };
  for_each_own_object(w, before, [&](const PlacedObject& o) { look(o.name); });
  for_each_other_name(w, look);
  if (fresh.empty()) return {};
  constexpr std::size_t kFew = 4;
  const std::unordered_set<std::string_view> many(
      fresh.begin(), fresh.size() > kFew ? fresh.end() : fresh.begin());
  for (std::size_t i = 0; i < w.objects.size(); ++i) {
    if (i % w.objects.kBlock == 0 && !w.objects.shares_block(before.objects, i)) {
      i += w.objects.kBlock - 1;
      continue;
    }
    const std::string& name = w.objects[i].name;
    // Names of one length in a row differ in their last digits.
    const auto is_it = [&name](std::string_view other) {
      return other.size() == name.size() && other.back() == name.back() && other == name;
    };
    if (many.empty() ? std::any_of(fresh.begin(), fresh.end(), is_it) : many.contains(name))
      return fault("there are two members named " + quote(name));
  }
  return {};
}

/// What one step says, without where it stands.
Result<void> check(const TaskStep& s, const std::string& step) {
  for (const std::string* name : {&s.robot, &s.pose, &s.frame, &s.object, &s.link, &s.signal})
    if (!name->empty() && !is_name(*name)) return bad_name(*name, "member that " + step + " means");
  const auto compiles = [&]() -> Result<void> {
    auto compiled = Expression::compile(s.expression);
    if (!compiled.ok()) return std::move(compiled).error().in(step);
    return {};
  };
  switch (s.kind) {
    case StepKind::move: {
      const int ways = static_cast<int>(static_cast<bool>(s.trajectory)) +
                       static_cast<int>(!s.pose.empty()) + static_cast<int>(!s.joints.empty()) +
                       static_cast<int>(s.target && !s.trajectory);
      if (ways != 1)
        return fault(step + (ways == 0 ? " has no destination" : " has several destinations"),
                     "Give one of trajectory, pose, joints and target.");
      RMP_TRY(finite(s.joints, "a joint value of " + step));
      if (s.target) RMP_TRY(placement(*s.target, "the target of " + step));
      if (!s.profile.empty() && s.profile != "quintic" && s.profile != "trapezoidal" &&
          s.profile != "s_curve" && s.profile != "time_optimal")
        return fault(quote(s.profile) + " is not a profile of a move",
                     "There are \"quintic\", \"trapezoidal\", \"s_curve\" and \"time_optimal\".");
      if (s.is_straight && (!s.target || s.trajectory))
        return fault(step + " is a straight move without a target", "Give it a target.");
      return {};
    }
    case StepKind::attach:
    case StepKind::detach:
      if (s.object.empty()) return fault(step + " names no object", "Give object = ...");
      return {};
    case StepKind::set:
      if (s.signal.empty()) return fault(step + " names no signal", "Give signal = ...");
      return compiles();
    case StepKind::wait:
      if (s.expression.empty() == (s.duration == 0))
        return fault(step + " needs either a time or a condition",
                     "Give time = ... or condition = ...");
      return s.expression.empty() ? Result<void>() : compiles();
    case StepKind::when: return compiles();
    case StepKind::call:
      if (!s.task) return fault(step + " names no task", "Give task = ...");
      return {};
    case StepKind::repeat:
    case StepKind::otherwise:
    case StepKind::message: return {};
  }
  return fault(step + " is of an unknown kind");
}

Result<void> check(const Task& t, Subject& subject, const Watch& watch) {
  std::vector<std::int32_t> last;  // the last step of each open block, outermost first
  std::vector<std::int32_t> open{-1};
  last.push_back(-1);
  for (std::size_t i = 0; i < t.steps.size(); ++i) {
    const TaskStep& s = t.steps[i];
    RMP_TRY(watch.at(i));
    subject = {"step", i};
    if (s.kind > StepKind::message) return fault("a step is of an unknown kind");
    const std::string step =
        "step " + std::to_string(i + 1) + " (" + std::string(to_string(s.kind)) + ")";
    while (open.size() > 1 && open.back() != s.parent) {
      open.pop_back();
      last.pop_back();
    }
    if (open.back() != s.parent)
      return fault(step + " does not follow the other steps of its block",
                   "Put the steps of a block directly after it.");
    const std::int32_t before = last.back();
    if (s.kind == StepKind::otherwise &&
        (before < 0 || t.steps[static_cast<std::size_t>(before)].kind != StepKind::when))
      return fault(step + " does not follow an if",
                   "Put an else directly after the block of an if.");
    last.back() = static_cast<std::int32_t>(i);
    if (is_block(s.kind)) {
      open.push_back(static_cast<std::int32_t>(i));
      last.push_back(-1);
    }
    RMP_TRY(check(s, step));
    if (const auto foreign = foreign_step_fields(s); !foreign.empty()) {
      const std::string name(foreign.front()->name);
      Error e = fault(step + " has a value for " + quote(name) + ", which steps of kind " +
                          std::string(to_string(s.kind)) + " do not have",
                      "Steps of kind " + text::enumerate(step_kinds_with(*foreign.front())) +
                          " have it. Leave it out, or set the whole step to change its kind.");
      amend(e, [&](Fault& f) { f.subject.path = "steps[" + std::to_string(i + 1) + "]." + name; });
      return e;
    }
  }
  return {};
}

}  // namespace

bool is_name(std::string_view name) { return robomosp::is_name(name); }

std::string with_article(std::string_view noun) {
  const bool is_vowel =
      !noun.empty() && std::string_view("aeio").find(noun.front()) != std::string_view::npos;
  return (is_vowel ? "an " : "a ") + std::string(noun);
}

Error bad_name(std::string_view name, std::string_view what) {
  const std::string hint =
      "A name starts with a letter of any script and has letters, digits, _ - . and spaces, none "
      "at the end.";
  if (name.empty()) return fault("the name of " + with_article(what) + " is empty", hint);
  return fault(quote(name) + " cannot be the name of " + with_article(what), hint);
}

namespace {

/// What Lua is written in that travels with a record.
Result<void> check_solvers(const std::vector<KeptSolver>& solvers) {
  for (std::size_t i = 0; i < solvers.size(); ++i) {
    const KeptSolver& s = solvers[i];
    const std::string which = "solver " + quote(s.name);
    for (const std::string* name : {&s.name, s.provides.empty() ? &s.name : &s.provides})
      if (!is_name(*name)) return bad_name(*name, "solver");
    if (s.interface.empty() || s.interface.find_first_of(" \n\"") != std::string::npos)
      return fault("the interface of " + which + " is " + quote(s.interface),
                   "Such as \"robomosp.ik/1\".");
    if (text::trim(s.text).empty()) return fault("the text of " + which + " is empty");
    if (s.text.size() > kMostKeptText)
      return fault("the text of " + which + " has " + std::to_string(s.text.size()) +
                       " bytes; at most " + std::to_string(kMostKeptText) + " are kept",
                   "Keep it as a script in a folder of plugins.");
    if (const auto bad = text::first_bad_byte(s.text); bad != std::string::npos)
      return fault(
          "byte " + std::to_string(bad + 1) + " of the text of " + which + " is not UTF-8 text",
          "Lua is kept as text, not compiled.");
    for (std::size_t k = 0; k < i; ++k)
      if (solvers[k].interface == s.interface && solvers[k].name == s.name)
        return error(ErrorCode::conflict,
                     "two solvers of " + quote(s.interface) + " are named " + quote(s.name),
                     "Give each its own name.");
  }
  return {};
}

}  // namespace

namespace {

const FaultCodes kRecordCodes{
    {"record.invalid", ErrorCode::invalid_argument,
     "The content of a record contradicts itself or what its kind allows."},
    {"record.out_of_range", ErrorCode::invalid_argument,
     "A number of a record is outside of its range."},
    {"record.duplicate_name", ErrorCode::conflict, "Two elements of a record have one name."},
    {"record.bad_reference", ErrorCode::conflict,
     "A record refers to another one that is not there, or to a member that it does not have."},
};

/// `links[3]` of the element of a record.
std::string path_of(const Record& record, const Subject& place) {
  if (place.list.empty()) return {};
  for (const model::Field& f : content(record.body).type->fields)
    if (f.type->shape == model::Shape::list &&
        (f.word_in_files() == place.list || f.name == place.list))
      return std::string(f.name) + "[" + std::to_string(place.index + 1) + "]";
  return {};
}

/// What a fault of a record is about, where it does not say it more exactly.
void name_subject(Error& e, const Record& record, const Subject& place) {
  amend(e, [&](Fault& f) {
    if (f.code.starts_with("error."))
      f.code = e.code == ErrorCode::conflict ? "record.duplicate_name" : "record.invalid";
    if (f.subject.path.empty()) f.subject.path = path_of(record, place);
    f.subject.name = record.name;
  });
}

}  // namespace

Result<void> check_record(const Record& record, Subject* subject) {
  if (!is_name(record.name)) {
    Error e = bad_name(record.name, to_string(record.kind()));
    name_subject(e, record, {});
    return e;
  }
  Subject place;
  const Watch none(nullptr);
  auto result = check_ranges(content(record.body), place, none);
  if (result.ok())
    result = std::visit([&](const auto& body) { return check(body, place, none); }, record.body);
  if (result.ok()) result = check_solvers(record.solvers);
  if (subject && !result.ok()) *subject = place;
  if (!result.ok()) name_subject(result.error(), record, place);
  return std::move(result).in(std::string(to_string(record.kind())) + " " + quote(record.name));
}

Result<void> check_edit(const Record& record, const Record* before, const Progress* progress) {
  const Watch watch(progress);
  const auto* is = std::get_if<World>(&record.body);
  const auto* was = before ? std::get_if<World>(&before->body) : nullptr;
  Subject place;
  const Content old = before ? content(before->body) : Content{};
  auto held = check_ranges(content(record.body), place, watch, old);
  if (held.ok() && is && was) held = check_edited(*is, *was);
  else if (held.ok())
    held = std::visit([&](const auto& body) { return check(body, place, watch); }, record.body);
  if (!held.ok() && held.error().code == ErrorCode::cancelled) return held;
  if (held.ok() && (!before || before->solvers != record.solvers))
    held = check_solvers(record.solvers);
  if (held.ok() && is_name(record.name)) return {};
  return check_record(record);  // a fault is worded as by a look at all of it
}

}  // namespace robomosp::document
