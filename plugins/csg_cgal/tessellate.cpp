// SPDX-License-Identifier: GPL-3.0-or-later
#include "tessellate.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "profile.h"
#include "triangulate.h"

namespace robomosp::csg_cgal {
namespace {

constexpr double kPi = std::numbers::pi;
/// The deviation is looked for at a few places of each triangle; more lies between.
constexpr double kBetween = 1.1;

/// Collects points (equal ones once), triangles and patches.
class Builder {
 public:
  explicit Builder(std::uint64_t key) : key_(key) {}

  std::uint32_t add(Patch patch) {
    patch.id = mixed(key_, mesh_.patches.size());
    mesh_.patches.push_back(patch);
    return static_cast<std::uint32_t>(mesh_.patches.size() - 1);
  }
  std::uint32_t plane(const Vec3& normal, const Vec3& point) {
    Patch p;
    p.kind = Patch::Kind::plane;
    p.axis = unit(normal);
    p.point = point;
    return add(p);
  }
  void triangle(const Vec3& a, const Vec3& b, const Vec3& c, std::uint32_t patch) {
    const std::array<std::uint32_t, 3> t{corner(a), corner(b), corner(c)};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return;
    mesh_.triangles.push_back(t);
    mesh_.patch_of.push_back(patch);
  }
  void quad(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, std::uint32_t patch) {
    triangle(a, b, c, patch);
    triangle(a, c, d, patch);
  }
  /// A planar polygon that all its corners can be seen from the first one.
  void fan(const std::vector<Vec3>& polygon) {
    Vec3 normal{};
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
      normal = normal + cross(polygon[i] - polygon[0], polygon[i + 1] - polygon[0]);
    if (norm(normal) == 0) return;
    const std::uint32_t patch = plane(normal, polygon[0]);
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
      triangle(polygon[0], polygon[i], polygon[i + 1], patch);
  }

  /// Measures how far the triangles are from the surfaces they stand for.
  PatchMesh finish() {
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      Patch& p = mesh_.patches[mesh_.patch_of[t]];
      if (p.kind == Patch::Kind::plane || p.kind == Patch::Kind::free) continue;
      const auto [a, b, c] = mesh_.corners(t);
      for (const Vec3& x :
           {a, b, c, (a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5, (a + b + c) * (1.0 / 3)})
        p.deviation = std::max(p.deviation, kBetween * p.distance(x));
      const double bent = p.kind == Patch::Kind::torus  ? p.tube
                          : p.kind == Patch::Kind::cone ? std::max(norm(cross(a - p.point, p.axis)),
                                                                   norm(cross(b - p.point, p.axis)))
                                                        : p.radius;
      if (bent > 0) p.area_error = std::max(p.area_error, 2 * p.deviation / bent);
    }
    return std::move(mesh_);
  }

 private:
  std::uint32_t corner(const Vec3& given) {
    const Vec3 p = snapped(given);
    const auto [at, is_new] =
        number_.try_emplace(p, static_cast<std::uint32_t>(mesh_.points.size()));
    if (is_new) mesh_.points.push_back(p);
    return at->second;
  }
  std::uint64_t key_;
  PatchMesh mesh_;
  std::map<Vec3, std::uint32_t> number_;
};

constexpr Vec3 kUp{0, 0, 1};

/// Patches of surfaces of revolution about z.
Patch cylinder_patch(double radius) { return {Patch::Kind::cylinder, 0, {}, kUp, radius, 0, 0, 0}; }
Patch cone_patch(const Point2& a, const Point2& b) {
  const double slope = (b[0] - a[0]) / (b[1] - a[1]);
  return {Patch::Kind::cone, 0, {0, 0, a[1] - a[0] / slope}, kUp, 0, std::abs(slope), 0, 0};
}
Patch sphere_patch(double height, double radius) {
  return {Patch::Kind::sphere, 0, {0, 0, height}, {}, radius, 0, 0, 0};
}
Patch torus_patch(const Point2& centre, double tube) {
  return {Patch::Kind::torus, 0, {0, 0, centre[1]}, kUp, centre[0], tube, 0, 0};
}
Patch disc_patch(double height) { return {Patch::Kind::plane, 0, {0, 0, height}, kUp, 0, 0, 0, 0}; }

/// The surface that a side of the outline sweeps when it turns about z.
Patch swept(const Point2& a, const Point2& b) {
  if (a[1] == b[1]) return disc_patch(a[1]);
  if (a[0] == b[0]) return cylinder_patch(a[0]);
  return cone_patch(a, b);
}

/// Loops in (r, z), outer ones counter-clockwise, turned about z. Corners lie farther out, so that
/// every horizontal section has the area of the circles it stands for.
struct Turned {
  std::vector<std::vector<Point2>> loops;
  std::vector<std::vector<std::uint32_t>> patch_of;  ///< of the side that begins at each corner
  std::vector<std::array<std::uint32_t, 3>> caps;    ///< triangles, for less than a full turn
};
void turn(Builder& out, const Turned& t, double angle, int sides) {
  const bool is_full = angle >= kCsgFullTurn;
  const double k = equal_area(angle / sides);
  const auto at = [&](const Point2& p, int j) -> Vec3 {
    if (is_full) j %= sides;
    const double phi = angle * j / sides, r = p[0] * k;
    // Quarter turns exactly, so that equal solids meet exactly.
    if (is_full && (4 * j) % sides == 0) {
      constexpr std::array<std::array<double, 2>, 4> kQuarters{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
      const auto& q = kQuarters[static_cast<std::size_t>(4 * j / sides)];
      return {r * q[0], r * q[1], p[1]};
    }
    return {r * std::cos(phi), r * std::sin(phi), p[1]};
  };
  std::vector<Point2> all;
  for (std::size_t l = 0; l < t.loops.size(); ++l) {
    const auto& loop = t.loops[l];
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point2 &a = loop[i], &b = loop[(i + 1) % loop.size()];
      all.push_back(a);
      if (a[0] == 0 && b[0] == 0) continue;  // on the axis
      for (int j = 0; j < sides; ++j)
        out.quad(at(a, j), at(a, j + 1), at(b, j + 1), at(b, j), t.patch_of[l][i]);
    }
  }
  if (is_full) return;
  const std::uint32_t first = out.plane({0, -1, 0}, {});
  const std::uint32_t last = out.plane({-std::sin(angle), std::cos(angle), 0}, {});
  for (const auto& c : t.caps) {
    out.triangle(at(all[c[0]], 0), at(all[c[1]], 0), at(all[c[2]], 0), first);
    out.triangle(at(all[c[0]], sides), at(all[c[2]], sides), at(all[c[1]], sides), last);
  }
}
/// One loop whose corners come with the patch of the side that begins there.
void turn(Builder& out, const std::vector<Point2>& loop, const std::vector<std::uint32_t>& patch,
          double greatest_radius) {
  turn(out, Turned{{loop}, {patch}, {}}, kCsgFullTurn, circle_sides(greatest_radius));
}

void ball(Builder& out, double radius) {
  const int sides = circle_sides(radius), rows = sides / 2;
  std::vector<Point2> loop;
  for (int i = 0; i <= rows; ++i) {
    const double t = kPi * i / rows - kPi / 2;
    loop.push_back({i == 0 || i == rows ? 0 : std::cos(t), 2 * i == rows ? 0 : std::sin(t)});
  }
  double volume = 0;  // of stacked truncated cones, over pi
  for (std::size_t i = 0; i + 1 < loop.size(); ++i) {
    const auto &a = loop[i], &b = loop[i + 1];
    volume += (b[1] - a[1]) / 3 * (a[0] * a[0] + a[0] * b[0] + b[0] * b[0]);
  }
  const double scale = radius * std::cbrt(4.0 / 3 / volume);
  for (Point2& p : loop) p = {p[0] * scale, p[1] * scale};
  turn(out, loop, std::vector<std::uint32_t>(loop.size(), out.add(sphere_patch(0, radius))),
       radius);
}

/// A ball of the greatest half axis, pressed together along the others.
Result<PatchMesh> ellipsoid(Builder& out, const Vec3& half) {
  const double greatest = std::max({half[0], half[1], half[2]});
  ball(out, greatest);
  PatchMesh mesh = out.finish();
  Affine stretch;
  for (std::size_t k = 0; k < 3; ++k) stretch.A[4 * k] = half[k] / greatest;
  for (Vec3& p : mesh.points) p = snapped(stretch(p));
  for (Patch& p : mesh.patches) p = moved(p, stretch);
  if (!(volume_of(mesh) > 0))
    return error(ErrorCode::invalid_argument, "the solid has no volume",
                 "Make its half axes less different from each other.");
  return mesh;
}

void ring(Builder& out, double radius, double tube) {
  const int sides = circle_sides(tube);
  const double r = tube * equal_area(2 * kPi / sides);
  std::vector<Point2> loop;
  for (int i = 0; i < sides; ++i) {
    const double t = 2 * kPi * i / sides;
    loop.push_back({radius + r * std::cos(t), r * std::sin(t)});
  }
  turn(out, loop, std::vector<std::uint32_t>(loop.size(), out.add(torus_patch({radius, 0}, tube))),
       radius + tube);
}

void frustum_of_cone(Builder& out, double base, double top, double height) {
  std::vector<Point2> loop;
  std::vector<std::uint32_t> patch;
  const auto corner = [&](double r, double z, std::uint32_t p) {
    loop.push_back({r, z});
    patch.push_back(p);
  };
  corner(0, 0, out.add(disc_patch(0)));
  if (base > 0) corner(base, 0, out.add(swept({base, 0}, {top, height})));
  else patch[0] = out.add(swept({0, 0}, {top, height}));
  corner(top, height, out.add(disc_patch(height)));
  if (top > 0) corner(0, height, 0);
  turn(out, loop, patch, std::max(base, top));
}

void rounded_cylinder(Builder& out, double radius, double height, double fillet) {
  const int sides = circle_sides(fillet) / 4;
  const auto quarter = arc_points(fillet, -kPi / 2, kPi / 2, sides);
  const double flat = radius - fillet;
  const std::uint32_t low = out.add(disc_patch(0)), side = out.add(cylinder_patch(radius)),
                      high = out.add(disc_patch(height)),
                      low_rim = out.add(torus_patch({flat, fillet}, fillet)),
                      high_rim = out.add(torus_patch({flat, height - fillet}, fillet));
  std::vector<Point2> loop{{0, 0}};
  std::vector<std::uint32_t> patch{low};
  for (std::size_t i = 0; i < quarter.size(); ++i) {
    loop.push_back(i == 0 ? Point2{flat, 0} : Point2{flat + quarter[i][0], fillet + quarter[i][1]});
    patch.push_back(low_rim);
  }
  loop.push_back({radius, fillet});
  patch.push_back(side);
  for (std::size_t i = 0; i < quarter.size(); ++i) {
    const Point2 q = quarter[quarter.size() - i - (i == 0 ? 1 : 0)];
    loop.push_back(i == 0 ? Point2{radius, height - fillet}
                          : Point2{flat + q[0], height - fillet - q[1]});
    patch.push_back(high_rim);
  }
  loop.push_back({flat, height});
  patch.push_back(high);
  loop.push_back({0, height});
  patch.push_back(high);
  turn(out, loop, patch, radius);
}

/// Rings of rounded rectangles, one over the other.
void rounded_box(Builder& out, double x, double y, double z, double fillet) {
  const int sides = circle_sides(fillet) / 4;
  const auto n = static_cast<std::size_t>(sides);
  auto quarter = arc_points(1, 0, kPi / 2, sides);
  quarter.push_back({0, 1});
  quarter[0] = {1, 0};
  const double cx = x / 2 - fillet, cy = y / 2 - fillet;
  constexpr std::array<std::array<int, 2>, 4> kTurns{{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
  const auto centre = [&](std::size_t corner) -> Point2 {
    return {corner == 0 || corner == 3 ? cx : -cx, corner < 2 ? cy : -cy};
  };
  const auto at = [&](std::size_t corner, std::size_t j, double r, double height) -> Vec3 {
    const Point2 c = centre(corner), q = quarter[j];
    const auto [cs, sn] = kTurns[corner];
    return {c[0] + r * (cs * q[0] - sn * q[1]), c[1] + r * (sn * q[0] + cs * q[1]), height};
  };
  struct Layer {
    double r, height;
  };
  std::vector<Layer> layers;  // from below
  for (std::size_t i = 0; i <= n; ++i)
    layers.push_back({fillet * quarter[n - i][0], fillet - fillet * quarter[n - i][1]});
  layers.front() = {0, 0};
  for (std::size_t i = 0; i <= n; ++i)
    layers.push_back({fillet * quarter[i][0], z - fillet + fillet * quarter[i][1]});
  layers.back() = {0, z};
  const std::uint32_t bottom = out.plane({0, 0, -1}, {0, 0, 0}), top = out.plane(kUp, {0, 0, z});
  struct Band {
    std::array<std::uint32_t, 4> corner, side;
  };
  std::array<Band, 3> bands;
  for (std::size_t b = 0; b < 3; ++b)
    for (std::size_t k = 0; k < 4; ++k) {
      const Point2 c = centre(k);
      const double height = b == 0 ? fillet : z - fillet;
      const auto [ox, oy] = kTurns[(k + 1) % 4];  // outward of the side from corner k to k + 1
      const Vec3 outward{double(ox), double(oy), 0}, along{-double(oy), double(ox), 0};
      bands[b].corner[k] = out.add(
          b == 1 ? Patch{Patch::Kind::cylinder, 0, {c[0], c[1], 0}, kUp, fillet, 0, 0, 0}
                 : Patch{Patch::Kind::sphere, 0, {c[0], c[1], height}, {}, fillet, 0, 0, 0});
      bands[b].side[k] =
          b == 1
              ? out.plane(outward, Vec3{c[0], c[1], 0} + outward * fillet)
              : out.add({Patch::Kind::cylinder, 0, {c[0], c[1], height}, along, fillet, 0, 0, 0});
    }
  for (std::size_t i = 0; i + 1 < layers.size(); ++i) {
    const Band& band = bands[i < n ? 0 : i == n ? 1 : 2];
    const Layer &a = layers[i], &b = layers[i + 1];
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t j = 0; j < n; ++j)
        out.quad(at(k, j, a.r, a.height), at(k, j + 1, a.r, a.height), at(k, j + 1, b.r, b.height),
                 at(k, j, b.r, b.height), band.corner[k]);
      const std::size_t next = (k + 1) % 4;
      out.quad(at(k, n, a.r, a.height), at(next, 0, a.r, a.height), at(next, 0, b.r, b.height),
               at(k, n, b.r, b.height), band.side[k]);
    }
  }
  out.quad(at(0, 0, 0, 0), at(3, 0, 0, 0), at(2, 0, 0, 0), at(1, 0, 0, 0), bottom);
  out.quad(at(0, 0, 0, z), at(1, 0, 0, z), at(2, 0, 0, z), at(3, 0, 0, z), top);
}

/// Two polygons with as many corners, counter-clockwise from above, joined by their sides. A side
/// that shrinks to a point is a triangle.
void joined(Builder& out, std::vector<Vec3> low, const std::vector<Vec3>& high) {
  for (std::size_t i = 0; i < low.size(); ++i) {
    const std::size_t j = (i + 1) % low.size();
    std::vector<Vec3> side{low[i], low[j]};
    if (!(high[j] == low[j])) side.push_back(high[j]);
    if (!(high[i] == high[j])) side.push_back(high[i]);
    out.fan(side);
  }
  out.fan(high);
  std::reverse(low.begin(), low.end());
  out.fan(low);
}

std::vector<Vec3> rectangle(double x, double y, double z) {
  return {{-x / 2, -y / 2, z}, {x / 2, -y / 2, z}, {x / 2, y / 2, z}, {-x / 2, y / 2, z}};
}

std::vector<Vec3> regular(int sides, double radius, double z) {
  std::vector<Vec3> polygon;
  for (int i = 0; i < sides; ++i) {
    const double t = 2 * kPi * i / sides;
    polygon.push_back({radius * std::cos(t), radius * std::sin(t), z});
  }
  return polygon;
}

/// The oriented outline with the curve of each side.
struct Drawn {
  Outline outline;
  Region region;
};
Result<Drawn> drawn(const CsgProfile& profile) {
  Drawn d;
  RMP_TRY_ASSIGN(d.outline, outline_of(profile));
  auto region = triangulate(d.outline.loops);
  if (!region)
    return error(ErrorCode::invalid_argument, conflict_text(d.outline.loops),
                 "Move the curves apart.");
  d.region = std::move(*region);
  for (std::size_t l = 0; l < d.region.loops.size(); ++l) {
    if (d.region.loops[l] == d.outline.loops[l]) continue;
    // Reversed: the side that begins at the new corner i ended at the old corner n - 1 - i.
    auto& curves = d.outline.curve_of[l];
    std::reverse(curves.begin(), curves.end());
    std::rotate(curves.begin(), curves.begin() + 1, curves.end());
  }
  return d;
}

Result<void> prism(Builder& out, const CsgProfile& profile, double height) {
  RMP_TRY_ASSIGN(const Drawn d, drawn(profile));
  std::vector<Point2> all;
  std::map<std::uint32_t, std::uint32_t> patch_of_curve;
  const auto low = [](const Point2& p) { return Vec3{p[0], p[1], 0}; };
  const auto high = [&](const Point2& p) { return Vec3{p[0], p[1], height}; };
  for (std::size_t l = 0; l < d.region.loops.size(); ++l) {
    const auto& loop = d.region.loops[l];
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point2 &a = loop[i], &b = loop[(i + 1) % loop.size()];
      all.push_back(a);
      const std::uint32_t c = d.outline.curve_of[l][i];
      const Curve2& curve = d.outline.curves[c];
      auto at = patch_of_curve.find(c);
      if (at == patch_of_curve.end()) {
        Patch patch{Patch::Kind::free,          0, {}, {}, 0, 0, curve.deviation,
                    curve.turn * curve.turn / 8};
        if (curve.kind == Curve2::Kind::line)
          patch = {Patch::Kind::plane, 0, low(a), unit({b[1] - a[1], a[0] - b[0], 0}), 0, 0, 0, 0};
        if (curve.kind == Curve2::Kind::arc)
          patch = {Patch::Kind::cylinder,
                   0,
                   {curve.centre[0], curve.centre[1], 0},
                   kUp,
                   curve.radius,
                   0,
                   0,
                   0};
        at = patch_of_curve.emplace(c, out.add(patch)).first;
      }
      out.quad(low(a), low(b), high(b), high(a), at->second);
    }
  }
  const std::uint32_t bottom = out.plane({0, 0, -1}, {}), top = out.plane(kUp, {0, 0, height});
  for (const auto& t : d.region.triangles) {
    out.triangle(low(all[t[0]]), low(all[t[2]]), low(all[t[1]]), bottom);
    out.triangle(high(all[t[0]]), high(all[t[1]]), high(all[t[2]]), top);
  }
  return {};
}

Result<void> revolution(Builder& out, const CsgProfile& profile, double angle) {
  RMP_TRY_ASSIGN(const Drawn d, drawn(profile));
  constexpr double kOnAxis = 1e-9;  // [m]
  Turned t{d.region.loops, {}, d.region.triangles};
  double greatest = 0;
  for (std::size_t l = 0; l < t.loops.size(); ++l)
    for (Point2& p : t.loops[l]) {
      if (p[0] < -kOnAxis)
        return error(ErrorCode::invalid_argument,
                     "the profile reaches beyond the axis, to x = " + csg_number_text(p[0]) + " m",
                     "Keep it at x >= 0.", loop_text(l));
      if (p[0] < kOnAxis) p[0] = 0;
      greatest = std::max(greatest, p[0]);
    }
  const int full = circle_sides(greatest);
  const bool is_full = angle >= kCsgFullTurn;
  const int sides =
      is_full ? full : std::max(2, static_cast<int>(std::ceil(full * angle / kCsgFullTurn)));
  const double step = std::min(angle, kCsgFullTurn) / sides, round_off = greatest * step * step / 8;
  std::map<std::uint32_t, std::uint32_t> patch_of_curve;
  for (std::size_t l = 0; l < t.loops.size(); ++l) {
    const auto& loop = t.loops[l];
    t.patch_of.emplace_back();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const std::uint32_t c = d.outline.curve_of[l][i];
      const Curve2& curve = d.outline.curves[c];
      auto at = patch_of_curve.find(c);
      if (at == patch_of_curve.end()) {
        const Patch loose{Patch::Kind::free,
                          0,
                          {},
                          {},
                          0,
                          0,
                          curve.deviation + round_off,
                          curve.turn * curve.turn / 8 + step * step / 4};
        Patch patch = loose;
        if (curve.kind == Curve2::Kind::line) patch = swept(loop[i], loop[(i + 1) % loop.size()]);
        if (curve.kind == Curve2::Kind::arc)
          patch = std::abs(curve.centre[0]) < kOnAxis ? sphere_patch(curve.centre[1], curve.radius)
                                                      : torus_patch(curve.centre, curve.radius);
        // A lemon's surface is the outer part of a torus only where its tube is the thinner one.
        if (patch.kind == Patch::Kind::torus && curve.centre[0] < curve.radius) patch = loose;
        at = patch_of_curve.emplace(c, out.add(patch)).first;
      }
      t.patch_of.back().push_back(at->second);
    }
  }
  turn(out, t, std::min(angle, kCsgFullTurn), sides);
  return {};
}

}  // namespace

Result<void> check_kind(const CsgNode& node, std::size_t index) {
  if (node.kind == CsgKind::fillet || node.kind == CsgKind::chamfer)
    return error(
        ErrorCode::unsupported,
        "the triangle mesh engine does not support " + std::string(csg_info(node.kind).name) + "s",
        "Remove the node, or keep imported meshes in a separate solid.",
        csg_node_text(node, index));
  if (node.kind == CsgKind::imported && node.geometry->form != CsgGeometry::Form::mesh)
    return error(ErrorCode::unsupported,
                 "the triangle mesh engine does not support imported exact solids (B-rep)",
                 "Import it as a mesh such as STL if it shares a solid with a mesh.",
                 csg_node_text(node, index));
  return {};
}

Result<PatchMesh> tessellate(const CsgNode& node, std::uint64_t key) {
  Builder out(key);
  const auto& s = node.sizes;
  switch (node.kind) {
    case CsgKind::box:
      if (s[3] > 0) rounded_box(out, s[0], s[1], s[2], s[3]);
      else joined(out, rectangle(s[0], s[1], 0), rectangle(s[0], s[1], s[2]));
      break;
    case CsgKind::cylinder:
      if (s[2] > 0) rounded_cylinder(out, s[0], s[1], s[2]);
      else frustum_of_cone(out, s[0], s[0], s[1]);
      break;
    case CsgKind::cone: frustum_of_cone(out, s[0], s[1], s[2]); break;
    case CsgKind::sphere: ball(out, s[0]); break;
    case CsgKind::ellipsoid: return ellipsoid(out, {s[0], s[1], s[2]});
    case CsgKind::torus: ring(out, s[0], s[1]); break;
    case CsgKind::frustum:
      joined(out, rectangle(s[0], s[1], 0), rectangle(s[2], s[3], s[4]));
      break;
    case CsgKind::wedge: {
      const double x = s[0] / 2, y = s[1] / 2, z = s[2], top = s[3] - x;
      joined(out, rectangle(s[0], s[1], 0), {{-x, -y, z}, {top, -y, z}, {top, y, z}, {-x, y, z}});
      break;
    }
    case CsgKind::pyramid: {
      const int sides = static_cast<int>(s[0]);
      joined(out, regular(sides, s[1], 0), regular(sides, s[2], s[3]));
      break;
    }
    case CsgKind::prism: RMP_TRY(prism(out, *node.profile, s[0])); break;
    case CsgKind::revolution: RMP_TRY(revolution(out, *node.profile, s[0])); break;
    default: return error(ErrorCode::internal, "not a primitive");
  }
  PatchMesh mesh = out.finish();
  if (mesh.triangles.size() < 4 || !(volume_of(mesh) > 0))
    return error(ErrorCode::invalid_argument, "the solid has no volume",
                 "Make its sizes less different from each other.");
  return mesh;
}

}  // namespace robomosp::csg_cgal
