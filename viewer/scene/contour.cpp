// SPDX-License-Identifier: GPL-3.0-or-later
// Contours of surfaces for line drawings.
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "viewer/scene/linear.h"
#include "viewer/scene/surface.h"

namespace robomosp::viewer {
namespace {

Vec3 contour_vertex(const Surface& s, std::size_t i) {
  return {s.positions[3 * i], s.positions[3 * i + 1], s.positions[3 * i + 2]};
}

/// Joins edges that share vertices to lines and writes them one after the other.
Segments joined(const Surface& s, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& all) {
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> at;  // edges by vertex
  for (std::uint32_t e = 0; e < all.size(); ++e) {
    at[all[e].first].push_back(e);
    at[all[e].second].push_back(e);
  }
  Segments out;
  std::vector<bool> is_used(all.size(), false);
  const auto walk = [&](std::uint32_t edge, std::uint32_t from) {
    double way = 0;
    for (;;) {
      is_used[edge] = true;
      const std::uint32_t to = all[edge].first == from ? all[edge].second : all[edge].first;
      const Vec3 a = contour_vertex(s, from), b = contour_vertex(s, to);
      for (const Vec3& p : {a, b})
        for (const double x : p) out.ends.push_back(static_cast<float>(x));
      out.along.push_back(static_cast<float>(way));
      way += norm(b - a);
      out.along.push_back(static_cast<float>(way));
      from = to;
      const auto& next = at[from];
      const auto free =
          std::find_if(next.begin(), next.end(), [&](std::uint32_t e) { return !is_used[e]; });
      if (free == next.end()) return;
      edge = *free;
    }
  };
  // Open lines from their ends first, then what is left are loops.
  for (const bool is_loop : {false, true})
    for (std::uint32_t e = 0; e < all.size(); ++e)
      for (const std::uint32_t v : {all[e].first, all[e].second})
        if (!is_used[e] && (is_loop || at[v].size() % 2 == 1)) walk(e, v);
  return out;
}

}  // namespace

std::vector<MeshEdge> edges_of(const Surface& s) {
  struct Half {
    std::uint64_t ends;
    std::uint32_t triangle;
  };
  const auto weld = welded(s);
  std::vector<Half> halves;
  halves.reserve(s.triangles.size());
  for (std::size_t c = 0; c < s.triangles.size(); ++c) {
    const std::size_t t = c / 3;
    const std::uint64_t a = weld[s.triangles[c]], b = weld[s.triangles[3 * t + (c + 1) % 3]];
    if (a != b)
      halves.push_back({std::min(a, b) << 32 | std::max(a, b), static_cast<std::uint32_t>(t)});
  }
  std::sort(halves.begin(), halves.end(), [](const Half& a, const Half& b) {
    return a.ends != b.ends ? a.ends < b.ends : a.triangle < b.triangle;
  });
  std::vector<MeshEdge> edges;
  edges.reserve(halves.size() / 2);
  for (std::size_t i = 0, j; i < halves.size(); i = j) {
    for (j = i; j < halves.size() && halves[j].ends == halves[i].ends;) ++j;
    if (j - i > 2) continue;
    edges.push_back({static_cast<std::uint32_t>(halves[i].ends >> 32),
                     static_cast<std::uint32_t>(halves[i].ends & 0xFFFFFFFFU), halves[i].triangle,
                     halves[j - 1].triangle});
  }
  return edges;
}

Segments tangent_edges_of(const Surface& s, const std::vector<MeshEdge>& edges) {
  if (s.face_of.empty()) return {};
  const auto normal = [&](std::uint32_t t) {
    const auto* i = &s.triangles[3 * std::size_t{t}];
    const Vec3 a = contour_vertex(s, i[0]);
    return cross(contour_vertex(s, i[1]) - a, contour_vertex(s, i[2]) - a);
  };
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
  for (const MeshEdge& e : edges) {
    if (s.face_of[e.left] == s.face_of[e.right]) continue;
    const Vec3 l = normal(e.left), r = normal(e.right);
    if (dot(l, r) >= std::cos(kCreaseAngle) * norm(l) * norm(r)) found.emplace_back(e.a, e.b);
  }
  return joined(s, found);
}

Segments contour_of(const Surface& s, const std::vector<MeshEdge>& edges, const Vec3& eye,
                    bool is_point) {
  enum Facing : std::uint8_t { towards, away, neither };
  std::vector<Facing> facing(s.triangles.size() / 3);
  for (std::size_t t = 0; t < facing.size(); ++t) {
    const auto* i = &s.triangles[3 * t];
    const Vec3 a = contour_vertex(s, i[0]);
    const Vec3 n = cross(contour_vertex(s, i[1]) - a, contour_vertex(s, i[2]) - a);
    const double d = dot(n, is_point ? eye - a : eye);
    facing[t] = norm(n) <= 0 ? neither : d > 0 ? towards : away;
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> found;
  for (const MeshEdge& e : edges) {
    const Facing l = facing[e.left], r = facing[e.right];
    if (l != r && l != neither && r != neither) found.emplace_back(e.a, e.b);
  }
  return joined(s, found);
}

}  // namespace robomosp::viewer
