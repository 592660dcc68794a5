// SPDX-License-Identifier: GPL-3.0-or-later
// What is shown and asked of a solid of triangles: its display mesh, its sharp edges, its features
// and its sections.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <unordered_map>

#include "engine.h"
#include "sharp_edges.h"

namespace robomosp::csg_cgal {
namespace {

constexpr std::uint32_t kNoFacet = ~0U;

float narrow(double x) { return static_cast<float>(x); }

}  // namespace

Mesh display_mesh(const ExactSolid& solid, const Progress& progress) {
  const Rounded made = rounded(solid.mesh());
  const PatchMesh& mesh = made.mesh;
  stop_if_cancelled(progress);
  // By patch, each in the order of its triangles.
  std::vector<std::uint32_t> next(mesh.patches.size() + 1, 0), order(mesh.triangles.size());
  for (const std::uint32_t p : mesh.patch_of) ++next[p];
  std::exclusive_scan(next.begin(), next.end(), next.begin(), 0U);
  for (std::uint32_t t = 0; t < order.size(); ++t) order[next[mesh.patch_of[t]]++] = t;
  Mesh out;
  out.positions.reserve(3 * mesh.points.size());
  out.triangles.reserve(3 * mesh.triangles.size());
  // A corner once a face; a tip, which has no normal, once a triangle.
  struct Named {
    std::uint32_t corner, patch;
  };
  std::vector<Named> named;
  struct Last {
    std::uint32_t patch = kNoFacet, number = kNoFacet;
  };
  std::vector<Last> last(mesh.points.size());  // where a corner was last named
  std::vector<Vec3> normals;
  std::uint64_t last_patch = std::uint64_t{kNoFacet} + 1;
  for (const std::uint32_t t : order) {
    const std::uint32_t patch = mesh.patch_of[t];
    const Patch& surface = mesh.patches[patch];
    const bool is_free = surface.kind == Patch::Kind::free;
    if (patch != last_patch) {
      out.faces.push_back({static_cast<std::uint32_t>(out.triangle_count()), 0, surface.id});
      last_patch = patch;
    }
    ++out.faces.back().triangle_count;
    const Vec3 area = mesh.area_vector(t);
    const double size = norm(area);
    const Vec3 own = is_free ? unit(area) : area;
    const auto corners = mesh.corners(t);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh.triangles[t][k];
      const bool is_tip = !is_free && surface.kind != Patch::Kind::plane &&
                          surface.normal(mesh.points[v]) == Vec3{};
      std::uint32_t number = last[v].patch == patch && !is_tip ? last[v].number : kNoFacet;
      if (number == kNoFacet) {
        number = static_cast<std::uint32_t>(normals.size());
        if (!is_tip) last[v] = {patch, number};
        for (const double x : mesh.points[v]) out.positions.push_back(narrow(x));
        normals.push_back({});
        named.push_back({v, patch});
      }
      // Free faces by the angle at the corner, known ones by area to tell the side.
      const double weight = is_free ? std::atan2(size, dot(corners[(k + 1) % 3] - corners[k],
                                                           corners[(k + 2) % 3] - corners[k]))
                                    : 1;
      normals[number] = normals[number] + own * weight;
      out.triangles.push_back(number);
    }
  }
  stop_if_cancelled(progress);
  for (std::size_t n = 0; n < named.size(); ++n) {
    const Patch& surface = mesh.patches[named[n].patch];
    if (surface.kind == Patch::Kind::free) continue;
    const Vec3 smooth = surface.normal(mesh.points[named[n].corner]);
    if (!(smooth == Vec3{})) normals[n] = dot(smooth, normals[n]) < 0 ? smooth * -1 : smooth;
  }
  out.normals.reserve(out.positions.size());
  for (const Vec3& given : normals) {
    Vec3 n = unit(given);
    if (n == Vec3{}) n = {0, 0, 1};
    for (const double x : n) out.normals.push_back(narrow(x));
  }
  stop_if_cancelled(progress);
  const auto beyond =
      made.is_same ? std::span<const Triangle>(solid.neighbours()) : std::span<const Triangle>();
  for (const Chain& chain : chains_of(mesh, beyond)) {
    out.edge_sizes.push_back(static_cast<std::uint32_t>(chain.corners.size()));
    for (const std::uint32_t v : chain.corners)
      for (const double x : mesh.points[v]) out.edge_points.push_back(narrow(x));
  }
  return out;
}

namespace {

/// Runs of connected triangles of one patch; planes that continue each other are one.
std::vector<std::vector<std::uint32_t>> faces_of(const PatchMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.triangles.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto continues = [&](std::uint32_t a, std::uint32_t b) {
    if (mesh.patch_of[a] == mesh.patch_of[b]) return true;
    const Patch &p = mesh.patches[mesh.patch_of[a]], &q = mesh.patches[mesh.patch_of[b]];
    return p.kind == Patch::Kind::plane && q.kind == Patch::Kind::plane &&
           angle_between(normal_at(mesh, a, p.point), normal_at(mesh, b, q.point)) < 1e-9;
  };
  for (const Side& s : sides_of(mesh))
    if (s.second != kNoFacet && !s.is_crowded && continues(s.first, s.second)) {
      const std::uint32_t a = root(s.first), b = root(s.second);
      parent[std::max(a, b)] = std::min(a, b);
    }
  std::vector<std::vector<std::uint32_t>> faces;
  std::vector<std::uint32_t> number(mesh.triangles.size(), kNoFacet);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    std::uint32_t& n = number[root(t)];
    if (n == kNoFacet) {
      n = static_cast<std::uint32_t>(faces.size());
      faces.emplace_back();
    }
    faces[n].push_back(t);
  }
  // In the order of the tree's faces.
  std::stable_sort(faces.begin(), faces.end(), [&](const auto& a, const auto& b) {
    return mesh.patch_of[a.front()] < mesh.patch_of[b.front()];
  });
  return faces;
}

CsgFeature face_feature(const PatchMesh& mesh, const std::vector<std::uint32_t>& face) {
  CsgFeature f;
  const Patch& patch = mesh.patches[mesh.patch_of[face.front()]];
  Vec3 centroid{}, normal{};
  double from = std::numeric_limits<double>::infinity(), to = -from, outward = 0;
  for (const std::uint32_t t : face) {
    const Vec3 area = mesh.area_vector(t);
    const auto [a, b, c] = mesh.corners(t);
    const Vec3 middle = (a + b + c) * (1.0 / 3);
    f.size += norm(area) / 2;
    centroid = centroid + middle * (norm(area) / 2);
    normal = normal + area;
    for (const Vec3& p : {a, b, c}) {
      from = std::min(from, dot(p - patch.point, patch.axis));
      to = std::max(to, dot(p - patch.point, patch.axis));
    }
    outward += dot(area, patch.normal(middle));
  }
  f.point = centroid * (1 / f.size);
  const Vec3 amid = patch.point + patch.axis * ((from + to) / 2);
  switch (patch.kind) {
    case Patch::Kind::plane:
      f.kind = CsgFeature::Kind::plane;
      f.direction = unit(normal);
      return f;
    case Patch::Kind::cylinder:
      f.kind = CsgFeature::Kind::cylinder;
      f.radius = patch.radius;
      f.point = amid;
      break;
    case Patch::Kind::cone:
      f.kind = CsgFeature::Kind::cone;
      f.radius = std::abs((from + to) / 2) * patch.tube;
      f.point = amid;
      break;
    case Patch::Kind::sphere:
      f.kind = CsgFeature::Kind::sphere;
      f.radius = patch.radius;
      f.point = patch.point;
      break;
    case Patch::Kind::torus:
      f.kind = CsgFeature::Kind::torus;
      f.radius = patch.radius;
      f.point = patch.point;
      break;
    case Patch::Kind::free: return f;
  }
  f.direction = patch.axis;
  f.inward = outward < 0;
  return f;
}

CsgFeature edge_feature(const PatchMesh& mesh, const Chain& chain) {
  CsgFeature f;
  const auto at = [&](std::size_t i) -> const Vec3& { return mesh.points[chain.corners[i]]; };
  const std::size_t n = chain.corners.size();
  for (std::size_t i = 0; i + 1 < n; ++i) f.size += norm(at(i + 1) - at(i));
  const Vec3 way = at(n - 1) - at(0);
  if (norm(way) > f.size * (1 - 1e-9)) {
    f.kind = CsgFeature::Kind::line;
    f.point = (at(0) + at(n - 1)) * 0.5;
    f.direction = unit(way);
    return f;
  }
  f.point = at(n / 2);
  // Round where a surface with an axis meets a plane across it.
  const Patch *round = &mesh.patches[chain.patches[0]], *flat = &mesh.patches[chain.patches[1]];
  if (round->kind == Patch::Kind::plane) std::swap(round, flat);
  const bool has_axis = round->kind == Patch::Kind::cylinder || round->kind == Patch::Kind::cone ||
                        round->kind == Patch::Kind::torus;
  if (flat->kind != Patch::Kind::plane) return f;
  if (has_axis && norm(cross(round->axis, flat->axis)) > 1e-9) return f;
  if (!has_axis && round->kind != Patch::Kind::sphere) return f;
  f.kind = CsgFeature::Kind::circle;
  f.direction = flat->axis;
  f.point = round->point + flat->axis * dot(at(0) - round->point, flat->axis);
  // The corners lie a little outside; the surface knows better where it is simple.
  f.radius = norm(at(0) - f.point);
  if (round->kind == Patch::Kind::cylinder) f.radius = round->radius;
  if (round->kind == Patch::Kind::sphere) {
    const double h = norm(f.point - round->point);
    f.radius = std::sqrt(std::max(0.0, round->radius * round->radius - h * h));
  }
  if (chain.corners.front() == chain.corners.back()) f.size = kCsgFullTurn * f.radius;
  return f;
}

}  // namespace

std::vector<CsgFeature> features_of(const PatchMesh& exact, const Progress& progress) {
  const PatchMesh mesh = rounded(exact).mesh;  // slivers below display are no edges
  std::vector<CsgFeature> all;
  for (const auto& face : faces_of(mesh)) all.push_back(face_feature(mesh, face));
  stop_if_cancelled(progress);
  const auto chains = chains_of(mesh, {});
  for (const Chain& chain : chains)
    if (const CsgFeature f = edge_feature(mesh, chain); f.kind != CsgFeature::Kind::other)
      all.push_back(f);
  std::vector<std::uint32_t> corners;
  for (const Chain& chain : chains)
    if (chain.corners.front() != chain.corners.back()) {
      corners.push_back(chain.corners.front());
      corners.push_back(chain.corners.back());
    }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (const Patch& patch = mesh.patches[mesh.patch_of[t]]; patch.kind == Patch::Kind::cone)
      for (const std::uint32_t v : mesh.triangles[t])
        if (patch.normal(mesh.points[v]) == Vec3{}) corners.push_back(v);  // a tip
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  for (const std::uint32_t v : corners) {
    CsgFeature f;
    f.kind = CsgFeature::Kind::corner;
    f.point = mesh.points[v];
    all.push_back(f);
  }
  return all;
}

// Corners on the plane count as above it, so that every triangle is cut in two points or not at
// all, and the pieces join to closed loops.
CsgProfile section_of(const PatchMesh& mesh) {
  const auto is_above = [&](std::uint32_t v) { return mesh.points[v][2] >= 0; };
  const auto key = [](std::uint32_t a, std::uint32_t b) {
    return (std::uint64_t{std::min(a, b)} << 32U) | std::max(a, b);
  };
  const auto crossing = [&](std::uint64_t side) -> std::array<double, 2> {
    const Vec3 &a = mesh.points[side >> 32U], &b = mesh.points[side & kNoFacet];
    const double u = a[2] / (a[2] - b[2]);
    return {a[0] + u * (b[0] - a[0]), a[1] + u * (b[1] - a[1])};
  };
  std::unordered_map<std::uint64_t, std::vector<std::uint64_t>> next;  // from cut side to cut sides
  std::vector<std::uint64_t> order;
  for (const Triangle& t : mesh.triangles) {
    std::uint64_t in = 0, out = 0;
    std::size_t count = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      if (is_above(a) == is_above(b)) continue;
      (is_above(a) ? out : in) = key(a, b);
      ++count;
    }
    if (count != 2) continue;
    next[out].push_back(in);
    order.push_back(out);
  }
  CsgProfile profile;
  for (const std::uint64_t start : order) {
    std::vector<std::array<double, 2>> points;
    std::uint64_t side = start;
    while (!next[side].empty()) {
      const std::uint64_t to = next[side].back();
      next[side].pop_back();
      const auto p = crossing(side);
      const bool is_new =
          points.empty() || std::hypot(p[0] - points.back()[0], p[1] - points.back()[1]) > 1e-10;
      if (is_new) points.push_back(p);
      side = to;
    }
    // Points amid a straight line go.
    std::vector<std::array<double, 2>> kept;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto &a = kept.empty() ? points.back() : kept.back(), &b = points[i],
                 &c = points[(i + 1) % points.size()];
      const double x1 = b[0] - a[0], y1 = b[1] - a[1], x2 = c[0] - b[0], y2 = c[1] - b[1];
      if (std::abs(x1 * y2 - y1 * x2) > 1e-9 * std::hypot(x1, y1) * std::hypot(x2, y2) ||
          x1 * x2 + y1 * y2 < 0)
        kept.push_back(b);
    }
    if (kept.size() < 3) continue;
    CsgLoop loop;
    loop.start = kept.front();
    for (std::size_t i = 1; i <= kept.size(); ++i)
      loop.curves.push_back({CsgCurve::Kind::line, {kept[i % kept.size()]}});
    profile.loops.push_back(std::move(loop));
  }
  return profile;
}

}  // namespace robomosp::csg_cgal
