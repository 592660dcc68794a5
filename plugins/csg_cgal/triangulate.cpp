// SPDX-License-Identifier: GPL-3.0-or-later
#include "triangulate.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

namespace robomosp::csg_cgal {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
constexpr int kUnseen = -1;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
using FaceInfo = CGAL::Triangulation_face_base_with_info_2<int, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel, FaceInfo>;
using Data = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<Kernel, Data>;

double twice_area(const std::vector<Point2>& loop) {
  double sum = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Point2 &a = loop[i], &b = loop[(i + 1) % loop.size()];
    sum += (a[0] - loop[0][0]) * (b[1] - loop[0][1]) - (a[1] - loop[0][1]) * (b[0] - loop[0][0]);
  }
  return sum;
}

/// How many constraints lie between the outside and each face, in its info.
void count_nesting(Triangulation& cdt) {
  for (auto f = cdt.all_faces_begin(); f != cdt.all_faces_end(); ++f) f->info() = kUnseen;
  std::vector<std::pair<Triangulation::Face_handle, int>> open{{cdt.infinite_face(), 0}}, beyond;
  while (!open.empty()) {
    while (!open.empty()) {
      const auto [face, level] = open.back();
      open.pop_back();
      if (face->info() != kUnseen) continue;
      face->info() = level;
      for (int k = 0; k < 3; ++k) {
        const auto next = face->neighbor(k);
        if (next->info() != kUnseen) continue;
        if (cdt.is_constrained({face, k})) beyond.emplace_back(next, level + 1);
        else open.emplace_back(next, level);
      }
    }
    std::swap(open, beyond);
  }
}

}  // namespace

std::optional<Region> triangulate(std::vector<std::vector<Point2>> loops) {
  Triangulation cdt;
  std::vector<std::vector<Triangulation::Vertex_handle>> handles;
  std::uint32_t count = 0;
  for (const auto& loop : loops) {
    if (loop.size() < 3) return std::nullopt;
    handles.emplace_back();
    for (const Point2& p : loop) {
      const std::size_t before = cdt.number_of_vertices();
      const auto v = cdt.insert({p[0], p[1]});
      if (cdt.number_of_vertices() == before) return std::nullopt;
      v->info() = count++;
      handles.back().push_back(v);
    }
  }
  try {  // A crossing is a violated precondition.
    for (const auto& loop : handles)
      for (std::size_t i = 0; i < loop.size(); ++i)
        cdt.insert_constraint(loop[i], loop[(i + 1) % loop.size()]);
  } catch (const std::exception&) {
    return std::nullopt;
  }
  if (cdt.number_of_vertices() != count) return std::nullopt;
  // An edge through a corner of another loop would have been split there.
  for (const auto& loop : handles)
    for (std::size_t i = 0; i < loop.size(); ++i) {
      Triangulation::Face_handle face;
      int k = 0;
      if (!cdt.is_edge(loop[i], loop[(i + 1) % loop.size()], face, k)) return std::nullopt;
    }
  count_nesting(cdt);
  Region region;
  std::vector<std::uint32_t> number(count);
  // The side of each loop's first edge says whether material lies left of it.
  std::uint32_t first = 0;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    const auto size = static_cast<std::uint32_t>(loops[l].size());
    Triangulation::Face_handle face;
    int k = 0;
    (void)cdt.is_edge(handles[l][0], handles[l][1], face, k);
    const bool is_left = face->vertex(cdt.ccw(k)) == handles[l][0];
    const bool is_inside = !cdt.is_infinite(face) && face->info() % 2 == 1;
    const bool keep = is_left == is_inside;
    for (std::uint32_t i = 0; i < size; ++i) number[first + i] = first + (keep ? i : size - 1 - i);
    if (!keep) std::reverse(loops[l].begin(), loops[l].end());
    if (twice_area(loops[l]) == 0) return std::nullopt;
    first += size;
  }
  for (auto f = cdt.finite_faces_begin(); f != cdt.finite_faces_end(); ++f)
    if (f->info() % 2 == 1)
      region.triangles.push_back({number[f->vertex(0)->info()], number[f->vertex(1)->info()],
                                  number[f->vertex(2)->info()]});
  if (region.triangles.empty()) return std::nullopt;
  region.loops = std::move(loops);
  return region;
}

}  // namespace robomosp::csg_cgal
