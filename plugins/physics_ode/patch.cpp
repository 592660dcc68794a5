// SPDX-License-Identifier: Apache-2.0
#include "patch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "spatial/vec.h"

namespace robomosp::physics_ode {
namespace {

struct Planar {
  double x, y;
};

constexpr double kOutOfPlane = 1e-2;  ///< of the patch's extent
constexpr double kLeastShareOfMiddle = 0.02;
constexpr double kOffCircle = 1e-3;  ///< of the radius

double cross(const Planar& o, const Planar& a, const Planar& b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

/// Counter-clockwise (Andrew's monotone chain).
std::vector<Planar> hull_of(std::vector<Planar> p, double least) {
  std::sort(p.begin(), p.end(), [](const Planar& a, const Planar& b) {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
  });
  std::vector<Planar> h(2 * p.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    while (n >= 2 && cross(h[n - 2], h[n - 1], p[i]) <= least) --n;
    h[n++] = p[i];
  }
  for (std::size_t i = p.size() - 1, base = n + 1; i-- > 0;) {
    while (n >= base && cross(h[n - 2], h[n - 1], p[i]) <= least) --n;
    h[n++] = p[i];
  }
  h.resize(n > 0 ? n - 1 : 0);
  return h;
}

/// Integral of the distance from the origin over the triangle origin, a, b.
double distance_integral(const Planar& a, const Planar& b) {
  const double length = std::hypot(b.x - a.x, b.y - a.y);
  if (!(length > 0)) return 0;
  const double d = (a.x * b.y - a.y * b.x) / length;  // of the edge from the origin
  if (!(d > 0)) return 0;
  // In polar coordinates rho = d / cos t: the integral of d^3 / (3 cos^3 t).
  const auto part = [&](const Planar& p) {
    const double along = (p.x * (b.x - a.x) + p.y * (b.y - a.y)) / length;
    const double tangent = along / d, secant = std::hypot(1.0, tangent);
    return 0.5 * (secant * tangent + std::asinh(tangent));
  };
  return d * d * d / 3 * (part(b) - part(a));
}

}  // namespace

// The pressure is even where the load is central; an eccentric one is linear, as it is between the
// engine's points by their softness.
std::optional<PatchMiddle> patch_middle(std::span<const Vec3> points,
                                        std::span<const double> depths, const Vec3& normal,
                                        double arm) {
  const std::size_t n = points.size();
  if (n < 3) return std::nullopt;
  Vec3 mean{};
  double depth = 0;
  for (std::size_t i = 0; i < n; ++i) {
    mean = spatial::add(mean, spatial::scale(points[i], 1 / static_cast<double>(n)));
    depth += depths[i] / static_cast<double>(n);
  }
  const Vec3 seed = std::fabs(normal[0]) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = spatial::unit(spatial::cross(normal, seed)), v = spatial::cross(normal, u);
  std::vector<Planar> flat;
  double extent = 0, off = 0;
  for (const Vec3& p : points) {
    const Vec3 d = spatial::sub(p, mean);
    flat.push_back({spatial::dot(d, u), spatial::dot(d, v)});
    extent = std::max(extent, std::hypot(flat.back().x, flat.back().y));
    off = std::max(off, std::fabs(spatial::dot(d, normal)));
  }
  if (!(extent > 0) || off > kOutOfPlane * extent) return std::nullopt;
  const std::vector<Planar> hull = hull_of(flat, 1e-9 * extent * extent);
  if (hull.size() < 3) return std::nullopt;
  double area = 0, cx = 0, cy = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Planar &a = hull[i], &b = hull[(i + 1) % hull.size()];
    const double twice = a.x * b.y - a.y * b.x;
    area += twice / 2, cx += twice * (a.x + b.x) / 6, cy += twice * (a.y + b.y) / 6;
  }
  if (!(area > 1e-6 * extent * extent)) return std::nullopt;
  cx /= area, cy /= area;
  double mean_arm = 0, least = extent, most = 0;
  for (const Planar& p : flat) {
    const double r = std::hypot(p.x - cx, p.y - cy);
    mean_arm += r / static_cast<double>(n);
    least = std::min(least, r), most = std::max(most, r);
  }
  double even = 0;  // mean distance of the patch's points from its centroid
  if (arm > 0 && most - least < kOffCircle * most) {
    even = arm * most;
  } else {
    for (std::size_t i = 0; i < hull.size(); ++i) {
      const Planar &a = hull[i], &b = hull[(i + 1) % hull.size()];
      even += distance_integral({a.x - cx, a.y - cy}, {b.x - cx, b.y - cy});
    }
    even /= area;
  }
  const double share = 1 - even / mean_arm;
  if (!(share > kLeastShareOfMiddle)) return std::nullopt;
  PatchMiddle out;
  out.point = spatial::add(mean, spatial::add(spatial::scale(u, cx), spatial::scale(v, cy)));
  out.share = share;
  // Faces are flat: the depth there by the plane through the points' depths (least squares; their
  // mean place is 0).
  double xx = 0, xy = 0, yy = 0, xd = 0, yd = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double x = flat[i].x, y = flat[i].y, d = depths[i] - depth;
    xx += x * x, xy += x * y, yy += y * y, xd += x * d, yd += y * d;
  }
  const double det = xx * yy - xy * xy;
  if (!(det > 1e-12 * xx * yy)) return std::nullopt;
  out.depth = depth + (cx * (yy * xd - xy * yd) + cy * (xx * yd - xy * xd)) / det;
  return out;
}

}  // namespace robomosp::physics_ode
