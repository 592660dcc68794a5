// SPDX-License-Identifier: GPL-3.0-or-later
#include "viewer/scene/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "viewer/scene/linear.h"

namespace robomosp::viewer {
namespace {

Vec3 surface_vertex(const std::vector<float>& positions, std::size_t i) {
  return {positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]};
}

void append(std::vector<float>& to, const Vec3& p) {
  for (const double x : p) to.push_back(static_cast<float>(x));
}

/// Twice the area times the unit normal.
Vec3 area_normal(const Surface& s, std::size_t triangle) {
  const auto* t = &s.triangles[3 * triangle];
  const Vec3 a = surface_vertex(s.positions, t[0]);
  return cross(surface_vertex(s.positions, t[1]) - a, surface_vertex(s.positions, t[2]) - a);
}

/// The triangles with usable corners; `face_of` gets the face of each, if the mesh knows faces.
std::vector<std::uint32_t> usable_triangles(const Mesh& mesh, std::vector<std::uint32_t>& face_of) {
  std::vector<std::uint32_t> faces;
  if (!mesh.faces.empty()) {
    faces.assign(mesh.triangles.size() / 3, 0);
    for (std::size_t f = 0; f < mesh.faces.size(); ++f)
      for (std::size_t t = mesh.faces[f].first_triangle;
           t < std::size_t{mesh.faces[f].first_triangle} + mesh.faces[f].triangle_count &&
           t < faces.size();
           ++t)
        faces[t] = static_cast<std::uint32_t>(f);
  }
  const std::size_t count = mesh.positions.size() / 3;
  const auto is_usable = [&](std::uint32_t i) {
    return i < count && is_finite(surface_vertex(mesh.positions, i));
  };
  std::vector<std::uint32_t> kept;
  kept.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i + 2 < mesh.triangles.size(); i += 3) {
    const auto* t = &mesh.triangles[i];
    if (!is_usable(t[0]) || !is_usable(t[1]) || !is_usable(t[2])) continue;
    kept.insert(kept.end(), t, t + 3);
    if (!faces.empty()) face_of.push_back(faces[i / 3]);
  }
  return kept;
}

std::vector<Vec3> face_normals(const Surface& s) {
  std::vector<Vec3> normals(s.triangles.size() / 3);
  for (std::size_t i = 0; i < normals.size(); ++i) normals[i] = area_normal(s, i);
  return normals;
}

bool is_crease(const Vec3& a, const Vec3& b) {
  const double scale = norm(a) * norm(b);
  return scale > 0 && dot(a, b) < std::cos(kCreaseAngle) * scale;
}

/// Gives each corner its own vertex whose normal is the area-weighted mean over the triangles
/// around it that meet at less than the crease angle.
void compute_normals(Surface& s) {
  const auto weld = welded(s);
  const auto normals = face_normals(s);
  std::vector<std::uint32_t> start(weld.size() + 1, 0), around(s.triangles.size());
  for (const std::uint32_t i : s.triangles) ++start[weld[i] + 1];
  for (std::size_t i = 1; i < start.size(); ++i) start[i] += start[i - 1];
  auto next = start;
  for (std::size_t c = 0; c < s.triangles.size(); ++c)
    around[next[weld[s.triangles[c]]]++] = static_cast<std::uint32_t>(c / 3);

  // Hundreds of triangles around one vertex (the tip of a cone) would cost the square of
  // that.
  constexpr std::uint32_t kMostNeighbours = 256;
  std::vector<float> positions, out;
  positions.reserve(3 * s.triangles.size());
  out.reserve(3 * s.triangles.size());
  for (std::size_t c = 0; c < s.triangles.size(); ++c) {
    const std::uint32_t at = weld[s.triangles[c]];
    const Vec3& own = normals[c / 3];
    Vec3 sum{};
    const std::uint32_t end = std::min(start[at + 1], start[at] + kMostNeighbours);
    for (std::uint32_t k = start[at]; k < end; ++k)
      if (!is_crease(own, normals[around[k]])) sum = sum + normals[around[k]];
    if (norm(sum) <= 0) sum = own;
    const double length = norm(sum);
    append(positions, surface_vertex(s.positions, s.triangles[c]));
    append(out, length > 0 ? (1 / length) * sum : Vec3{0, 0, 1});
  }
  s.positions = std::move(positions);
  s.normals = std::move(out);
  for (std::size_t c = 0; c < s.triangles.size(); ++c)
    s.triangles[c] = static_cast<std::uint32_t>(c);
}

void take_feature_edges(const Mesh& mesh, Surface& s) {
  std::size_t at = 0;
  const std::size_t points = mesh.edge_points.size() / 3;
  for (const std::uint32_t size : mesh.edge_sizes) {
    double way = 0;
    for (std::size_t i = at; i + 1 < at + size && i + 1 < points; ++i) {
      const Vec3 a = surface_vertex(mesh.edge_points, i),
                 b = surface_vertex(mesh.edge_points, i + 1);
      if (!is_finite(a) || !is_finite(b)) continue;
      append(s.segments, a);
      append(s.segments, b);
      s.along.push_back(static_cast<float>(way));
      way += norm(b - a);
      s.along.push_back(static_cast<float>(way));
    }
    at += size;
  }
}

void find_creases(Surface& s) {
  struct Edge {
    std::uint64_t ends;
    std::uint32_t triangle;
  };
  const auto weld = welded(s);
  const auto normals = face_normals(s);
  std::vector<Edge> edges;
  edges.reserve(s.triangles.size());
  for (std::size_t c = 0; c < s.triangles.size(); ++c) {
    const std::size_t t = c / 3;
    if (norm(normals[t]) <= 0) continue;
    const std::uint64_t a = weld[s.triangles[c]], b = weld[s.triangles[3 * t + (c + 1) % 3]];
    edges.push_back({std::min(a, b) << 32 | std::max(a, b), static_cast<std::uint32_t>(t)});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.ends != b.ends ? a.ends < b.ends : a.triangle < b.triangle;
  });
  for (std::size_t i = 0, j; i < edges.size(); i = j) {
    for (j = i; j < edges.size() && edges[j].ends == edges[i].ends;) ++j;
    const bool is_border = j - i == 1;
    const bool is_sharp =
        j - i == 2 && is_crease(normals[edges[i].triangle], normals[edges[i + 1].triangle]);
    if (!is_border && !is_sharp) continue;
    const Vec3 a = surface_vertex(s.positions, edges[i].ends >> 32),
               b = surface_vertex(s.positions, edges[i].ends & 0xFFFFFFFFU);
    append(s.segments, a);
    append(s.segments, b);
    s.along.push_back(0);
    s.along.push_back(static_cast<float>(norm(b - a)));
  }
}

void compute_bounds(Surface& s) {
  if (s.triangles.empty()) return;
  s.low = s.high = surface_vertex(s.positions, s.triangles[0]);
  for (const std::uint32_t v : s.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double x = s.positions[3 * std::size_t{v} + i];
      s.low[i] = std::min(s.low[i], x);
      s.high[i] = std::max(s.high[i], x);
    }
  }
}

void find_closed(Surface& s) {
  if (s.triangles.empty()) return;
  const auto weld = welded(s);
  // Each edge by its ends; +1 = passed one way, -1 = the other.
  std::vector<std::pair<std::uint64_t, int>> ways;
  ways.reserve(s.triangles.size());
  double volume = 0;
  for (std::size_t t = 0; t + 2 < s.triangles.size(); t += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = weld[s.triangles[t + k]], b = weld[s.triangles[t + (k + 1) % 3]];
      if (a != b) ways.emplace_back(std::min(a, b) << 32 | std::max(a, b), a < b ? 1 : -1);
    }
    const Vec3 a = surface_vertex(s.positions, s.triangles[t]);
    volume += dot(a - s.low, cross(surface_vertex(s.positions, s.triangles[t + 1]) - s.low,
                                   surface_vertex(s.positions, s.triangles[t + 2]) - s.low));
  }
  std::sort(ways.begin(), ways.end());
  for (std::size_t i = 0, j; i < ways.size(); i = j) {
    int sum = 0;
    for (j = i; j < ways.size() && ways[j].first == ways[i].first; ++j) sum += ways[j].second;
    if (sum != 0) return;
  }
  s.is_closed = volume > 0;
}

bool misses_box(const Surface& s, const Vec3& o, const Vec3& d) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  const double slack = 1e-9 + 1e-6 * norm(s.high - s.low);
  for (std::size_t i = 0; i < 3; ++i) {
    if (d[i] == 0) {
      if (o[i] < s.low[i] - slack || o[i] > s.high[i] + slack) return true;
      continue;
    }
    double a = (s.low[i] - slack - o[i]) / d[i], b = (s.high[i] + slack - o[i]) / d[i];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a);
    leave = std::min(leave, b);
  }
  return enter > leave;
}

}  // namespace

std::vector<std::uint32_t> welded(const Surface& s) {
  using Cell = std::array<std::int64_t, 3>;
  struct Hash {
    std::size_t operator()(const Cell& c) const {
      std::size_t h = 1469598103934665603ULL;  // FNV-1a
      for (const std::int64_t x : c) h = (h ^ static_cast<std::size_t>(x)) * 1099511628211ULL;
      return h;
    }
  };
  double largest = 0;
  for (const std::uint32_t v : s.triangles)
    for (const double x : surface_vertex(s.positions, v)) largest = std::max(largest, std::abs(x));
  const double cell = std::max(1e-6 * largest, 1e-30);  // floats carry 24 bits, 6e-8
  std::unordered_map<Cell, std::uint32_t, Hash> first;
  std::vector<std::uint32_t> weld(s.positions.size() / 3);
  for (std::size_t i = 0; i < weld.size(); ++i) weld[i] = static_cast<std::uint32_t>(i);
  for (const std::uint32_t v : s.triangles) {
    Cell key{};
    const Vec3 p = surface_vertex(s.positions, v);
    for (std::size_t i = 0; i < 3; ++i) key[i] = std::llround(p[i] / cell);
    weld[v] = first.emplace(key, v).first->second;
  }
  return weld;
}

Surface surface_of(const Mesh& mesh) {
  Surface s;
  s.triangles = usable_triangles(mesh, s.face_of);
  s.positions = mesh.positions;
  s.positions.resize(s.positions.size() / 3 * 3);
  const bool has_edges = !mesh.edge_sizes.empty();
  if (has_edges) take_feature_edges(mesh, s);
  else find_creases(s);
  if (mesh.normals.size() == mesh.positions.size()) {
    s.normals = mesh.normals;
    s.normals.resize(s.positions.size());
    for (float& x : s.normals)
      if (!std::isfinite(x)) x = 0;
  } else {
    compute_normals(s);
  }
  compute_bounds(s);
  find_closed(s);
  return s;
}

// Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", J. Graphics Tools 2
// (1997).
std::optional<double> first_hit(const Surface& surface, const Vec3& origin, const Vec3& direction) {
  if (surface.triangles.empty() || misses_box(surface, origin, direction)) return std::nullopt;
  std::optional<double> nearest;
  for (std::size_t t = 0; t + 2 < surface.triangles.size(); t += 3) {
    const Vec3 a = surface_vertex(surface.positions, surface.triangles[t]);
    const Vec3 e1 = surface_vertex(surface.positions, surface.triangles[t + 1]) - a;
    const Vec3 e2 = surface_vertex(surface.positions, surface.triangles[t + 2]) - a;
    const Vec3 p = cross(direction, e2);
    const double det = dot(e1, p);
    if (det == 0) continue;
    const Vec3 r = origin - a;
    const double u = dot(r, p) / det;
    if (u < 0 || u > 1) continue;
    const Vec3 q = cross(r, e1);
    const double v = dot(direction, q) / det;
    if (v < 0 || u + v > 1) continue;
    const double distance = dot(e2, q) / det;
    if (distance > 0 && (!nearest || distance < *nearest)) nearest = distance;
  }
  return nearest;
}

}  // namespace robomosp::viewer
