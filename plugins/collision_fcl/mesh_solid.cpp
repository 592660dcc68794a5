// SPDX-License-Identifier: Apache-2.0
#include "mesh_solid.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "spatial/convex_hull.h"
#include "spatial/vec.h"

namespace robomosp::collision_fcl {
namespace {

using namespace spatial;

std::optional<bool> by_ray(const MeshSolid& solid, const Vec3& from, const Vec3& way) {
  constexpr double kNear = 1e-9;
  int enclosed = 0;
  for (const auto& t : solid.triangles) {
    // Moeller, Trumbore, J. Graphics Tools 2 (1997) 21.
    const Vec3 e1 = sub(solid.points[t[1]], solid.points[t[0]]),
               e2 = sub(solid.points[t[2]], solid.points[t[0]]);
    const Vec3 p = cross(way, e2), s = sub(from, solid.points[t[0]]);
    const double det = dot(e1, p);
    const double flat = kNear * norm(e1) * norm(e2);
    const double u = dot(s, p);
    const Vec3 q = cross(s, e1);
    const double v = dot(way, q), along = dot(e2, q);
    if (std::fabs(det) <= flat) {
      // Seen edge-on: it is crossed only where the point is in its plane.
      const Vec3 n = cross(e1, e2);
      if (std::fabs(dot(n, s)) <= kNear * norm(n) * (norm(s) + norm(e1))) return std::nullopt;
      continue;
    }
    const double a = u / det, b = v / det;
    if (a < -kNear || b < -kNear || a + b > 1 + kNear || along / det < 0) continue;
    if (a < kNear || b < kNear || a + b > 1 - kNear) return std::nullopt;
    enclosed += det > 0 ? -1 : 1;
  }
  return enclosed != 0;
}

/// Sum of the solid angles of the triangles (van Oosterom, Strackee, IEEE Trans. Biomed. Eng. 30
/// (1983) 125).
bool by_winding(const MeshSolid& solid, const Vec3& at) {
  double sum = 0;
  for (const auto& t : solid.triangles) {
    const Vec3 a = sub(solid.points[t[0]], at), b = sub(solid.points[t[1]], at),
               c = sub(solid.points[t[2]], at);
    const double la = norm(a), lb = norm(b), lc = norm(c);
    sum += 2 * std::atan2(dot(a, cross(b, c)),
                          la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
  }
  return std::fabs(sum) > 2 * std::numbers::pi;
}

/// Whether every edge is run as often in one direction as in the other.
bool is_closed(const MeshSolid& solid) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> there, back;
  for (const auto& t : solid.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      there.emplace_back(t[k], t[(k + 1) % 3]);
      back.emplace_back(t[(k + 1) % 3], t[k]);
    }
  std::sort(there.begin(), there.end());
  std::sort(back.begin(), back.end());
  return there == back;
}

}  // namespace

MeshSolid mesh_solid(const Mesh& mesh) {
  MeshSolid s;
  std::map<Vec3, std::uint32_t> number;
  std::vector<std::uint32_t> of_vertex;
  for (const Vec3& p : vertices(mesh)) {
    const auto [it, is_new] = number.emplace(p, static_cast<std::uint32_t>(s.points.size()));
    if (is_new) s.points.push_back(p);
    of_vertex.push_back(it->second);
  }
  std::vector<std::uint32_t> piece(s.points.size());
  std::iota(piece.begin(), piece.end(), 0U);
  const auto root = [&](std::uint32_t i) {
    while (piece[i] != i) i = piece[i] = piece[piece[i]];
    return i;
  };
  for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
    const std::array<std::uint32_t, 3> t{of_vertex[mesh.triangles[i]],
                                         of_vertex[mesh.triangles[i + 1]],
                                         of_vertex[mesh.triangles[i + 2]]};
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    s.triangles.push_back(t);
    piece[root(t[1])] = root(t[0]);
    piece[root(t[2])] = root(t[0]);
  }
  std::vector<bool> seen(s.points.size());
  for (const auto& t : s.triangles)
    if (const auto r = root(t[0]); !seen[r]) {
      seen[r] = true;
      s.one_of_each_piece.push_back(s.points[t[0]]);
    }
  s.is_closed = is_closed(s);
  return s;
}

bool contains(const MeshSolid& solid, const Vec3& point) {
  constexpr std::array<Vec3, 4> kWays{{{0.5377, 0.2113, 0.8163},
                                       {-0.3271, 0.7409, 0.5866},
                                       {0.6911, -0.6043, 0.3967},
                                       {-0.2593, -0.4391, -0.8602}}};
  if (solid.is_closed)
    for (const Vec3& way : kWays)
      if (const auto inside = by_ray(solid, point, way)) return *inside;
  return by_winding(solid, point);
}

}  // namespace robomosp::collision_fcl
