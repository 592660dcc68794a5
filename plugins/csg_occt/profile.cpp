// SPDX-License-Identifier: Apache-2.0
#include "profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <BRepBuilderAPI_MakeEdge.hxx>
#include <BRepBuilderAPI_MakeFace.hxx>
#include <BRepBuilderAPI_MakeVertex.hxx>
#include <BRep_Builder.hxx>
#include <GeomAPI.hxx>
#include <Geom_Circle.hxx>
#include <Geom_Curve.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColgp_Array1OfPnt2d.hxx>
#include <TopoDS_Edge.hxx>
#include <TopoDS_Vertex.hxx>
#include <TopoDS_Wire.hxx>
#include <gp_Ax2.hxx>
#include <gp_Circ.hxx>

#include "primitives.h"

namespace robomosp::csg_occt {
namespace {

constexpr double kPi = std::numbers::pi;
// Curves nearer than this [mm] touch; some times OCCT's own tolerance.
constexpr double kTouch = 1e-6;
// Neighbours are not compared within this distance [mm] of the corner they share...
constexpr double kCornerReach = 1e-3;
// ...so that they must leave it at this angle [rad] to be apart beyond.
constexpr double kSharpest = 2e-3;
constexpr double kSmallest = kCsgSmallestLength * kMillimetresPerMetre;
constexpr double kGreatest = kCsgGreatestLength * kMillimetresPerMetre;

/// A part of an outline that turns by a right angle at most, or an arc; t runs from 0 to 1.
struct ProfilePiece {
  CsgCurve::Kind kind = CsgCurve::Kind::line;
  std::size_t loop = 0, curve = 0;
  gp_XY a{}, b{};
  gp_XY centre{};  // of an arc
  double radius = 0, from = 0, sweep = 0;
  std::array<gp_XY, 4> bezier{};  // of a spline

  gp_XY at(double t) const {
    switch (kind) {
      case CsgCurve::Kind::line: return a * (1 - t) + b * t;
      case CsgCurve::Kind::spline: {
        const double s = 1 - t;
        return bezier[0] * (s * s * s) + bezier[1] * (3 * s * s * t) + bezier[2] * (3 * s * t * t) +
               bezier[3] * (t * t * t);
      }
      default: {
        if (t == 0) return a;
        if (t == 1) return b;
        const double angle = from + sweep * t;
        return centre + gp_XY(std::cos(angle), std::sin(angle)) * radius;
      }
    }
  }
  gp_XY tangent(double t) const {
    switch (kind) {
      case CsgCurve::Kind::line: return b - a;
      case CsgCurve::Kind::spline: {
        const double s = 1 - t;
        return ((bezier[1] - bezier[0]) * (s * s) + (bezier[2] - bezier[1]) * (2 * s * t) +
                (bezier[3] - bezier[2]) * (t * t)) *
               3;
      }
      default: {
        const double angle = from + sweep * t;
        return gp_XY(-std::sin(angle), std::cos(angle)) * (radius * sweep);
      }
    }
  }
  gp_XY second(double t) const {  // of a spline
    return ((bezier[2] - bezier[1] * 2 + bezier[0]) * (1 - t) +
            (bezier[3] - bezier[2] * 2 + bezier[1]) * t) *
           6;
  }
  /// How far it can be from its chord between two parameters.
  double bulge(double t0, double t1) const {
    const double h = t1 - t0;
    switch (kind) {
      case CsgCurve::Kind::line: return 0;
      case CsgCurve::Kind::spline:
        return std::max(second(t0).Modulus(), second(t1).Modulus()) * h * h / 8;
      default: {
        const double half = std::abs(sweep) * h / 2;
        if (half >= kPi / 2) return 2 * radius;
        const double s = std::sin(half / 2);
        return 2 * radius * s * s;
      }
    }
  }
  double length_bound(double t0, double t1) const {
    switch (kind) {
      case CsgCurve::Kind::line: return (b - a).Modulus() * (t1 - t0);
      case CsgCurve::Kind::spline: return (at(t1) - at(t0)).Modulus() + 2 * bulge(t0, t1);
      default: return radius * std::abs(sweep) * (t1 - t0);
    }
  }
  /// Integral of x dy / 2 - y dx / 2, and of x^2 dy / 2.
  std::array<double, 2> green() const {
    static constexpr std::array<double, 4> x{-0.8611363115940526, -0.3399810435848563,
                                             0.3399810435848563, 0.8611363115940526};
    static constexpr std::array<double, 4> w{0.3478548451374538, 0.6521451548625461,
                                             0.6521451548625461, 0.3478548451374538};
    if (kind == CsgCurve::Kind::arc || kind == CsgCurve::Kind::circle) {
      // About the centre: x = cx + r cos, dy = r cos dt.
      const double f = from, g = from + sweep, r = radius, cx = centre.X(), cy = centre.Y();
      const double s = std::sin(g) - std::sin(f), c = std::cos(g) - std::cos(f);
      const double cos2 = sweep / 2 + (std::sin(2 * g) - std::sin(2 * f)) / 4;
      const double cos3 = s - (std::pow(std::sin(g), 3) - std::pow(std::sin(f), 3)) / 3;
      return {(r * r * sweep + cx * r * s - cy * r * c) / 2,
              (cx * cx * r * s + 2 * cx * r * r * cos2 + r * r * r * cos3) / 2};
    }
    std::array<double, 2> sum{};
    // A cubic gives x^2 y' of degree 8; two halves of four points take degree 7 each, and the
    // rest is far below what these integrals are compared with.
    for (const double start : {0.0, 0.5})
      for (std::size_t i = 0; i < 4; ++i) {
        const double t = start + 0.25 * (1 + x[i]);
        const gp_XY p = at(t), d = tangent(t);
        sum[0] += 0.25 * w[i] * (p.X() * d.Y() - p.Y() * d.X()) / 2;
        sum[1] += 0.25 * w[i] * p.X() * p.X() * d.Y() / 2;
      }
    return sum;
  }
};

double profile_distance(const gp_XY& p, const gp_XY& a, const gp_XY& b) {
  const gp_XY d = b - a;
  const double l = d.SquareModulus();
  const double t = l > 0 ? std::clamp((p - a).Dot(d) / l, 0.0, 1.0) : 0;
  return (p - a - d * t).Modulus();
}

double profile_distance(const gp_XY& a, const gp_XY& b, const gp_XY& c, const gp_XY& d) {
  const double ab_c = (b - a).Crossed(c - a), ab_d = (b - a).Crossed(d - a);
  const double cd_a = (d - c).Crossed(a - c), cd_b = (d - c).Crossed(b - c);
  if (ab_c * ab_d < 0 && cd_a * cd_b < 0) return 0;
  return std::min({profile_distance(a, c, d), profile_distance(b, c, d), profile_distance(c, a, b),
                   profile_distance(d, a, b)});
}

struct ProfileBox {
  gp_XY low{1e300, 1e300}, high{-1e300, -1e300};
  void add(const gp_XY& p, double around) {
    low = gp_XY(std::min(low.X(), p.X() - around), std::min(low.Y(), p.Y() - around));
    high = gp_XY(std::max(high.X(), p.X() + around), std::max(high.Y(), p.Y() + around));
  }
  void add(const ProfileBox& b) {
    add(b.low, 0);
    add(b.high, 0);
  }
  bool contains(const gp_XY& p) const {
    return p.X() >= low.X() && p.X() <= high.X() && p.Y() >= low.Y() && p.Y() <= high.Y();
  }
};

std::string print_metres(double mm) { return csg_number_text(mm / kMillimetresPerMetre) + " m"; }
std::string point_text(const gp_XY& p) {
  // Rounded to a nanometre: people read it.
  const auto text = [](double mm) { return csg_number_text(std::round(mm * 1e6) / 1e9 + 0.0); };
  return "(" + text(p.X()) + ", " + text(p.Y()) + ") m";
}

class Drawing {
 public:
  Drawing(const CsgProfile& profile, const ProfileUse& use, const Progress& progress)
      : profile_(profile), use_(use), progress_(progress) {}

  Result<std::vector<Region>> run() {
    if (profile_.loops.empty())
      return bad("the profile has no loops", "Give it at least one closed outline.");
    for (std::size_t l = 0; l < profile_.loops.size(); ++l) RMP_TRY(read(l));
    if (use_.is_revolved) RMP_TRY(check_axis());
    RMP_TRY(check_corners());
    RMP_TRY(check_crossings());
    return build();
  }

 private:
  struct Loop {
    std::size_t first = 0, count = 0;  // pieces
    ProfileBox box;
    double area = 0, moment_x = 0;
    std::size_t depth = 0;
  };

  static Error bad(std::string what, std::string remedy = {}) {
    return error(ErrorCode::invalid_argument, std::move(what), std::move(remedy));
  }
  std::string loop_text(std::size_t l) const { return "loop " + std::to_string(l + 1); }
  std::string curve_text(std::size_t l, std::size_t c) const {
    if (c >= profile_.loops[l].curves.size()) return "the line that closes " + loop_text(l);
    static constexpr std::array<const char*, 4> kinds{"line", "arc", "spline", "circle"};
    const auto kind = static_cast<std::size_t>(profile_.loops[l].curves[c].kind);
    return "curve " + std::to_string(c + 1) + " (" + kinds[kind] + ") of " + loop_text(l);
  }
  std::string text(const ProfilePiece& p) const { return curve_text(p.loop, p.curve); }

  static bool is_point(const std::array<double, 2>& p) {
    return std::isfinite(p[0]) && std::isfinite(p[1]) && std::abs(p[0]) <= kCsgGreatestLength &&
           std::abs(p[1]) <= kCsgGreatestLength;
  }
  gp_XY millimetres(const std::array<double, 2>& p) const {
    gp_XY q(p[0] * kMillimetresPerMetre, p[1] * kMillimetresPerMetre);
    // A corner that is meant to lie on the axis lies on it.
    if (use_.is_revolved && std::abs(q.X()) <= kTouch) q.SetX(0);
    return q;
  }

  Result<void> read(std::size_t l) {
    const CsgLoop& loop = profile_.loops[l];
    Loop made;
    made.first = pieces_.size();
    if (loop.curves.empty())
      return bad(loop_text(l) + " has no curves", "Draw it, or remove it from the profile.");
    for (std::size_t c = 0; c < loop.curves.size(); ++c) {
      const CsgCurve& curve = loop.curves[c];
      const auto kind = static_cast<std::size_t>(curve.kind);
      if (kind > 3)
        return bad("curve " + std::to_string(c + 1) + " of " + loop_text(l) +
                   " is of an unknown kind");
      const bool is_count_right = curve.kind == CsgCurve::Kind::line     ? curve.points.size() == 1
                                  : curve.kind == CsgCurve::Kind::spline ? !curve.points.empty()
                                                                         : curve.points.size() == 2;
      if (!is_count_right)
        return bad(curve_text(l, c) + " has " + std::to_string(curve.points.size()) + " points",
                   "A line has one, its end; an arc two, a via point and its end; a circle two, "
                   "its centre and (radius, 0); a spline at least one.");
      for (const auto& p : curve.points)
        if (!is_point(p))
          return bad(curve_text(l, c) + " has a point that is not a number or farther away than " +
                     csg_number_text(kCsgGreatestLength) + " m");
    }
    if (loop.curves[0].kind == CsgCurve::Kind::circle) {
      if (loop.curves.size() != 1)
        return bad(curve_text(l, 0) + " must be alone in its loop",
                   "Put the circle into a separate loop.");
      const auto& points = loop.curves[0].points;
      ProfilePiece circle{CsgCurve::Kind::circle, l, 0};
      circle.centre = gp_XY(points[0][0], points[0][1]) * kMillimetresPerMetre;
      circle.radius = points[1][0] * kMillimetresPerMetre;
      if (!(circle.radius >= kSmallest))
        return bad("the radius of the circle in " + loop_text(l) + " is " +
                   print_metres(circle.radius) + "; it must be at least " +
                   print_metres(kSmallest));
      circle.sweep = 2 * kPi;
      circle.a = circle.b = circle.centre + gp_XY(circle.radius, 0);
      pieces_.push_back(circle);
    } else {
      if (!is_point(loop.start))
        return bad("the start of " + loop_text(l) + " is not a number or farther away than " +
                   csg_number_text(kCsgGreatestLength) + " m");
      RMP_TRY(read_outline(l));
    }
    made.count = pieces_.size() - made.first;
    double length = 0;
    for (std::size_t i = made.first; i < pieces_.size(); ++i) {
      const ProfilePiece& p = pieces_[i];
      const auto [area, moment] = p.green();
      made.area += area;
      made.moment_x += moment;
      length += p.length_bound(0, 1);
      ProfileBox box;
      const double bulge = p.bulge(0, 1);
      box.add(p.a, bulge + kTouch);
      box.add(p.b, bulge + kTouch);
      boxes_.push_back(box);
      made.box.add(box);
    }
    if (std::abs(made.area) <= kTouch * length)
      return bad(loop_text(l) + " encloses no area", "Draw a closed outline.");
    loops_.push_back(made);
    return {};
  }

  Result<void> read_outline(std::size_t l) {
    const CsgLoop& loop = profile_.loops[l];
    const gp_XY start = millimetres(loop.start);
    gp_XY at = start;
    for (std::size_t c = 0; c < loop.curves.size(); ++c) {
      const CsgCurve& curve = loop.curves[c];
      gp_XY end = millimetres(curve.points.back());
      // The last point is the start where it is meant to be.
      if (c + 1 == loop.curves.size() && (end - start).Modulus() < kSmallest) end = start;
      ProfilePiece piece{curve.kind, l, c};
      piece.a = at;
      piece.b = end;
      switch (curve.kind) {
        case CsgCurve::Kind::line:
          if ((end - at).Modulus() < kSmallest)
            return bad(curve_text(l, c) + " ends where it begins, at " + point_text(at),
                       "Remove it from the profile.");
          pieces_.push_back(piece);
          break;
        case CsgCurve::Kind::arc:
          RMP_TRY(bend(piece, millimetres(curve.points[0])));
          pieces_.push_back(piece);
          break;
        case CsgCurve::Kind::spline: RMP_TRY(read_spline(piece, end)); break;
        default:
          return bad(curve_text(l, c) + " must be alone in its loop",
                     "Put the circle into a separate loop.");
      }
      at = end;
    }
    if ((at - start).Modulus() >= kSmallest) {
      ProfilePiece closing{CsgCurve::Kind::line, l, loop.curves.size()};
      closing.a = at;
      closing.b = start;
      pieces_.push_back(closing);
    }
    return {};
  }

  Result<void> bend(ProfilePiece& arc, const gp_XY& through) {
    const gp_XY u = through - arc.a, v = arc.b - arc.a;
    if (v.Modulus() < kSmallest)
      return bad(text(arc) + " ends where it begins, at " + point_text(arc.a),
                 "Use a circle for a full turn.");
    if (u.Modulus() < kSmallest || (through - arc.b).Modulus() < kSmallest)
      return bad("the via point of " + text(arc) + " is one of its ends, " + point_text(through),
                 "Give a point between the ends.");
    const double cross = u.Crossed(v);
    const double uu = u.SquareModulus(), vv = v.SquareModulus();
    const gp_XY to_centre = gp_XY(v.Y() * uu - u.Y() * vv, u.X() * vv - v.X() * uu) * (0.5 / cross);
    if (cross == 0 || !(to_centre.Modulus() <= kGreatest))
      return bad(text(arc) + " is straight: its three points lie on one line",
                 "Use a line, or move the via point.");
    arc.centre = arc.a + to_centre;
    arc.radius = (arc.a - arc.centre).Modulus();
    const auto angle = [&](const gp_XY& p) {
      return std::atan2(p.Y() - arc.centre.Y(), p.X() - arc.centre.X());
    };
    arc.from = angle(arc.a);
    arc.sweep = angle(arc.b) - arc.from;
    // Counter-clockwise when the way turns left.
    if (cross > 0 && arc.sweep <= 0) arc.sweep += 2 * kPi;
    if (cross < 0 && arc.sweep >= 0) arc.sweep -= 2 * kPi;
    return {};
  }

  Result<void> read_spline(const ProfilePiece& whole, const gp_XY& end) {
    std::vector<gp_XY> points{whole.a};
    for (const auto& p : profile_.loops[whole.loop].curves[whole.curve].points)
      points.push_back(millimetres(p));
    points.back() = end;
    for (std::size_t i = 1; i < points.size(); ++i)
      if ((points[i] - points[i - 1]).Modulus() < kSmallest)
        return bad(text(whole) + " passes twice in a row through " + point_text(points[i]),
                   "Remove one of the two points.");
    const NaturalSpline spline(points);
    for (std::size_t s = 0; s < spline.spans(); ++s) {
      if (s % 256 == 0 && progress_.cancelled()) return cancelled_error();
      std::vector<std::pair<std::array<gp_XY, 4>, int>> open{{spline.bezier(s), 0}};
      while (!open.empty()) {
        const auto [b, depth] = open.back();
        open.pop_back();
        // Directions within a right angle of each other: it cannot meet itself.
        const gp_XY d0 = b[1] - b[0], d1 = b[2] - b[1], d2 = b[3] - b[2];
        if (d0.Dot(d1) >= 0 && d1.Dot(d2) >= 0 && d0.Dot(d2) >= 0) {
          ProfilePiece piece = whole;
          piece.bezier = b;
          piece.a = b[0];
          piece.b = b[3];
          pieces_.push_back(piece);
          continue;
        }
        if (depth > 20)
          return bad(text(whole) + " has a cusp near " + point_text(b[0]),
                     "Space its points more evenly.");
        const gp_XY ab = (b[0] + b[1]) / 2, bc = (b[1] + b[2]) / 2, cd = (b[2] + b[3]) / 2;
        const gp_XY abc = (ab + bc) / 2, bcd = (bc + cd) / 2, middle = (abc + bcd) / 2;
        open.push_back({{middle, bcd, cd, b[3]}, depth + 1});
        open.push_back({{b[0], ab, abc, middle}, depth + 1});
      }
    }
    return {};
  }

  // Parameters where x is least or greatest within a piece.
  static std::vector<double> turning_points(const ProfilePiece& p) {
    std::vector<double> result;
    const auto add = [&](double t) {
      if (t > 1e-6 && t < 1 - 1e-6) result.push_back(t);
    };
    if (p.kind == CsgCurve::Kind::arc || p.kind == CsgCurve::Kind::circle) {
      for (int k = -4; k <= 4; ++k) add((k * kPi - p.from) / p.sweep);
    } else if (p.kind == CsgCurve::Kind::spline) {
      const double a = p.bezier[1].X() - p.bezier[0].X(), b = p.bezier[2].X() - p.bezier[1].X(),
                   c = p.bezier[3].X() - p.bezier[2].X();
      const double q = a - 2 * b + c, h = b - a, root = h * h - q * a;
      if (std::abs(q) < 1e-14 * (std::abs(a) + std::abs(b) + std::abs(c))) {
        if (h != 0) add(-a / (2 * h));
      } else if (root >= 0) {
        add((-h + std::sqrt(root)) / q);
        add((-h - std::sqrt(root)) / q);
      }
    }
    return result;
  }

  Result<void> check_axis() {
    for (const ProfilePiece& p : pieces_) {
      double least = std::min(p.a.X(), p.b.X());
      bool touches = false;
      for (const double t : turning_points(p)) {
        least = std::min(least, p.at(t).X());
        touches |= p.at(t).X() <= kTouch;
      }
      if (least < -kTouch)
        return bad(
            text(p) + " reaches x = " + print_metres(least) + ", left of its axis of revolution",
            "Move the profile to x >= 0.");
      if (touches)
        return bad(text(p) + " touches its axis of revolution between its ends",
                   "Move it off the axis, or end it there.");
    }
    for (std::size_t i = 1; i < pieces_.size(); ++i) {
      const ProfilePiece &p = pieces_[i - 1], &q = pieces_[i];
      if (p.loop == q.loop && p.curve == q.curve && p.b.X() <= kTouch)
        return bad(text(p) + " touches its axis of revolution between its ends",
                   "Move it off the axis, or end it there.");
    }
    return {};
  }

  std::size_t next(std::size_t i) const {
    const Loop& loop = loops_[pieces_[i].loop];
    return i + 1 < loop.first + loop.count ? i + 1 : loop.first;
  }

  Result<void> check_corners() const {
    for (std::size_t i = 0; i < pieces_.size(); ++i) {
      const ProfilePiece &p = pieces_[i], &q = pieces_[next(i)];
      if (p.kind == CsgCurve::Kind::circle) continue;
      const gp_XY in = p.tangent(1), out = q.tangent(0);
      if (in.Dot(out) < 0 && std::abs(in.Crossed(out)) < kSharpest * in.Modulus() * out.Modulus())
        return bad(text(q) + " turns back along " + (p.curve == q.curve ? "itself" : text(p)) +
                       " at " + point_text(p.b),
                   "Open the angle between them.");
    }
    return {};
  }

  // Pairs of parts of curves are halved until they are apart by more than they can bulge, or are
  // found to meet.
  Result<void> check_crossings() {
    std::vector<std::size_t> order(pieces_.size()), active;
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
      return boxes_[i].low.X() != boxes_[j].low.X() ? boxes_[i].low.X() < boxes_[j].low.X() : i < j;
    });
    for (const std::size_t i : order) {
      std::erase_if(active, [&](std::size_t j) { return boxes_[j].high.X() < boxes_[i].low.X(); });
      for (const std::size_t j : active)
        if (boxes_[i].low.Y() <= boxes_[j].high.Y() && boxes_[j].low.Y() <= boxes_[i].high.Y())
          RMP_TRY(check_pair(std::min(i, j), std::max(i, j)));
      active.push_back(i);
    }
    return {};
  }

  Result<void> check_pair(std::size_t i, std::size_t j) {
    const ProfilePiece &p = pieces_[i], &q = pieces_[j];
    std::vector<gp_XY> corners;
    if (next(i) == j) corners.push_back(p.b);
    if (next(j) == i) corners.push_back(p.a);
    const double reach =
        std::min(kCornerReach, 0.1 * std::min(p.length_bound(0, 1), q.length_bound(0, 1)));
    struct Pair {
      double a, b, c, d;
    };
    std::vector<Pair> open{{0, 1, 0, 1}};
    while (!open.empty()) {
      if (++steps_ % 4096 == 0 && progress_.cancelled()) return cancelled_error();
      const Pair now = open.back();
      open.pop_back();
      const gp_XY a = p.at(now.a), b = p.at(now.b), c = q.at(now.c), d = q.at(now.d);
      const double bulge_p = p.bulge(now.a, now.b), bulge_q = q.bulge(now.c, now.d);
      if (profile_distance(a, b, c, d) > bulge_p + bulge_q + kTouch) continue;
      const bool at_corner = std::any_of(corners.begin(), corners.end(), [&](const gp_XY& corner) {
        return std::max((a - corner).Modulus(), (b - corner).Modulus()) + bulge_p <= reach &&
               std::max((c - corner).Modulus(), (d - corner).Modulus()) + bulge_q <= reach;
      });
      if (at_corner) continue;
      const double length_p = p.length_bound(now.a, now.b), length_q = q.length_bound(now.c, now.d);
      const bool is_flat = bulge_p + bulge_q <= kTouch / 2;
      if (is_flat && (corners.empty() || std::max(length_p, length_q) <= reach / 4)) {
        const gp_XY where = (a + b + c + d) / 4;
        const std::string what = p.loop == q.loop && p.curve == q.curve
                                     ? text(p) + " crosses or touches itself"
                                     : text(p) + " crosses or touches " + text(q);
        return bad(what + " at " + point_text(where), "Keep outlines apart.");
      }
      const bool split_p = is_flat ? length_p >= length_q : bulge_p >= bulge_q;
      if (split_p) {
        const double m = (now.a + now.b) / 2;
        open.push_back({now.a, m, now.c, now.d});
        open.push_back({m, now.b, now.c, now.d});
      } else {
        const double m = (now.c + now.d) / 2;
        open.push_back({now.a, now.b, now.c, m});
        open.push_back({now.a, now.b, m, now.d});
      }
    }
    return {};
  }

  bool is_inside(const gp_XY& point, const Loop& loop) const {
    if (!loop.box.contains(point)) return false;
    double turn = 0;
    std::vector<std::pair<double, double>> open;
    for (std::size_t i = loop.first; i < loop.first + loop.count; ++i) {
      const ProfilePiece& p = pieces_[i];
      open.assign(1, {0.0, 1.0});
      while (!open.empty()) {
        const auto [t0, t1] = open.back();
        open.pop_back();
        const gp_XY a = p.at(t0), b = p.at(t1);
        if (profile_distance(point, a, b) > p.bulge(t0, t1) || t1 - t0 < 1e-12) {
          turn += std::atan2((a - point).Crossed(b - point), (a - point).Dot(b - point));
        } else {
          open.push_back({t0, (t0 + t1) / 2});
          open.push_back({(t0 + t1) / 2, t1});
        }
      }
    }
    return std::abs(turn) > kPi;
  }

  gp_Pnt in_space(const gp_XY& p) const {
    const gp_Ax3& frame = use_.plane.Position();
    return gp_Pnt(frame.Location().XYZ() + frame.XDirection().XYZ() * p.X() +
                  frame.YDirection().XYZ() * p.Y());
  }

  TopoDS_Edge circular_edge(const ProfilePiece& p, const TopoDS_Vertex& from,
                            const TopoDS_Vertex& to) const {
    const gp_Ax3& frame = use_.plane.Position();
    const gp_Dir normal = p.sweep > 0 ? frame.Direction() : frame.Direction().Reversed();
    const gp_Dir x(in_space(p.a).XYZ() - in_space(p.centre).XYZ());
    const Handle(Geom_Circle) circle =
        new Geom_Circle(gp_Circ(gp_Ax2(in_space(p.centre), normal, x), p.radius));
    return BRepBuilderAPI_MakeEdge(circle, from, to, 0, std::abs(p.sweep)).Edge();
  }

  // Pieces of one spline become one edge again.
  TopoDS_Edge spline_edge(const ProfilePiece& p, const gp_XY& end, const TopoDS_Vertex& from,
                          const TopoDS_Vertex& to) const {
    std::vector<gp_XY> points{p.a};
    for (const auto& q : profile_.loops[p.loop].curves[p.curve].points)
      points.push_back(millimetres(q));
    points.back() = end;
    const Handle(Geom_Curve) curve = GeomAPI::To3d(NaturalSpline(points).curve(), use_.plane);
    return BRepBuilderAPI_MakeEdge(curve, from, to, curve->FirstParameter(), curve->LastParameter())
        .Edge();
  }

  TopoDS_Wire wire(const Loop& loop, bool is_hole) const {
    BRep_Builder builder;
    TopoDS_Wire made;
    builder.MakeWire(made);
    const std::size_t end = loop.first + loop.count;
    const TopoDS_Vertex first = BRepBuilderAPI_MakeVertex(in_space(pieces_[loop.first].a)).Vertex();
    TopoDS_Vertex from = first;
    for (std::size_t i = loop.first; i < end;) {
      const ProfilePiece& p = pieces_[i];
      std::size_t last = i;
      while (last + 1 < end && pieces_[last + 1].curve == p.curve) ++last;
      const TopoDS_Vertex to =
          last + 1 == end ? first : BRepBuilderAPI_MakeVertex(in_space(pieces_[last].b)).Vertex();
      TopoDS_Edge edge;
      switch (p.kind) {
        case CsgCurve::Kind::line: edge = BRepBuilderAPI_MakeEdge(from, to).Edge(); break;
        case CsgCurve::Kind::spline: edge = spline_edge(p, pieces_[last].b, from, to); break;
        default: edge = circular_edge(p, from, to); break;
      }
      builder.Add(made, edge);
      from = to;
      i = last + 1;
    }
    made.Closed(true);
    if ((loop.area < 0) != is_hole) made.Reverse();
    return made;
  }

  Result<std::vector<Region>> build() {
    std::vector<std::vector<std::size_t>> around(loops_.size());
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      if (progress_.cancelled()) return cancelled_error();
      for (std::size_t j = 0; j < loops_.size(); ++j)
        if (i != j && is_inside(pieces_[loops_[i].first].a, loops_[j])) around[i].push_back(j);
      loops_[i].depth = around[i].size();
    }
    std::vector<Region> regions;
    std::vector<std::size_t> region_of(loops_.size());
    std::vector<BRepBuilderAPI_MakeFace> makers;
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      if (loops_[i].depth % 2 != 0) continue;
      region_of[i] = makers.size();
      makers.emplace_back(use_.plane, wire(loops_[i], false), false);
      const double sign = loops_[i].area < 0 ? -1 : 1;
      regions.push_back({{}, sign * loops_[i].area, sign * loops_[i].moment_x});
    }
    for (std::size_t i = 0; i < loops_.size(); ++i) {
      if (loops_[i].depth % 2 == 0) continue;
      // The innermost loop around a hole is the outline of the region it is in.
      const std::size_t outer =
          *std::find_if(around[i].begin(), around[i].end(),
                        [&](std::size_t j) { return loops_[j].depth + 1 == loops_[i].depth; });
      Region& region = regions[region_of[outer]];
      makers[region_of[outer]].Add(wire(loops_[i], true));
      const double sign = loops_[i].area < 0 ? -1 : 1;
      region.area -= sign * loops_[i].area;
      region.moment_x -= sign * loops_[i].moment_x;
    }
    for (std::size_t r = 0; r < regions.size(); ++r) regions[r].face = makers[r].Face();
    return regions;
  }

  const CsgProfile& profile_;
  const ProfileUse& use_;
  const Progress& progress_;
  std::vector<ProfilePiece> pieces_;
  std::vector<ProfileBox> boxes_;  // of pieces
  std::vector<Loop> loops_;
  std::size_t steps_ = 0;
};

}  // namespace

NaturalSpline::NaturalSpline(const std::vector<gp_XY>& points) {
  const std::size_t n = points.size() - 1;
  knots_.push_back(0);
  for (std::size_t i = 0; i < n; ++i)
    knots_.push_back(knots_.back() + (points[i + 1] - points[i]).Modulus());
  // Second derivatives m by the tridiagonal system of continuous slopes, m = 0 at both ends.
  std::vector<gp_XY> m(n + 1, gp_XY(0, 0)), right(n + 1, gp_XY(0, 0));
  std::vector<double> upper(n + 1, 0);
  for (std::size_t i = 1; i < n; ++i) {
    const double h0 = knots_[i] - knots_[i - 1], h1 = knots_[i + 1] - knots_[i];
    const gp_XY slope = (points[i + 1] - points[i]) / h1 - (points[i] - points[i - 1]) / h0;
    const double pivot = 2 * (h0 + h1) - h0 * upper[i - 1];
    upper[i] = h1 / pivot;
    right[i] = (slope * 6 - right[i - 1] * h0) / pivot;
  }
  for (std::size_t i = n; i-- > 1;) m[i] = right[i] - m[i + 1] * upper[i];
  for (std::size_t i = 0; i < n; ++i) {
    const double h = knots_[i + 1] - knots_[i];
    coefficients_.push_back({points[i],
                             (points[i + 1] - points[i]) / h - (m[i] * 2 + m[i + 1]) * (h / 6),
                             m[i] / 2, (m[i + 1] - m[i]) / (6 * h)});
  }
}

gp_XY NaturalSpline::at(double parameter) const {
  const auto above = std::upper_bound(knots_.begin() + 1, knots_.end() - 1, parameter);
  const auto s = static_cast<std::size_t>(above - knots_.begin()) - 1;
  const double x = parameter - knots_[s];
  const auto& c = coefficients_[s];
  return c[0] + (c[1] + (c[2] + c[3] * x) * x) * x;
}

std::array<gp_XY, 4> NaturalSpline::bezier(std::size_t span) const {
  const auto& c = coefficients_[span];
  const double h = knots_[span + 1] - knots_[span];
  return {c[0], c[0] + c[1] * (h / 3), c[0] + c[1] * (2 * h / 3) + c[2] * (h * h / 3),
          c[0] + c[1] * h + c[2] * (h * h) + c[3] * (h * h * h)};
}

Handle(Geom2d_BSplineCurve) NaturalSpline::curve() const {
  const std::size_t n = spans();
  const auto flat = [&](std::size_t i) {  // knots with the first and last four times
    return i < 4 ? knots_[0] : i - 3 > n ? knots_[n] : knots_[i - 3];
  };
  TColgp_Array1OfPnt2d poles(1, static_cast<int>(n) + 3);
  for (std::size_t i = 0; i < n + 3; ++i) {
    // A pole is the polar form of a span's cubic at three successive knots.
    const std::size_t s = std::min(i < 2 ? std::size_t{0} : i - 2, n - 1);
    const double a = flat(i + 1) - knots_[s], b = flat(i + 2) - knots_[s],
                 c = flat(i + 3) - knots_[s];
    const auto& k = coefficients_[s];
    poles(static_cast<int>(i) + 1) =
        gp_Pnt2d(k[0] + k[1] * ((a + b + c) / 3) + k[2] * ((a * b + b * c + c * a) / 3) +
                 k[3] * (a * b * c));
  }
  TColStd_Array1OfReal knots(1, static_cast<int>(n) + 1);
  TColStd_Array1OfInteger counts(1, static_cast<int>(n) + 1);
  for (std::size_t i = 0; i <= n; ++i) {
    knots(static_cast<int>(i) + 1) = knots_[i];
    counts(static_cast<int>(i) + 1) = i == 0 || i == n ? 4 : 1;
  }
  return new Geom2d_BSplineCurve(poles, knots, counts, 3);
}

Result<std::vector<Region>> profile_regions(const CsgProfile& profile, const ProfileUse& use,
                                            const Progress& progress) {
  return Drawing(profile, use, progress).run();
}

void mix(Key& key, const CsgProfile& profile) {
  key.mix(std::uint64_t{profile.loops.size()});
  for (const CsgLoop& loop : profile.loops) {
    key.mix(loop.start[0]);
    key.mix(loop.start[1]);
    key.mix(std::uint64_t{loop.curves.size()});
    for (const CsgCurve& curve : loop.curves) {
      key.mix(static_cast<std::uint64_t>(curve.kind));
      key.mix(std::uint64_t{curve.points.size()});
      for (const auto& p : curve.points) {
        key.mix(p[0]);
        key.mix(p[1]);
      }
    }
  }
}

}  // namespace robomosp::csg_occt
