// SPDX-License-Identifier: GPL-3.0-or-later
#include "profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tessellate.h"

namespace robomosp::csg_cgal {
namespace {

constexpr int kFewestSides = 32, kMostSides = 256;
/// Nearer points [m] are one.
constexpr double kConfused = 1e-9;

double distance(const Point2& a, const Point2& b) { return std::hypot(a[0] - b[0], a[1] - b[1]); }

int arc_sides(double radius, double sweep) {
  return std::max(2, static_cast<int>(std::ceil(
                         circle_sides(radius) * std::abs(sweep) / (2 * std::numbers::pi) - 1e-9)));
}

/// Second derivatives by arc parameter of the natural cubic spline through the points (Thomas'
/// algorithm), for one coordinate.
std::vector<double> spline_bends(const std::vector<double>& s, const std::vector<double>& y) {
  const std::size_t n = s.size();
  std::vector<double> bend(n, 0.0), c(n, 0.0);
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double a = s[i] - s[i - 1], b = s[i + 1] - s[i];
    const double right = 6 * ((y[i + 1] - y[i]) / b - (y[i] - y[i - 1]) / a);
    const double pivot = 2 * (a + b) - a * c[i - 1];
    c[i] = b / pivot;
    bend[i] = (right - a * bend[i - 1]) / pivot;
  }
  for (std::size_t i = n - 1; i-- > 1;) bend[i] -= c[i] * bend[i + 1];
  return bend;
}

/// Whether two segments cross or touch.
bool meet(const Point2& a, const Point2& b, const Point2& c, const Point2& d) {
  const auto side = [](const Point2& p, const Point2& q, const Point2& r) {
    const double x = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    const double least = kConfused * distance(p, q);
    return x > least ? 1 : x < -least ? -1 : 0;
  };
  for (std::size_t k = 0; k < 2; ++k)
    if (std::max(a[k], b[k]) + kConfused < std::min(c[k], d[k]) ||
        std::max(c[k], d[k]) + kConfused < std::min(a[k], b[k]))
      return false;
  return side(a, b, c) * side(a, b, d) <= 0 && side(c, d, a) * side(c, d, b) <= 0;
}

class Spline {
 public:
  explicit Spline(const std::vector<Point2>& through) : points_(through), s_(through.size()) {
    for (std::size_t i = 1; i < through.size(); ++i)
      s_[i] = s_[i - 1] + distance(through[i], through[i - 1]);
    std::vector<double> x, y;
    for (const Point2& p : through) {
      x.push_back(p[0]);
      y.push_back(p[1]);
    }
    bend_ = {spline_bends(s_, x), spline_bends(s_, y)};
  }
  /// The point at fraction u of span i.
  [[nodiscard]] Point2 at(std::size_t i, double u) const {
    const double h = s_[i + 1] - s_[i], v = 1 - u;
    Point2 p{};
    for (std::size_t k = 0; k < 2; ++k)
      p[k] = v * points_[i][k] + u * points_[i + 1][k] +
             h * h / 6 * ((v * v * v - v) * bend_[k][i] + (u * u * u - u) * bend_[k][i + 1]);
    return p;
  }

 private:
  const std::vector<Point2>& points_;
  std::vector<double> s_;
  std::array<std::vector<double>, 2> bend_;
};

/// Adds points of one loop curve by curve.
class Loop {
 public:
  Loop(Outline& outline, const CsgLoop& loop) : outline_(outline), at_(loop.start) {}

  Result<void> add(const CsgCurve& curve) {
    const auto& p = curve.points;
    for (const Point2& x : p)
      if (!std::isfinite(x[0]) || !std::isfinite(x[1]) ||
          std::max(std::abs(x[0]), std::abs(x[1])) > kCsgGreatestLength)
        return wrong("a point of the profile is not a number within " +
                     csg_number_text(kCsgGreatestLength) + " m");
    switch (curve.kind) {
      case CsgCurve::Kind::line: {
        if (p.size() != 1) return wrong("a line of the profile needs one point, its end");
        start({});
        corner(at_);
        at_ = p[0];
        return {};
      }
      case CsgCurve::Kind::arc: return add_arc(p);
      case CsgCurve::Kind::spline: return add_spline(p);
      case CsgCurve::Kind::circle: return add_circle(p);
    }
    return wrong("a curve of the profile is of unknown kind");
  }

  /// A straight line closes the loop.
  Result<void> close(const Point2& start_point) {
    if (!is_circle_ && distance(at_, start_point) > kConfused) {
      start({});
      corner(at_);
    }
    // Points at one place are one; what curve they had goes with the next.
    std::vector<Point2> points;
    std::vector<std::uint32_t> curves;
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (distance(points_[i], points_[(i + 1) % points_.size()]) > kConfused) {
        points.push_back(points_[i]);
        curves.push_back(curve_of_[i]);
      }
    if (points.size() < 3) return wrong("a loop of the profile encloses no area");
    outline_.loops.push_back(std::move(points));
    outline_.curve_of.push_back(std::move(curves));
    return {};
  }

 private:
  static Error wrong(std::string what) {
    return error(ErrorCode::invalid_argument, std::move(what));
  }
  void start(Curve2 curve) { outline_.curves.push_back(curve); }
  void corner(const Point2& p) {
    points_.push_back(p);
    curve_of_.push_back(static_cast<std::uint32_t>(outline_.curves.size() - 1));
  }

  Result<void> add_arc(const std::vector<Point2>& p) {
    if (p.size() != 2)
      return wrong("an arc of the profile needs two points, a via point and its end");
    const Point2 a = at_, m = p[0], b = p[1];
    const double ax = a[0] - m[0], ay = a[1] - m[1], bx = b[0] - m[0], by = b[1] - m[1];
    const double d = 2 * (ax * by - ay * bx), size = distance(a, m) * distance(b, m);
    at_ = b;
    if (std::abs(d) <= 1e-9 * size)
      return wrong("an arc of the profile is straight: its three points lie on one line");
    const double aa = ax * ax + ay * ay, bb = bx * bx + by * by;
    const Point2 centre{m[0] + (by * aa - ay * bb) / d, m[1] + (ax * bb - bx * aa) / d};
    const double radius = distance(a, centre);
    const double from = std::atan2(a[1] - centre[1], a[0] - centre[0]);
    double sweep = std::atan2(b[1] - centre[1], b[0] - centre[0]) - from;
    // From a over m to b, m lies on the left of a-b exactly when the arc turns clockwise.
    const bool is_ccw = d < 0;
    while (is_ccw && sweep <= 0) sweep += 2 * std::numbers::pi;
    while (!is_ccw && sweep >= 0) sweep -= 2 * std::numbers::pi;
    const int sides = arc_sides(radius, sweep);
    Curve2 curve{Curve2::Kind::arc, centre, radius, 0, std::abs(sweep) / sides};
    curve.deviation = radius * curve.turn * curve.turn / 8;
    start(curve);
    const auto points = arc_points(radius, from, sweep, sides);
    corner(a);
    for (std::size_t i = 1; i < points.size(); ++i)
      corner({centre[0] + points[i][0], centre[1] + points[i][1]});
    return {};
  }

  Result<void> add_circle(const std::vector<Point2>& p) {
    if (p.size() != 2 || !(p[1][0] > 0) || !points_.empty())
      return wrong(
          "a circle of the profile needs a centre and a radius greater than 0, and a separate "
          "loop");
    const double radius = p[1][0];
    const int sides = circle_sides(radius);
    Curve2 curve{Curve2::Kind::arc, p[0], radius, 0, 2 * std::numbers::pi / sides};
    curve.deviation = radius * curve.turn * curve.turn / 8;
    start(curve);
    const double out = radius * equal_area(2 * std::numbers::pi / sides);
    for (int i = 0; i < sides; ++i) {
      const double t = 2 * std::numbers::pi * i / sides;
      corner({p[0][0] + out * std::cos(t), p[0][1] + out * std::sin(t)});
    }
    is_circle_ = true;
    return {};
  }

  Result<void> add_spline(const std::vector<Point2>& p) {
    std::vector<Point2> through{at_};
    for (const Point2& x : p) {
      if (distance(x, through.back()) <= kConfused)
        return wrong("a spline of the profile passes through the same point twice in a row");
      through.push_back(x);
    }
    if (through.size() < 2) return wrong("a spline of the profile needs a point to pass through");
    const auto first = points_.size();
    const Spline spline(through);
    Curve2 curve{Curve2::Kind::free, {}, 0, 0, 0};
    std::vector<Point2> made;
    for (std::size_t i = 0; i + 1 < through.size(); ++i) {
      // The gap falls with the square of the number of sides.
      double gap = 0;
      const Point2 &a = through[i], &b = through[i + 1];
      const double length = distance(a, b);
      for (int k = 1; k < 8; ++k) {
        const Point2 q = spline.at(i, k / 8.0);
        gap = std::max(
            gap, std::abs((q[0] - a[0]) * (b[1] - a[1]) - (q[1] - a[1]) * (b[0] - a[0])) / length);
      }
      const double chord = std::max(kChord, kChordBySize * length);
      const int sides = std::clamp(static_cast<int>(std::ceil(2 * std::sqrt(gap / chord))), 1, 64);
      curve.deviation = std::max(curve.deviation, 1.5 * gap / (sides * sides));
      for (int k = 0; k < sides; ++k) made.push_back(spline.at(i, double(k) / sides));
    }
    made.push_back(through.back());
    for (std::size_t i = 1; i + 1 < made.size(); ++i) {
      const double x1 = made[i][0] - made[i - 1][0], y1 = made[i][1] - made[i - 1][1],
                   x2 = made[i + 1][0] - made[i][0], y2 = made[i + 1][1] - made[i][1];
      curve.turn = std::max(curve.turn, std::abs(std::atan2(x1 * y2 - y1 * x2, x1 * x2 + y1 * y2)));
    }
    start(curve);
    for (std::size_t i = 0; i + 1 < made.size(); ++i) corner(made[i]);
    at_ = through.back();
    for (std::size_t i = first; i < points_.size(); ++i)
      for (std::size_t k = i + 2; k < points_.size(); ++k)
        if (meet(made[i - first], made[i + 1 - first], made[k - first], made[k + 1 - first]))
          return wrong("a spline of the profile crosses itself");
    return {};
  }

  Outline& outline_;
  Point2 at_;
  std::vector<Point2> points_;
  std::vector<std::uint32_t> curve_of_;
  bool is_circle_ = false;
};

}  // namespace

int circle_sides(double radius) {
  // Corners R (1 + h^2/3) out and sides R (1 - h^2/6) in, h half the angle of a side.
  const double chord = std::max(kChord, kChordBySize * radius);
  const double half = std::sqrt(3 * chord / radius);
  const int quarter = static_cast<int>(std::ceil(std::numbers::pi / half / 4));
  return std::clamp(4 * quarter, kFewestSides, kMostSides);
}

double equal_area(double angle) { return std::sqrt(angle / std::sin(angle)); }

// With the ends at R and the points between at q: sin(d)/2 (2 R q + (n - 2) q^2) = R^2 a / 2.
std::vector<Point2> arc_points(double radius, double from, double sweep, int sides) {
  const double d = std::abs(sweep) / sides, area = std::abs(sweep) / std::sin(d);
  const double n = sides - 2;
  const double q = n > 0 ? (std::sqrt(1 + n * area) - 1) / n : area / 2;
  std::vector<Point2> points;
  for (int i = 0; i < sides; ++i) {
    const double t = from + sweep * i / sides, r = i == 0 ? radius : radius * q;
    points.push_back({r * std::cos(t), r * std::sin(t)});
  }
  return points;
}

Result<Outline> outline_of(const CsgProfile& profile) {
  if (profile.loops.empty())
    return error(ErrorCode::invalid_argument, "the profile has no loop", "Draw one.");
  Outline outline;
  for (std::size_t l = 0; l < profile.loops.size(); ++l) {
    const CsgLoop& given = profile.loops[l];
    const auto drawn = [&]() -> Result<void> {
      if (!std::isfinite(given.start[0]) || !std::isfinite(given.start[1]))
        return error(ErrorCode::invalid_argument, "its start is not a number");
      Loop loop(outline, given);
      for (const CsgCurve& curve : given.curves) RMP_TRY(loop.add(curve));
      return loop.close(given.start);
    }();
    RMP_TRY(Result<void>(drawn).in(loop_text(l)));
  }
  return outline;
}

std::string loop_text(std::size_t loop) { return "loop " + std::to_string(loop + 1); }

std::string conflict_text(const std::vector<std::vector<Point2>>& loops) {
  for (std::size_t l = 0; l < loops.size(); ++l)
    for (std::size_t m = l; m < loops.size(); ++m)
      for (std::size_t i = 0; i < loops[l].size(); ++i)
        for (std::size_t k = m == l ? i + 1 : 0; k < loops[m].size(); ++k) {
          const auto &a = loops[l], &b = loops[m];
          const std::size_t next_i = (i + 1) % a.size(), next_k = (k + 1) % b.size();
          if (m == l && (next_i == k || next_k == i)) {
            // Neighbours share a corner; they must not run back along each other.
            const Point2 &corner = a[next_i == k ? k : i], &p = a[next_i == k ? i : k],
                         &q = a[next_i == k ? next_k : next_i];
            const double x1 = p[0] - corner[0], y1 = p[1] - corner[1], x2 = q[0] - corner[0],
                         y2 = q[1] - corner[1];
            if (std::abs(x1 * y2 - y1 * x2) > 1e-12 * std::hypot(x1, y1) * std::hypot(x2, y2) ||
                x1 * x2 + y1 * y2 < 0)
              continue;
          } else if (!meet(a[i], a[next_i], b[k], b[next_k])) {
            continue;
          }
          return l == m ? loop_text(l) + " of the profile crosses or touches itself"
                        : loop_text(l) + " and " + loop_text(m) +
                              " of the profile cross or touch each other";
        }
  return "the loops of the profile cross or touch";
}

}  // namespace robomosp::csg_cgal
