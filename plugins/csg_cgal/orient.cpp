// SPDX-License-Identifier: GPL-3.0-or-later
#include "orient.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Surface_mesh.h>

namespace robomosp::csg_cgal {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;

/// A piece whose volume in double is less than this part of its box's is turned by exact
/// predicates.
constexpr double kSureVolume = 1e-6;

/// Pieces in one another, or thinner than double tells.
void orient_exactly(PatchMesh& mesh) {
  using Plain = CGAL::Surface_mesh<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3>;
  Plain s;
  s.reserve(static_cast<Plain::size_type>(mesh.points.size()),
            static_cast<Plain::size_type>(3 * mesh.triangles.size() / 2),
            static_cast<Plain::size_type>(mesh.triangles.size()));
  for (const Vec3& p : mesh.points) s.add_vertex({p[0], p[1], p[2]});
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& v = mesh.triangles[t];
    if (s.add_face(Plain::Vertex_index(v[0]), Plain::Vertex_index(v[1]),
                   Plain::Vertex_index(v[2])) == Plain::null_face())
      throw std::runtime_error("a surface that is not a manifold, at triangle " +
                               std::to_string(t));
  }
  PMP::orient_to_bound_a_volume(s);
  std::size_t t = 0;
  for (const auto f : s.faces()) {
    std::size_t k = 0;
    for (const auto v : s.vertices_around_face(s.halfedge(f)))
      mesh.triangles[t][k++] = static_cast<std::uint32_t>(v);
    ++t;
  }
}

struct Piece {
  Box3 box;
  double six_volume = 0;
};

/// Whether no box of a piece meets another's.
bool pieces_are_apart(const std::vector<Piece>& pieces) {
  std::vector<const Box3*> boxes;
  for (const Piece& p : pieces) boxes.push_back(&p.box);
  std::sort(boxes.begin(), boxes.end(),
            [](const Box3* a, const Box3* b) { return a->low[0] < b->low[0]; });
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = i + 1; j < boxes.size() && boxes[j]->low[0] <= boxes[i]->high[0]; ++j)
      if (boxes[i]->meets(*boxes[j])) return false;
  return true;
}

}  // namespace

void orient_outwards(PatchMesh& mesh, std::vector<Triangle>& neighbours) {
  const std::vector<std::uint32_t> part = parts_of(neighbours);
  std::vector<Piece> pieces(part.empty() ? 0 : *std::max_element(part.begin(), part.end()) + 1U);
  for (std::size_t t = 0; t < part.size(); ++t)
    for (const Vec3& p : mesh.corners(t)) pieces[part[t]].box.add(p);
  for (std::size_t t = 0; t < part.size(); ++t) {
    Piece& piece = pieces[part[t]];
    const auto [a, b, c] = mesh.corners(t);
    const Vec3 o = piece.box.low;
    piece.six_volume += dot(a - o, cross(b - o, c - o));
  }
  const bool is_sure = std::all_of(pieces.begin(), pieces.end(), [](const Piece& p) {
    const Vec3 size = p.box.high - p.box.low;
    return std::abs(p.six_volume) > kSureVolume * size[0] * size[1] * size[2];
  });
  if (!is_sure || !pieces_are_apart(pieces)) {
    orient_exactly(mesh);
    neighbours = neighbours_of(mesh.triangles, mesh.points.size()).value();
    return;
  }
  for (std::size_t t = 0; t < part.size(); ++t)
    if (pieces[part[t]].six_volume < 0) {
      std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
      std::swap(neighbours[t][0], neighbours[t][2]);
    }
}

}  // namespace robomosp::csg_cgal
