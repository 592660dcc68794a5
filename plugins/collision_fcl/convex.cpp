// SPDX-License-Identifier: Apache-2.0
#include "convex.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "spatial/pose.h"
#include "spatial/vec.h"

namespace robomosp::collision_fcl {
namespace {

using namespace spatial;

constexpr std::size_t kClimbFrom = 24;  ///< corners from which climbing beats looking at all
constexpr int kMostSteps = 200;
constexpr double kRounding = 1e-14;  ///< of coordinates of supports, with some to spare

/// As std::hypot, which looks at each number first; only what squares cannot hold does.
double length_of(double x, double y) {
  const double square = x * x + y * y;
  return square > 1e-280 && square < 1e280 ? std::sqrt(square) : std::hypot(x, y);
}
double clamp_to(double x, double half) { return std::clamp(x, -half, half); }

/// A cone's outline in the half plane of distance from the axis and height: the lower rim, the
/// upper one, and where it meets the axis.
struct Outline {
  std::array<std::array<double, 2>, 4> corners;
};
Outline outline_of(const Core& c) {
  return {{{{0, -c.half[2]}, {c.half[0], -c.half[2]}, {c.half[1], c.half[2]}, {0, c.half[2]}}}};
}
/// Nearest point of the outline to (r, z), and how far beyond the edge it belongs to (r, z) lies:
/// below 0 inside.
struct OnOutline {
  double r = 0, z = 0, squared = std::numeric_limits<double>::infinity();
  bool is_inside = true;
};
OnOutline nearest_on_outline(const Core& c, double r, double z) {
  const Outline o = outline_of(c);
  OnOutline best;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto &a = o.corners[i], &b = o.corners[i + 1];
    const double x = b[0] - a[0], y = b[1] - a[1], length2 = x * x + y * y;
    if (!(length2 > 0)) continue;
    const double u = r - a[0], v = z - a[1];
    best.is_inside = best.is_inside && x * v - y * u >= 0;
    const double t = std::clamp((x * u + y * v) / length2, 0.0, 1.0);
    // The ends themselves, so that flat faces keep their height to the bit.
    const double pr = t < 1 ? a[0] + t * x : b[0], pz = t < 1 ? a[1] + t * y : b[1];
    const double d2 = (r - pr) * (r - pr) + (z - pz) * (z - pz);
    if (d2 < best.squared) best.r = pr, best.z = pz, best.squared = d2;
  }
  return best;
}

/// Nearest point of the surface of an ellipsoid to any point, by the one root of the multiplier
/// that makes it the nearest (Hart, Graphics Gems IV, 1994; Eberly, Distance from a Point
/// to an Ellipsoid, 2013): e_i^2 p_i / (t + e_i^2), t above minus the least e_i^2.
Vec3 nearest_on_ellipsoid(const Vec3& half, const Vec3& p) {
  std::array<std::size_t, 3> by_size{0, 1, 2};
  std::sort(by_size.begin(), by_size.end(),
            [&](std::size_t a, std::size_t b) { return half[a] > half[b]; });
  const auto e = [&](std::size_t k) { return half[by_size[k]]; };
  const auto y = [&](std::size_t k) { return std::fabs(p[by_size[k]]); };
  Vec3 x{};
  const auto put = [&](std::size_t k, double value) {
    x[by_size[k]] = std::copysign(value, p[by_size[k]]);
  };
  // In the plane of the least axes' others, a point near the middle has its nearest point off that
  // plane; all else stays in it.
  for (std::size_t n = 3; n > 0; --n) {
    const std::size_t last = n - 1;
    const double least = e(last);
    if (n == 1) {
      put(0, e(0));
      break;
    }
    if (y(last) > 0) {
      // In units of the least half axis, from where the last term has its pole: t = least^2 (u -
      // 1).
      std::array<double, 3> pole{}, pull{};
      double low = 0, sum = 0;
      for (std::size_t k = 0; k < n; ++k) {
        const double r = e(k) / least;
        pole[k] = (r - 1) * (r + 1);
        pull[k] = r * (y(k) / least);
        low = std::max(low, pull[k] - pole[k]);
        sum += pull[k] * pull[k];
      }
      const double high = std::max(low, std::sqrt(sum));
      const auto excess = [&](double u) {
        double total = -1;
        for (std::size_t k = 0; k < n; ++k)
          total += pull[k] / (u + pole[k]) * (pull[k] / (u + pole[k]));
        return total;
      };
      double u = low;
      // Newton from below never passes the root of a convex, falling function.
      for (int step = 0; step < 200; ++step) {
        double f = -1, slope = 0;
        for (std::size_t k = 0; k < n; ++k) {
          const double at = pull[k] / (u + pole[k]);
          f += at * at;
          slope -= 2 * at * at / (u + pole[k]);
        }
        if (!(f > 0) || !(slope < 0)) break;
        const double next = u - f / slope;
        if (!(next > u) || !(next <= high)) break;
        u = next;
      }
      if (!(std::fabs(excess(u)) < 1e-9)) {  // not met in extreme shapes: by halving
        double above = low, below = high;
        for (int step = 0; step < 1100; ++step) {
          const double middle = above + (below - above) / 2;
          if (!(middle > above) || !(middle < below)) break;
          (excess(middle) > 0 ? above : below) = middle;
        }
        u = above + (below - above) / 2;
      }
      for (std::size_t k = 0; k < n; ++k) put(k, e(k) * std::min(1.0, pull[k] / (u + pole[k])));
      break;
    }
    double rest = 1;
    bool is_near = true;
    std::array<double, 2> share{};
    for (std::size_t k = 0; k < last; ++k) {
      const double room = (e(k) - least) * (e(k) + least);
      is_near = is_near && e(k) * y(k) < room;
      share[k] = is_near ? e(k) * y(k) / room : 0;
      rest -= share[k] * share[k];
    }
    if (is_near && rest > 0) {
      for (std::size_t k = 0; k < last; ++k) put(k, e(k) * share[k]);
      put(last, least * std::sqrt(rest));
      break;
    }
    put(last, 0);
  }
  return x;
}

bool is_in_ellipsoid(const Vec3& half, const Vec3& p) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) sum += (p[k] / half[k]) * (p[k] / half[k]);
  return sum <= 1;
}

/// Of a triangle, by its plane or else its edges.
Vec3 nearest_on_corners(const std::array<Vec3, 3>& c, const Vec3& p) {
  const Vec3 n = cross(sub(c[1], c[0]), sub(c[2], c[0]));
  const double nn = dot(n, n);
  if (nn > 0) {
    bool is_over = true;
    for (std::size_t k = 0; k < 3 && is_over; ++k)
      is_over = dot(cross(sub(c[(k + 1) % 3], c[k]), sub(p, c[k])), n) >= 0;
    if (is_over) return sub(p, scale(n, dot(n, sub(p, c[0])) / nn));
  }
  Vec3 best = c[0];
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 way = sub(c[(k + 1) % 3], c[k]);
    const double l = dot(way, way);
    const double t = l > 0 ? std::clamp(dot(sub(p, c[k]), way) / l, 0.0, 1.0) : 0;
    const Vec3 at = add(c[k], scale(way, t));
    if (const double d = distance(at, p); d < least) least = d, best = at;
  }
  return best;
}

/// Nearest point of a core to a point outside it; the point itself when inside.
Vec3 nearest_in_core(const Core& c, const Vec3& p) {
  switch (c.kind) {
    case Core::Kind::point: return {};
    case Core::Kind::segment: return {0, 0, clamp_to(p[2], c.half[2])};
    case Core::Kind::box:
      return {clamp_to(p[0], c.half[0]), clamp_to(p[1], c.half[1]), clamp_to(p[2], c.half[2])};
    case Core::Kind::cylinder: {
      const double r = length_of(p[0], p[1]);
      const double s = r > c.half[0] ? c.half[0] / r : 1;
      return {p[0] * s, p[1] * s, clamp_to(p[2], c.half[2])};
    }
    case Core::Kind::cone: {
      const double r = length_of(p[0], p[1]);
      const OnOutline at = nearest_on_outline(c, r, p[2]);
      if (at.is_inside) return p;
      return r > 0 ? Vec3{p[0] / r * at.r, p[1] / r * at.r, at.z} : Vec3{at.r, 0, at.z};
    }
    case Core::Kind::ellipsoid:
      return is_in_ellipsoid(c.half, p) ? p : nearest_on_ellipsoid(c.half, p);
    case Core::Kind::triangle: return nearest_on_corners(c.corners, p);
    case Core::Kind::hull: break;
  }
  return p;
}

/// A point inside a box, cylinder, cone or ellipsoid: depth, and the nearest point of the surface.
double inner_depth(const Core& c, const Vec3& p, Vec3& surface) {
  if (c.kind == Core::Kind::ellipsoid) {
    surface = nearest_on_ellipsoid(c.half, p);
    return distance(surface, p);
  }
  if (c.kind == Core::Kind::cone) {
    const double r = length_of(p[0], p[1]);
    const OnOutline at = nearest_on_outline(c, r, p[2]);
    surface = r > 0 ? Vec3{p[0] / r * at.r, p[1] / r * at.r, at.z} : Vec3{at.r, 0, at.z};
    return std::sqrt(at.squared);
  }
  surface = p;
  double depth = std::numeric_limits<double>::infinity();
  const auto side = [&](std::size_t k) {
    const double d = c.half[k] - std::fabs(p[k]);
    if (d >= depth) return;
    depth = d;
    surface = p;
    surface[k] = std::copysign(c.half[k], p[k]);
  };
  side(2);
  if (c.kind == Core::Kind::box) {
    side(0);
    side(1);
    return depth;
  }
  const double r = length_of(p[0], p[1]);
  if (c.half[0] - r < depth) {
    depth = c.half[0] - r;
    const Vec3 out = r > 0 ? Vec3{p[0] / r, p[1] / r, 0} : Vec3{1, 0, 0};
    surface = {out[0] * c.half[0], out[1] * c.half[0], p[2]};
  }
  return depth;
}

/// Out of an ellipsoid at a point of its surface.
Vec3 normal_on_ellipsoid(const Core& c, const Vec3& p) {
  Vec3 n{};
  for (std::size_t k = 0; k < 3; ++k) n[k] = p[k] / c.half[k] / c.half[k];
  return unit(n);
}

/// Out of a cone at a point of its surface.
Vec3 normal_on_cone(const Core& c, const Vec3& p) {
  if (std::fabs(p[2]) >= c.half[2]) return {0, 0, std::copysign(1.0, p[2])};
  const double r = length_of(p[0], p[1]);
  const Vec3 radial = r > 0 ? Vec3{p[0] / r, p[1] / r, 0} : Vec3{1, 0, 0};
  return unit(add(scale(radial, 2 * c.half[2]), {0, 0, c.half[0] - c.half[1]}));
}

/// From the nearest points of two cores apart to those of the shapes.
Apart with_margins(const Vec3& a, const Vec3& b, double margin_a, double margin_b) {
  Apart r;
  const Vec3 way = sub(b, a);
  const double d = norm(way);
  const Vec3 n = d > 0 ? scale(way, 1 / d) : Vec3{0, 0, 1};
  r.distance = d - margin_a - margin_b;
  r.on_a = add(a, scale(n, margin_a));
  r.on_b = sub(b, scale(n, margin_b));
  return r;
}

/// The centre of a sphere against a box, cylinder, cone or ellipsoid whose frame is the points'
/// frame; on_a is the solid's.
Apart point_to_solid(const Core& solid, const Vec3& p, double margin) {
  const Vec3 q = nearest_in_core(solid, p);
  if (q != p) return with_margins(q, p, 0, margin);
  Apart r;
  Vec3 surface;
  const double depth = inner_depth(solid, p, surface);
  Vec3 n = sub(surface, p);
  const double length = norm(n);
  if (length > 0) {
    n = scale(n, 1 / length);
  } else {  // the centre is on the surface
    n = {};
    if (solid.kind == Core::Kind::cone || solid.kind == Core::Kind::ellipsoid) {
      n = solid.kind == Core::Kind::cone ? normal_on_cone(solid, p)
                                         : normal_on_ellipsoid(solid, surface);
      r.distance = -(depth + margin);
      r.on_a = surface;
      r.on_b = sub(p, scale(n, margin));
      return r;
    }
    const Vec3 u{p[0] / solid.half[0], p[1] / solid.half[1], p[2] / solid.half[2]};
    if (solid.kind == Core::Kind::cylinder && std::fabs(p[2]) < solid.half[2])
      n = unit({p[0], p[1], 0});
    else {
      std::size_t k = 2;
      if (solid.kind == Core::Kind::box)
        for (std::size_t i = 0; i < 2; ++i)
          if (std::fabs(u[i]) > std::fabs(u[k])) k = i;
      n[k] = std::copysign(1, p[k]);
    }
  }
  r.distance = -(depth + margin);
  r.on_a = surface;
  r.on_b = sub(p, scale(n, margin));
  return r;
}

/// Nearest points of two segments (Ericson, Real-Time Collision Detection, 2005, 5.1.9), as
/// parameters; both have positive length.
std::pair<double, double> nearest_of_segments(const Vec3& p1, const Vec3& d1, const Vec3& p2,
                                              const Vec3& d2) {
  const Vec3 r = sub(p1, p2);
  const double a = dot(d1, d1), e = dot(d2, d2), f = dot(d2, r), c = dot(d1, r), b = dot(d1, d2);
  const double denominator = a * e - b * b;
  double s = denominator > 1e-14 * a * e ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0;
  double t = (b * s + f) / e;
  if (t < 0) t = 0, s = std::clamp(-c / a, 0.0, 1.0);
  else if (t > 1) t = 1, s = std::clamp((b - c) / a, 0.0, 1.0);
  return {s, t};
}

Apart segments(const Core& a, const Core& b, const Pose& a_T_b) {
  const Vec3 d1{0, 0, 2 * a.half[2]}, p1{0, 0, -a.half[2]};
  const Vec3 z = axis(a_T_b, 2);
  const Vec3 d2 = scale(z, 2 * b.half[2]), p2 = sub(a_T_b.p, scale(z, b.half[2]));
  const auto [s, t] = nearest_of_segments(p1, d1, p2, d2);
  const Vec3 on1 = add(p1, scale(d1, s)), on2 = add(p2, scale(d2, t));
  Apart r = with_margins(on1, on2, a.margin, b.margin);
  if (distance(on1, on2) > 1e-12 * (a.margin + b.margin)) return r;
  // The axes cross: out along the normal of both, or of one where they are parallel.
  Vec3 n = cross({0, 0, 1}, z);
  if (norm(n) < 1e-9) n = {1, 0, 0};
  n = unit(n);
  r.on_a = add(on1, scale(n, a.margin));
  r.on_b = sub(on2, scale(n, b.margin));
  return r;
}

/// Points of A - B with the points of A and B they come from.
struct Simplex {
  std::array<Vec3, 4> w{}, a{}, b{};
  std::array<double, 4> weight{};
  std::size_t size = 0;

  void keep(std::initializer_list<std::pair<std::size_t, double>> which) {
    Simplex s;
    for (const auto& [i, l] : which) {
      s.w[s.size] = w[i];
      s.a[s.size] = a[i];
      s.b[s.size] = b[i];
      s.weight[s.size++] = l;
    }
    *this = s;
  }
  [[nodiscard]] Vec3 sum(const std::array<Vec3, 4>& of) const {
    Vec3 p{};
    for (std::size_t i = 0; i < size; ++i) p = add(p, scale(of[i], weight[i]));
    return p;
  }
};

using Weights = std::array<std::pair<std::size_t, double>, 3>;
struct Part {
  Weights part{};
  std::size_t size = 0;
  double squared = std::numeric_limits<double>::infinity();
};

Part part_of(const Simplex& s, Weights weights, std::size_t size) {
  Part p{weights, size, 0};
  Vec3 v{};
  for (std::size_t i = 0; i < size; ++i)
    v = add(v, scale(s.w[weights[i].first], weights[i].second));
  p.squared = dot(v, v);
  return p;
}

Part nearest_on_edge(const Simplex& s, std::size_t i, std::size_t j) {
  const Vec3 ab = sub(s.w[j], s.w[i]);
  const double t = -dot(s.w[i], ab), l = dot(ab, ab);
  if (t <= 0 || l <= 0) return part_of(s, {{{i, 1.0}}}, 1);
  if (t >= l) return part_of(s, {{{j, 1.0}}}, 1);
  return part_of(s, {{{i, 1 - t / l}, {j, t / l}}}, 2);
}

/// Of the origin, by the regions of the triangle (Ericson 5.1.5). All its edges are tried where it
/// is not the interior, which costs little and has no wrong turns on thin triangles.
Part nearest_on_triangle(const Simplex& s, std::size_t i, std::size_t j, std::size_t k) {
  const Vec3 &a = s.w[i], &b = s.w[j], &c = s.w[k];
  const Vec3 n = cross(sub(b, a), sub(c, a));
  const double nn = dot(n, n);
  if (nn > 0) {
    const double u = dot(n, cross(b, c)), v = dot(n, cross(c, a)), w = dot(n, cross(a, b));
    if (u > 0 && v > 0 && w > 0) {
      const double sum = u + v + w;
      Part inside = part_of(s, {{{i, u / sum}, {j, v / sum}, {k, w / sum}}}, 3);
      return inside;
    }
  }
  Part best = nearest_on_edge(s, i, j);
  for (const auto& [p, q] : {std::pair{j, k}, std::pair{k, i}})
    if (const Part e = nearest_on_edge(s, p, q); e.squared < best.squared) best = e;
  return best;
}

/// Reduces the simplex to the part nearest to the origin; false when the origin is inside.
bool reduce(Simplex& s) {
  Part best;
  if (s.size == 1) {
    s.weight[0] = 1;
    return true;
  }
  if (s.size == 2) best = nearest_on_edge(s, 0, 1);
  if (s.size == 3) best = nearest_on_triangle(s, 0, 1, 2);
  if (s.size == 4) {
    constexpr std::array<std::array<std::size_t, 4>, 4> kFaces{
        {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}}};
    bool is_inside = true;
    for (const auto& f : kFaces) {
      const Vec3 n = cross(sub(s.w[f[1]], s.w[f[0]]), sub(s.w[f[2]], s.w[f[0]]));
      const double of_rest = dot(n, sub(s.w[f[3]], s.w[f[0]]));
      const double of_origin = -dot(n, s.w[f[0]]);
      // A flat tetrahedron has no inside: all its faces are looked at.
      const double flat = 1e-14 * norm(n) * norm(sub(s.w[f[3]], s.w[f[0]]));
      if (std::fabs(of_rest) > flat && of_rest * of_origin >= 0) continue;
      is_inside = false;
      if (const Part p = nearest_on_triangle(s, f[0], f[1], f[2]); p.squared < best.squared)
        best = p;
    }
    if (is_inside) return false;
  }
  if (best.size == 1) s.keep({best.part[0]});
  if (best.size == 2) s.keep({best.part[0], best.part[1]});
  if (best.size == 3) s.keep({best.part[0], best.part[1], best.part[2]});
  return true;
}

bool is_round(const Core& c) {
  return c.kind == Core::Kind::cylinder || c.kind == Core::Kind::cone ||
         c.kind == Core::Kind::ellipsoid;
}

bool is_flat_or_round(const Core& c) {
  return c.kind == Core::Kind::box || c.kind == Core::Kind::cylinder;
}

/// The nearest points of two ellipsoids from such as are near to them. The way v from one to the
/// other maximizes c.v - h_A(v) - h_B(v) - v.v / 2 with the support functions h, which is concave
/// and smooth: Newton's method with halved steps. Nothing where rounding keeps it from that.
std::optional<std::pair<Vec3, Vec3>> nearest_of_ellipsoids(const Core& a, const Core& b,
                                                           const Pose& a_T_b, Vec3 v) {
  // h(v)^2 = v.M v, M about each centre in the frame of a.
  std::array<std::array<Vec3, 3>, 2> forms{};
  for (std::size_t i = 0; i < 3; ++i) {
    forms[0][i][i] = a.half[i] * a.half[i];
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < 3; ++k)
        forms[1][i][j] += a_T_b.R[3 * i + k] * b.half[k] * b.half[k] * a_T_b.R[3 * j + k];
  }
  const auto times = [](const std::array<Vec3, 3>& m, const Vec3& x) {
    return Vec3{dot(m[0], x), dot(m[1], x), dot(m[2], x)};
  };
  const Vec3& c = a_T_b.p;
  const auto value = [&](const Vec3& x) {
    double f = dot(c, x) - dot(x, x) / 2;
    for (const auto& m : forms) f -= std::sqrt(std::max(0.0, dot(x, times(m, x))));
    return f;
  };
  double best = value(v);
  for (int step = 0; step < 30; ++step) {
    Vec3 slope = sub(c, v);
    std::array<Vec3, 3> h{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (const auto& m : forms) {
      const Vec3 mv = times(m, v);
      const double s = std::sqrt(dot(v, mv));
      if (!(s > 0)) return {};
      slope = sub(slope, scale(mv, 1 / s));
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) h[i][j] += (m[i][j] - mv[i] / s * (mv[j] / s)) / s;
    }
    const Vec3 yz = cross(h[1], h[2]);
    const double all = dot(h[0], yz);
    if (!(all > 0)) return {};
    const Vec3 way{dot(slope, yz) / all, dot(h[0], cross(slope, h[2])) / all,
                   dot(h[0], cross(h[1], slope)) / all};
    // Less than rounding is no loss, or the last digits of the way would be lost.
    const double slack = 1e-15 * norm(c) * norm(v);
    double share = 1;
    while (share > 1e-6 && !(value(add(v, scale(way, share))) >= best - slack)) share /= 2;
    if (!(share > 1e-6)) break;
    v = add(v, scale(way, share));
    best = value(v);
    if (norm(way) <= 1e-16 * norm(v)) break;
  }
  std::uint32_t hint = 0;
  return std::pair{support(a, v, hint),
                   transform(a_T_b, support(b, rotate_back(a_T_b, scale(v, -1)), hint))};
}

/// By nearest points in turn from good ones: a corner and a face, two rims or two sides come to
/// rest after a few. The plane across the way proves the answer; where it does not, the way is a
/// direction to begin with.
struct ByTurns {
  bool is_done = false;
  Apart answer;
  Vec3 way{};  ///< from a to b
};
ByTurns by_turns(const Core& a, const Core& b, const Pose& a_T_b, double interest) {
  constexpr int kTurns = 8;
  constexpr double kProof = 1e-13;
  const Pose b_T_a = inverse(a_T_b);
  ByTurns out;
  out.way = a_T_b.p;
  Vec3 on_b = a_T_b.p;
  if (a.kind == Core::Kind::cylinder && b.kind == Core::Kind::cylinder) {
    const Vec3 d1{0, 0, 2 * a.half[2]}, p1{0, 0, -a.half[2]}, z = axis(a_T_b, 2);
    const Vec3 d2 = scale(z, 2 * b.half[2]), p2 = sub(a_T_b.p, scale(z, b.half[2]));
    on_b = add(p2, scale(d2, nearest_of_segments(p1, d1, p2, d2).second));
  }
  std::uint32_t hint = 0;
  double before = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kTurns; ++i) {
    const Vec3 on_a = nearest_in_core(a, on_b);
    on_b = transform(a_T_b, nearest_in_core(b, transform(b_T_a, on_a)));
    const Vec3 way = sub(on_b, on_a);
    const double dd = dot(way, way);
    if (!(dd > 0)) return out;  // they overlap, or touch
    out.way = way;
    if (i == 0 || dd < 0.9 * before) {
      before = dd;
      continue;
    }
    before = dd;
    // All of a is below the plane across the way, all of b above.
    const double top = dot(way, support(a, way, hint));
    const double bottom =
        dot(way, transform(a_T_b, support(b, rotate_back(a_T_b, scale(way, -1)), hint)));
    const double d = std::sqrt(dd);
    if (bottom - top > interest * d) {
      out.is_done = true;
      out.answer.state = Apart::State::beyond;
      out.answer.distance = interest;
      return out;
    }
    const double reach = norm(on_a) + norm(on_b);
    if (dd - (bottom - top) > kProof * d * (d + 1e-3 * reach)) continue;
    out.is_done = true;
    out.answer.distance = d;
    out.answer.on_a = on_a;
    out.answer.on_b = on_b;
    return out;
  }
  return out;
}

/// Gilbert, Johnson, Keerthi (IEEE J. Robotics Automation 4 (1988) 193) on the cores.
Apart gjk(const Core& a, const Core& b, const Pose& a_T_b, double interest) {
  std::uint32_t hint_a = 0, hint_b = 0;
  const auto support_a = [&](const Vec3& d) { return support(a, d, hint_a); };
  const auto support_b = [&](const Vec3& d) {
    return transform(a_T_b, support(b, rotate_back(a_T_b, d), hint_b));
  };
  const double margins = a.margin + b.margin;
  // What is left of the last digits is found by projections, see below.
  const bool projects =
      (is_round(a) || is_round(b)) && a.kind != Core::Kind::hull && b.kind != Core::Kind::hull;
  const bool has_ellipsoid = a.kind == Core::Kind::ellipsoid || b.kind == Core::Kind::ellipsoid;
  const double enough = projects && !has_ellipsoid ? 1e-9 : 1e-14;
  Vec3 way = a_T_b.p;
  if (is_flat_or_round(a) && is_flat_or_round(b)) {
    const ByTurns turns = by_turns(a, b, a_T_b, interest);
    if (turns.is_done) return turns.answer;
    way = turns.way;
  }
  Simplex s;
  Vec3 v = dot(way, way) > 0 ? scale(way, -1) : Vec3{-1, 0, 0};
  double vv = std::numeric_limits<double>::infinity(), extent = 0;
  // A plane between the cores was seen: what looks like an overlap afterwards is rounding.
  bool is_apart = false;
  double reach = 0;  // of the points from the frame's origin, whose rounding all else has
  Apart out;
  for (int step = 0; step < kMostSteps; ++step) {
    const Vec3 wa = support_a(scale(v, -1)), wb = support_b(v), w = sub(wa, wb);
    extent = std::max(extent, dot(w, w));
    reach = std::max({reach, norm(wa), norm(wb)});
    if (step > 0) {
      const double vw = dot(v, w);
      // The plane through w is a bound from below.
      if (vw > 0 && vw > (interest + margins) * std::sqrt(vv)) {
        out.state = Apart::State::beyond;
        out.distance = interest;
        return out;
      }
      is_apart = is_apart || vw > kRounding * std::sqrt(vv) * reach;
      if (vv - vw <= enough * vv) break;
      bool is_known = false;
      for (std::size_t i = 0; i < s.size; ++i) is_known = is_known || s.w[i] == w;
      if (is_known) break;
    }
    const Simplex before = s;
    s.w[s.size] = w;
    s.a[s.size] = wa;
    s.b[s.size] = wb;
    ++s.size;
    const bool holds_origin = !reduce(s);
    if (holds_origin && is_apart) {
      s = before;
      break;
    }
    if (holds_origin) {
      out.state = Apart::State::overlap;
      out.is_exact = false;
      return out;
    }
    const Vec3 next = s.sum(s.w);
    const double nn = dot(next, next);
    if (nn <= 1e-28 * extent && !is_apart) {
      out.state = Apart::State::overlap;
      out.is_exact = false;
      out.on_a = s.sum(s.a);
      return out;
    }
    if (step > 0 && nn >= vv) {  // rounding is all that is left
      s = before;
      break;
    }
    v = next;
    vv = nn;
  }
  Vec3 on_a = s.sum(s.a), on_b = s.sum(s.b);
  if (a.kind == Core::Kind::ellipsoid && b.kind == Core::Kind::ellipsoid)
    if (const auto points = nearest_of_ellipsoids(a, b, a_T_b, sub(on_b, on_a)))
      if (distance(points->first, points->second) < distance(on_a, on_b))
        std::tie(on_a, on_b) = *points;
  // Round surfaces are approached by chords only: the last digits come by projecting the points
  // onto the shapes in turn, which never moves them apart.
  if (projects) {
    const Pose b_T_a = inverse(a_T_b);
    double d = distance(on_a, on_b);
    const auto is_slow = [](const Core& c) {
      return c.kind == Core::Kind::cone || c.kind == Core::Kind::ellipsoid;
    };
    for (int i = 0; i < (is_slow(a) || is_slow(b) ? 400 : 60); ++i) {
      const Vec3 pa = nearest_in_core(a, on_b);
      const Vec3 pb = transform(a_T_b, nearest_in_core(b, transform(b_T_a, pa)));
      const double closer = distance(pa, pb);
      if (!(closer < d)) break;
      const bool is_done = d - closer <= 1e-16 * d;
      on_a = pa;
      on_b = pb;
      d = closer;
      if (is_done) break;
    }
  }
  return with_margins(on_a, on_b, a.margin, b.margin);
}

Apart swapped(const Core& a, const Core& b, const Pose& a_T_b, double interest) {
  Apart r = separation(b, a, inverse(a_T_b), interest);
  std::swap(r.on_a, r.on_b);
  r.on_a = transform(a_T_b, r.on_a);
  r.on_b = transform(a_T_b, r.on_b);
  return r;
}

}  // namespace

HullData hull_data(Hull hull) {
  HullData d;
  std::vector<std::set<std::uint32_t>> around(hull.points.size());
  for (const auto& t : hull.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      around[t[k]].insert(t[(k + 1) % 3]);
      around[t[k]].insert(t[(k + 2) % 3]);
    }
  for (const auto& set : around) {
    d.first.push_back(static_cast<std::uint32_t>(d.neighbours.size()));
    d.neighbours.insert(d.neighbours.end(), set.begin(), set.end());
  }
  d.first.push_back(static_cast<std::uint32_t>(d.neighbours.size()));
  d.hull = std::move(hull);
  return d;
}

Vec3 support(const Core& c, const Vec3& d, std::uint32_t& hint) {
  switch (c.kind) {
    case Core::Kind::point: return {};
    case Core::Kind::segment: return {0, 0, std::copysign(c.half[2], d[2])};
    case Core::Kind::box:
      return {std::copysign(c.half[0], d[0]), std::copysign(c.half[1], d[1]),
              std::copysign(c.half[2], d[2])};
    case Core::Kind::cylinder: {
      const double r = length_of(d[0], d[1]);
      const double s = r > 0 ? c.half[0] / r : 0;
      return {s * d[0], s * d[1], std::copysign(c.half[2], d[2])};
    }
    case Core::Kind::cone: {
      const double r = length_of(d[0], d[1]);
      const bool is_upper = c.half[1] * r + c.half[2] * d[2] > c.half[0] * r - c.half[2] * d[2];
      const double s = r > 0 ? c.half[is_upper ? 1 : 0] / r : 0;
      return {s * d[0], s * d[1], is_upper ? c.half[2] : -c.half[2]};
    }
    case Core::Kind::ellipsoid: {
      // In units of the greatest part, so that no square under- or overflows.
      Vec3 w{};
      double most = 0;
      for (std::size_t k = 0; k < 3; ++k) most = std::max(most, std::fabs(w[k] = c.half[k] * d[k]));
      if (!(most > 0)) return {0, 0, std::copysign(c.half[2], d[2])};
      w = unit(scale(w, 1 / most));
      return {c.half[0] * w[0], c.half[1] * w[1], c.half[2] * w[2]};
    }
    case Core::Kind::triangle: {
      const double x = dot(c.corners[0], d), y = dot(c.corners[1], d), z = dot(c.corners[2], d);
      return c.corners[x >= y && x >= z ? 0 : y >= z ? 1 : 2];
    }
    case Core::Kind::hull: break;
  }
  const auto& points = c.hull->hull.points;
  if (points.size() < kClimbFrom) {
    std::size_t best = 0;
    double most = dot(points[0], d);
    for (std::size_t i = 1; i < points.size(); ++i)
      if (const double x = dot(points[i], d); x > most) most = x, best = i;
    return points[best];
  }
  double most = dot(points[hint], d);
  for (bool climbs = true; climbs;) {
    climbs = false;
    const std::uint32_t at = hint;
    for (std::uint32_t k = c.hull->first[at]; k < c.hull->first[at + 1]; ++k) {
      const std::uint32_t other = c.hull->neighbours[k];
      if (const double x = dot(points[other], d); x > most) most = x, hint = other, climbs = true;
    }
  }
  return points[hint];
}

bool contains(const Core& core, const Vec3& p) {
  if (core.kind != Core::Kind::hull) return distance(nearest_in_core(core, p), p) <= core.margin;
  const Hull& h = core.hull->hull;
  return std::all_of(h.triangles.begin(), h.triangles.end(), [&](const auto& t) {
    const Vec3 n = cross(sub(h.points[t[1]], h.points[t[0]]), sub(h.points[t[2]], h.points[t[0]]));
    return dot(n, sub(p, h.points[t[0]])) <= 0;
  });
}

Apart separation(const Core& a, const Core& b, const Pose& a_T_b, double interest) {
  using Kind = Core::Kind;
  if (a.kind > b.kind) return swapped(a, b, a_T_b, interest);
  if (a.kind == Kind::point) {
    switch (b.kind) {
      case Kind::point: return with_margins({}, a_T_b.p, a.margin, b.margin);
      case Kind::segment: {
        const Pose b_T_a = inverse(a_T_b);
        return with_margins({}, transform(a_T_b, nearest_in_core(b, b_T_a.p)), a.margin, b.margin);
      }
      case Kind::box:
      case Kind::cylinder:
      case Kind::cone:
      case Kind::ellipsoid: {
        Apart r = point_to_solid(b, inverse(a_T_b).p, a.margin);
        std::swap(r.on_a, r.on_b);
        r.on_a = transform(a_T_b, r.on_a);
        r.on_b = transform(a_T_b, r.on_b);
        return r;
      }
      case Kind::triangle: {
        Core turned = b;
        for (Vec3& corner : turned.corners) corner = transform(a_T_b, corner);
        const Vec3 at = nearest_on_corners(turned.corners, {});
        if (dot(at, at) > 0) return with_margins({}, at, a.margin, b.margin);
        break;
      }
      case Kind::hull: break;
    }
  }
  if (a.kind == Kind::segment && b.kind == Kind::segment) return segments(a, b, a_T_b);
  return gjk(a, b, a_T_b, interest);
}

bool closed_distance(const Core& a, const Pose& world_T_a, const Core& b, const Pose& world_T_b,
                     PairDistance& out) {
  using Kind = Core::Kind;
  Vec3 on_a = world_T_a.p, on_b = world_T_b.p;  // of the cores
  if (a.kind == Kind::point && b.kind == Kind::point) {
    // their centres
  } else if (a.kind == Kind::segment && b.kind == Kind::segment) {
    const Vec3 z1 = axis(world_T_a, 2), z2 = axis(world_T_b, 2);
    const Vec3 d1 = scale(z1, 2 * a.half[2]), d2 = scale(z2, 2 * b.half[2]);
    const Vec3 p1 = sub(on_a, scale(z1, a.half[2])), p2 = sub(on_b, scale(z2, b.half[2]));
    const auto [s, t] = nearest_of_segments(p1, d1, p2, d2);
    on_a = add(p1, scale(d1, s));
    on_b = add(p2, scale(d2, t));
  } else if (a.kind == Kind::segment && b.kind == Kind::point) {
    const Vec3 z = axis(world_T_a, 2);
    on_a = add(on_a, scale(z, clamp_to(dot(z, sub(on_b, on_a)), a.half[2])));
  } else if (a.kind == Kind::point && b.kind == Kind::segment) {
    const Vec3 z = axis(world_T_b, 2);
    on_b = add(on_b, scale(z, clamp_to(dot(z, sub(on_a, on_b)), b.half[2])));
  } else if (a.kind == Kind::point && (b.kind == Kind::box || b.kind == Kind::cylinder)) {
    on_b = transform(world_T_b, nearest_in_core(b, rotate_back(world_T_b, sub(on_a, on_b))));
  } else if (b.kind == Kind::point && (a.kind == Kind::box || a.kind == Kind::cylinder)) {
    on_a = transform(world_T_a, nearest_in_core(a, rotate_back(world_T_a, sub(on_b, on_a))));
  } else {
    return false;
  }
  const Vec3 way = sub(on_b, on_a);
  const double d = norm(way);
  // Cores that meet, or so nearly that rounding says in which direction.
  if (!(d > 1e-9 * (a.margin + b.margin))) return false;
  const double inverse_d = 1 / d;
  out.distance = d - a.margin - b.margin;
  out.on_a = add(on_a, scale(way, a.margin * inverse_d));
  out.on_b = sub(on_b, scale(way, b.margin * inverse_d));
  return true;
}

}  // namespace robomosp::collision_fcl
