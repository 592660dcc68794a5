// SPDX-License-Identifier: GPL-3.0-or-later
#include "sharp_edges.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <tuple>
#include <unordered_map>

#include "first_equals.h"

namespace robomosp::csg_cgal {
namespace {

/// Faces with known surfaces meet sharply at more than this angle [rad], others (imported, splines)
/// only beyond the second.
constexpr double kSharp = 0.05, kSharpFacets = 0.52;
/// A polyline goes on over a corner where it bends by less [rad] though the faces beside it change.
constexpr double kStraightOn = 0.2;
constexpr std::uint32_t kNoNeighbour = ~0U;

/// Marks triangles back to back with another as gone; only those with a corner at a place where two
/// were can be.
void drop_back_to_back(const std::vector<Triangle>& triangles, const std::vector<bool>& is_joint,
                       std::vector<bool>& is_gone) {
  std::map<Triangle, std::vector<std::uint32_t>> by_corners;  // from the least corner on
  const auto turned = [](Triangle t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const Triangle& v = triangles[t];
    if (is_gone[t] || !(is_joint[v[0]] || is_joint[v[1]] || is_joint[v[2]])) continue;
    const auto back = by_corners.find(turned({v[0], v[2], v[1]}));
    if (back != by_corners.end() && !back->second.empty()) {
      is_gone[back->second.back()] = true;
      back->second.pop_back();
      is_gone[t] = true;
    } else {
      by_corners[turned(v)].push_back(t);
    }
  }
}

}  // namespace

Rounded rounded(const PatchMesh& in) {
  Rounded out;
  out.mesh.patches = in.patches;
  std::vector<std::array<float, 3>> places;
  places.reserve(in.points.size());
  for (const Vec3& p : in.points)
    places.push_back({static_cast<float>(p[0]) + 0.0F, static_cast<float>(p[1]) + 0.0F,
                      static_cast<float>(p[2]) + 0.0F});
  const auto first = first_equals(
      places.size(),
      [&](std::uint32_t v) {
        std::uint64_t key = 0;
        for (const float x : places[v]) key = stirred(key, std::bit_cast<std::uint32_t>(x));
        return key;
      },
      [&](std::uint32_t v, std::uint32_t w) { return places[v] == places[w]; });
  std::vector<std::uint32_t> name(first.size());
  std::vector<bool> is_joint;
  for (std::uint32_t v = 0; v < first.size(); ++v) {
    if (first[v] == v) {
      name[v] = static_cast<std::uint32_t>(out.mesh.points.size());
      out.mesh.points.push_back(in.points[v]);
      is_joint.push_back(false);
    } else {
      name[v] = name[first[v]];
      is_joint[name[v]] = true;
      out.is_same = false;
    }
  }
  if (out.is_same) {
    out.mesh.triangles = in.triangles;
    out.mesh.patch_of = in.patch_of;
    return out;
  }
  std::vector<Triangle> triangles;
  std::vector<bool> is_gone;
  for (const Triangle& t : in.triangles) {
    const Triangle v{name[t[0]], name[t[1]], name[t[2]]};
    triangles.push_back(v);
    is_gone.push_back(v[0] == v[1] || v[1] == v[2] || v[2] == v[0]);
  }
  drop_back_to_back(triangles, is_joint, is_gone);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (is_gone[t]) continue;
    out.mesh.triangles.push_back(triangles[t]);
    out.mesh.patch_of.push_back(in.patch_of[t]);
  }
  return out;
}

std::vector<Side> sides_of(const PatchMesh& mesh) {
  std::vector<std::array<std::uint32_t, 3>> all;  // low, high, triangle
  all.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
      all.push_back({low, high, t});
    }
  std::sort(all.begin(), all.end());
  std::vector<Side> sides;
  for (const auto& [low, high, t] : all) {
    if (sides.empty() || sides.back().low != low || sides.back().high != high)
      sides.push_back({low, high});
    Side& s = sides.back();
    if (s.first == kNoNeighbour) s.first = t;
    else if (s.second == kNoNeighbour) s.second = t;
    else s.is_crowded = true;
  }
  return sides;
}

Vec3 normal_at(const PatchMesh& mesh, std::uint32_t t, const Vec3& p) {
  const Vec3 own = unit(mesh.area_vector(t));
  const Vec3 smooth = mesh.patches[mesh.patch_of[t]].normal(p);
  if (smooth == Vec3{}) return own;
  return dot(own, smooth) < 0 ? smooth * -1 : smooth;
}

double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b));
}

namespace {

bool is_sharp(const PatchMesh& mesh, const Side& s) {
  if (s.second == kNoNeighbour || s.is_crowded) return true;
  const std::uint32_t a = mesh.patch_of[s.first], b = mesh.patch_of[s.second];
  const bool is_free =
      mesh.patches[a].kind == Patch::Kind::free || mesh.patches[b].kind == Patch::Kind::free;
  if (a == b && !is_free) return false;
  const auto at = [&](std::uint32_t v) {
    const Vec3& p = mesh.points[v];
    return angle_between(normal_at(mesh, s.first, p), normal_at(mesh, s.second, p));
  };
  return std::max(at(s.low), at(s.high)) > (is_free ? kSharpFacets : kSharp);
}

/// `neighbours` of the triangles, or none.
std::vector<Side> sharp_sides(const PatchMesh& mesh, std::span<const Triangle> neighbours) {
  std::vector<Side> sharp;
  if (neighbours.empty()) {
    for (const Side& s : sides_of(mesh))
      if (is_sharp(mesh, s)) sharp.push_back(s);
    return sharp;
  }
  std::vector<Vec3> normal;
  normal.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    normal.push_back(unit(mesh.area_vector(t)));
  const double straight = std::cos(kSharpFacets) * (1 + 1e-9);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t u = neighbours[t][k];
      if (u < t) continue;
      const std::uint32_t a = mesh.patch_of[t], b = mesh.patch_of[u];
      const bool are_free =
          mesh.patches[a].kind == Patch::Kind::free && mesh.patches[b].kind == Patch::Kind::free;
      if (are_free && dot(normal[t], normal[u]) > straight) continue;
      const auto [low, high] = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
      const Side s{low, high, t, u};
      if (is_sharp(mesh, s)) sharp.push_back(s);
    }
  std::sort(sharp.begin(), sharp.end(), [](const Side& x, const Side& y) {
    return std::tie(x.low, x.high) < std::tie(y.low, y.high);
  });
  return sharp;
}

}  // namespace

std::vector<Chain> chains_of(const PatchMesh& mesh, std::span<const Triangle> neighbours) {
  const std::vector<Side> sharp = sharp_sides(mesh, neighbours);
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> at;
  for (std::uint32_t i = 0; i < sharp.size(); ++i) {
    at[sharp[i].low].push_back(i);
    at[sharp[i].high].push_back(i);
  }
  const auto faces = [&](const Side& s) {
    const std::uint32_t a = mesh.patch_of[s.first],
                        b = s.second == kNoNeighbour ? a : mesh.patch_of[s.second];
    return std::array<std::uint32_t, 2>{std::min(a, b), std::max(a, b)};
  };
  const auto other = [&](std::uint32_t i, std::uint32_t v) {
    return sharp[i].low == v ? sharp[i].high : sharp[i].low;
  };
  const auto goes_on = [&](std::uint32_t v) {
    const auto& here = at[v];
    if (here.size() != 2) return false;
    if (faces(sharp[here[0]]) == faces(sharp[here[1]])) return true;
    const Vec3 in = mesh.points[v] - mesh.points[other(here[0], v)],
               out = mesh.points[other(here[1], v)] - mesh.points[v];
    return angle_between(in, out) < kStraightOn;
  };
  std::vector<bool> is_used(sharp.size());
  std::vector<Chain> chains;
  const auto follow = [&](std::uint32_t first, std::uint32_t from) {
    Chain chain;
    chain.patches = faces(sharp[first]);
    chain.corners = {from};
    std::uint32_t side = first, v = from;
    while (true) {
      is_used[side] = true;
      v = other(side, v);
      chain.corners.push_back(v);
      if (v == from || !goes_on(v)) break;
      const auto& here = at[v];
      const std::uint32_t next = here[0] == side ? here[1] : here[0];
      if (is_used[next]) break;
      side = next;
    }
    chains.push_back(std::move(chain));
  };
  for (std::uint32_t i = 0; i < sharp.size(); ++i) {
    if (is_used[i]) continue;
    if (!goes_on(sharp[i].low)) follow(i, sharp[i].low);
    else if (!goes_on(sharp[i].high)) follow(i, sharp[i].high);
  }
  for (std::uint32_t i = 0; i < sharp.size(); ++i)
    if (!is_used[i]) follow(i, sharp[i].low);  // rings
  return chains;
}

}  // namespace robomosp::csg_cgal
