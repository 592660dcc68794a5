// SPDX-License-Identifier: Apache-2.0
#include "geometry/mesh_checks.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace robomosp::geometry {
namespace {

/// For every vertex the first one at the same position.
std::vector<std::uint32_t> merged_by_position(const Mesh& mesh) {
  const std::size_t n = mesh.vertex_count();
  const auto at = [&](std::uint32_t v) {
    const float* p = mesh.positions.data() + 3 * static_cast<std::size_t>(v);
    return std::array<float, 3>{p[0] + 0.0F, p[1] + 0.0F, p[2] + 0.0F};  // -0 equals 0
  };
  std::vector<std::uint32_t> order(n), merged(n);
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return at(a) < at(b); });
  for (std::size_t i = 0; i < n; ++i)
    merged[order[i]] = i > 0 && at(order[i]) == at(order[i - 1]) ? merged[order[i - 1]] : order[i];
  return merged;
}

struct Edge {
  std::uint32_t low, high;
  bool is_forward;
  std::uint32_t triangle;
  auto operator<=>(const Edge&) const = default;
};

/// Edges of one line, forward ones first or last: whether two of them belong to the same triangle,
/// given twice. `third` gives the corner that is not on the edge.
template <class Third>
bool has_twins(const std::vector<Edge>& edges, std::size_t first, std::size_t end, Third&& third) {
  std::vector<std::pair<bool, std::uint32_t>> sides;
  for (std::size_t i = first; i < end; ++i)
    sides.emplace_back(edges[i].is_forward, third(edges[i]));
  std::sort(sides.begin(), sides.end());
  return std::adjacent_find(sides.begin(), sides.end()) != sides.end();
}

std::size_t root_of(std::vector<std::size_t>& parent, std::size_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

}  // namespace

MeshReport check(const Mesh& mesh) {
  MeshReport report;
  const auto refuse = [&](std::string why) {
    report.problem = std::move(why);
    return report;
  };
  if (mesh.positions.size() % 3 != 0 || mesh.triangles.size() % 3 != 0)
    return refuse("the mesh has incomplete vertices or triangles.");
  if (mesh.triangles.empty()) return refuse("the mesh has no triangles.");
  for (const float x : mesh.positions)
    if (!std::isfinite(x)) return refuse("a vertex of the mesh is not a finite number.");
  for (const std::uint32_t v : mesh.triangles)
    if (v >= mesh.vertex_count())
      return refuse("a triangle refers to vertex " + std::to_string(v) + " of " +
                    std::to_string(mesh.vertex_count()) + ".");

  const std::vector<std::uint32_t> merged = merged_by_position(mesh);
  std::vector<Edge> edges;
  edges.reserve(mesh.triangles.size());
  std::vector<bool> is_degenerate(mesh.triangle_count());
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    std::array<std::uint32_t, 3> v;
    for (std::size_t k = 0; k < 3; ++k) v[k] = merged[mesh.triangles[3 * t + k]];
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
      ++report.degenerate;
      is_degenerate[t] = true;
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = v[k], b = v[(k + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b, static_cast<std::uint32_t>(t)});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<std::size_t> piece(mesh.triangle_count());
  std::iota(piece.begin(), piece.end(), std::size_t{0});
  const auto third = [&](const Edge& e) {
    for (std::size_t k = 0; k < 3; ++k)
      if (const auto v = merged[mesh.triangles[3 * std::size_t{e.triangle} + k]];
          v != e.low && v != e.high)
        return v;
    return e.low;
  };
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t end = first, forward = 0;
    for (; end < edges.size() && edges[end].low == edges[first].low &&
           edges[end].high == edges[first].high;
         ++end) {
      forward += edges[end].is_forward ? 1 : 0;
      piece[root_of(piece, edges[end].triangle)] = root_of(piece, edges[first].triangle);
    }
    const std::size_t backward = end - first - forward;
    // Solids may touch along a line: four triangles meet there, two a direction.
    if (forward + backward == 1) ++report.open_edges;
    else if (forward != backward || (forward > 1 && has_twins(edges, first, end, third)))
      ++report.bad_edges;
    first = end;
  }
  for (std::size_t t = 0; t < piece.size(); ++t)
    if (!is_degenerate[t] && root_of(piece, t) == t) ++report.pieces;
  if (edges.empty()) return refuse("all triangles of the mesh are degenerate.");
  report.is_closed = report.open_edges == 0 && report.bad_edges == 0;
  if (!report.is_closed)
    report.problem = "the mesh is not closed: " + std::to_string(report.open_edges) + " open and " +
                     std::to_string(report.bad_edges) + " badly matched edges.";
  return report;
}

std::optional<std::array<Vec3, 2>> bounds(const Mesh& mesh) {
  if (mesh.vertex_count() == 0) return std::nullopt;
  std::array<Vec3, 2> box{Vec3{mesh.positions[0], mesh.positions[1], mesh.positions[2]},
                          Vec3{mesh.positions[0], mesh.positions[1], mesh.positions[2]}};
  for (std::size_t i = 0; i < mesh.vertex_count(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = mesh.positions[3 * i + k];
      box[0][k] = std::min(box[0][k], x);
      box[1][k] = std::max(box[1][k], x);
    }
  return box;
}

}  // namespace robomosp::geometry
