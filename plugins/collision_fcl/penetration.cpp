// SPDX-License-Identifier: Apache-2.0
#include "penetration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision_fcl {
namespace {

using namespace spatial;

constexpr int kMostPenetrationSteps = 160;
constexpr double kEnough = 1e-9;  ///< of the size

/// Points of the cores' difference A - B, with where they come from.
class Difference {
 public:
  Difference(const Core& a, const Core& b, const Pose& a_T_b) : a_(a), b_(b), a_T_b_(a_T_b) {}

  struct Point {
    Vec3 w{}, on_a{}, on_b{};
  };
  Point support(const Vec3& n) {
    Point p;
    p.on_a = collision_fcl::support(a_, n, hint_a_);
    p.on_b =
        transform(a_T_b_, collision_fcl::support(b_, rotate_back(a_T_b_, scale(n, -1)), hint_b_));
    p.w = sub(p.on_a, p.on_b);
    return p;
  }

 private:
  const Core& a_;
  const Core& b_;
  const Pose& a_T_b_;
  std::uint32_t hint_a_ = 0, hint_b_ = 0;
};

struct Face {
  std::array<std::size_t, 3> v{};
  Vec3 normal{};
  double offset = 0;  ///< of its plane from the origin, outwards
};

class Polytope {
 public:
  std::vector<Difference::Point> points;
  std::vector<Face> faces;

  Polytope() {
    points.reserve(96);
    faces.reserve(192);
    outline_.reserve(48);
  }

  /// From the farthest points along three axes, +x, -x, +y and so on; false where they span no
  /// convex octahedron around the origin.
  bool start_small() {
    constexpr std::array<std::array<std::size_t, 3>, 8> kFaces{
        {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
    double size = 0;
    for (const auto& p : points) size = std::max(size, norm(p.w));
    for (const auto& f : kFaces) {
      if (!add(f[0], f[1], f[2])) return false;
      const Face made = faces.back();
      for (std::size_t i = 0; i < points.size(); ++i)
        if (i != f[0] && i != f[1] && i != f[2] &&
            !(dot(made.normal, points[i].w) < made.offset - 1e-6 * size))
          return false;
    }
    return true;
  }

  /// From any points; false when they lie in a plane.
  bool start() {
    faces.clear();
    std::vector<Vec3> w;
    for (const auto& p : points) w.push_back(p.w);
    const auto hull = convex_hull(w);
    if (!hull) return false;
    std::vector<std::size_t> from;
    for (const Vec3& p : hull->points)
      from.push_back(static_cast<std::size_t>(std::find(w.begin(), w.end(), p) - w.begin()));
    for (const auto& t : hull->triangles) add(from[t[0]], from[t[1]], from[t[2]]);
    return !faces.empty();
  }

  [[nodiscard]] std::size_t nearest() const {
    std::size_t best = 0;
    for (std::size_t f = 1; f < faces.size(); ++f)
      if (faces[f].offset < faces[best].offset) best = f;
    return best;
  }

  /// Takes in the last point; false when rounding leaves no clean outline, or the point is there.
  bool grow() {
    const std::size_t eye = points.size() - 1;
    for (std::size_t i = 0; i < eye; ++i)
      if (points[i].w == points[eye].w) return false;
    auto& outline = outline_;
    outline.clear();
    for (std::size_t f = 0; f < faces.size();) {
      if (dot(faces[f].normal, points[eye].w) <= faces[f].offset) {
        ++f;
        continue;
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const std::pair edge{faces[f].v[k], faces[f].v[(k + 1) % 3]};
        const auto back =
            std::find(outline.begin(), outline.end(), std::pair{edge.second, edge.first});
        if (back != outline.end()) outline.erase(back);
        else if (std::find(outline.begin(), outline.end(), edge) != outline.end()) return false;
        else outline.push_back(edge);
      }
      faces[f] = faces.back();
      faces.pop_back();
    }
    if (outline.size() < 3) return false;
    // Each start once: more than one ring means that rounding tore the surface.
    for (std::size_t i = 0; i < outline.size(); ++i)
      for (std::size_t k = i + 1; k < outline.size(); ++k)
        if (outline[i].first == outline[k].first) return false;
    for (const auto& [from, to] : outline)
      if (!add(from, to, eye)) return false;
    return true;
  }

 private:
  std::vector<std::pair<std::size_t, std::size_t>> outline_;

  bool add(std::size_t i, std::size_t j, std::size_t k) {
    Face f;
    f.v = {i, j, k};
    const Vec3 n = cross(sub(points[j].w, points[i].w), sub(points[k].w, points[i].w));
    if (!(norm(n) > 0)) return false;
    f.normal = unit(n);
    f.offset = dot(f.normal, points[i].w);
    faces.push_back(f);
    return true;
  }
};

/// Directions that the least way out often has: the axes of both shapes and what is square to two.
class Ways {
 public:
  void add(const Vec3& n) {
    ways_[size_++] = n;
    ways_[size_++] = scale(n, -1);
  }
  [[nodiscard]] std::span<const Vec3> all() const { return {ways_.data(), size_}; }

 private:
  std::array<Vec3, 40> ways_;
  std::size_t size_ = 0;
};
Ways likely_ways(const Core& a, const Core& b, const Pose& a_T_b) {
  Ways ways;
  const auto both = [&](const Vec3& n) {
    const double length = norm(n);
    if (!(length >= 1e-9)) return;
    ways.add(scale(n, 1 / length));
  };
  const auto has_axes = [](const Core& c) { return c.kind != Core::Kind::hull; };
  constexpr std::array<Vec3, 3> kAxes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (std::size_t i = 0; i < 3; ++i) {
    if (has_axes(a)) both(kAxes[i]);
    if (has_axes(b)) both(axis(a_T_b, i));
    if (has_axes(a) && has_axes(b))
      for (std::size_t j = 0; j < 3; ++j) both(cross(kAxes[i], axis(a_T_b, j)));
  }
  // Square to a cone's side, towards the other.
  const auto slope = [](const Core& c, const Vec3& to) {
    const double r = std::hypot(to[0], to[1]);
    const Vec3 radial = r > 0 ? Vec3{to[0] / r, to[1] / r, 0} : Vec3{1, 0, 0};
    return add(scale(radial, 2 * c.half[2]), {0, 0, c.half[0] - c.half[1]});
  };
  if (a.kind == Core::Kind::cone) both(slope(a, a_T_b.p));
  if (b.kind == Core::Kind::cone) both(rotate(a_T_b, slope(b, inverse(a_T_b).p)));
  // From axis to axis, for round walls side by side.
  if (has_axes(a)) both({a_T_b.p[0], a_T_b.p[1], 0});
  if (has_axes(b)) {
    const Vec3 z = axis(a_T_b, 2);
    both(sub(a_T_b.p, scale(z, dot(z, a_T_b.p))));
  }
  return ways;
}

}  // namespace

Apart penetration(const Core& a, const Core& b, const Pose& a_T_b) {
  Difference difference(a, b, a_T_b);
  Apart best;
  best.distance = -std::numeric_limits<double>::infinity();
  Vec3 out{0, 0, 1};
  const auto consider = [&](const Difference::Point& p, const Vec3& n, const Vec3& on_a) {
    const double depth = std::max(0.0, dot(n, p.w));
    if (-depth <= best.distance) return;
    best.distance = -depth;
    best.on_a = on_a;
    out = n;
  };
  const Ways ways = likely_ways(a, b, a_T_b);
  for (const Vec3& n : ways.all()) {
    const auto p = difference.support(n);
    consider(p, n, p.on_a);
  }

  const auto with_margins = [&] {
    best.distance -= a.margin + b.margin;
    best.on_a = add(best.on_a, scale(out, a.margin));
    best.on_b = add(best.on_a, scale(out, best.distance));
    return best;
  };
  // Where rounding tears the outline, from the best way so far to better ones beside it.
  const auto walk_down = [&] {
    for (double step = 0.1; step > 1e-9;) {
      const Vec3 from = out;
      const double before = best.distance;
      const Vec3 e1 = unit(cross(from, std::fabs(from[0]) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0}));
      const Vec3 e2 = cross(from, e1);
      for (int k = 0; k < 8; ++k) {
        const double x = k % 4 == 0   ? 1
                         : k % 4 == 2 ? 0
                                      : 0.7,
                     y = k % 4 == 0   ? 0
                         : k % 4 == 2 ? 1
                         : k % 4 == 1 ? 0.7
                                      : -0.7;
        const double side = k < 4 ? step : -step;
        const Vec3 n = unit(add(from, add(scale(e1, side * x), scale(e2, side * y))));
        const auto p = difference.support(n);
        consider(p, n, p.on_a);
      }
      if (!(best.distance > before)) step *= 0.5;
    }
  };
  // Of two boxes one of the fifteen ways tried is the least (Gottschalk, Lin, Manocha, 1996).
  if (a.kind == Core::Kind::box && b.kind == Core::Kind::box) return with_margins();

  Polytope polytope;
  for (std::size_t k = 0; k < 3; ++k)
    for (const double side : {1.0, -1.0}) {
      Vec3 n{};
      n[k] = side;
      polytope.points.push_back(difference.support(n));
    }
  const auto start = [&] {
    if (polytope.start_small()) return true;
    polytope.points.clear();
    for (int i = 0; i < 27; ++i) {
      if (i == 13) continue;
      const Vec3 n = unit({i % 3 - 1.0, i / 3 % 3 - 1.0, i / 9 - 1.0});
      polytope.points.push_back(difference.support(n));
    }
    return polytope.start();
  };
  bool is_met = false;  // the outline and the difference's own surface
  if (start()) {
    double size = 0;
    for (const auto& p : polytope.points) size = std::max(size, norm(p.w));
    for (int step = 0; step < kMostPenetrationSteps; ++step) {
      const Face f = polytope.faces[polytope.nearest()];
      const auto p = difference.support(f.normal);
      // Where the way out from the origin meets the face, in the points of A.
      const auto& q = polytope.points;
      const Vec3 foot = scale(f.normal, f.offset);
      const Vec3 e1 = sub(q[f.v[1]].w, q[f.v[0]].w), e2 = sub(q[f.v[2]].w, q[f.v[0]].w);
      const Vec3 s = sub(foot, q[f.v[0]].w), n = cross(e1, e2);
      const double nn = dot(n, n);
      const double u = dot(cross(s, e2), n) / nn, v = dot(cross(e1, s), n) / nn;
      const Vec3 on_a = add(scale(q[f.v[0]].on_a, 1 - u - v),
                            add(scale(q[f.v[1]].on_a, u), scale(q[f.v[2]].on_a, v)));
      consider(p, f.normal, is_finite(on_a) ? on_a : p.on_a);
      is_met = dot(f.normal, p.w) - f.offset <= kEnough * size;
      if (is_met) break;
      polytope.points.push_back(p);
      if (!polytope.grow() || polytope.faces.empty()) break;
    }
  }
  if (!is_met) walk_down();
  return with_margins();
}

}  // namespace robomosp::collision_fcl
