// SPDX-License-Identifier: GPL-3.0-or-later
#include "near_surface.h"

#include <algorithm>
#include <numeric>
#include <tuple>

#include <CGAL/Polygon_mesh_processing/corefinement.h>

namespace robomosp::csg_cgal {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Face = Surface::Face_index;
using Vertex = Surface::Vertex_index;
using Halfedge = Surface::Halfedge_index;
using Edge = Surface::Edge_index;

constexpr const char* kTriangleProperty = "f:triangle";
constexpr const char* kWallProperty = "e:wall";

Surface::Property_map<Face, std::uint32_t> triangles_of(const Surface& s) {
  return s.property_map<Face, std::uint32_t>(kTriangleProperty).first;
}
Surface::Property_map<Edge, bool> walls_of(const Surface& s) {
  return s.property_map<Edge, bool>(kWallProperty).first;
}

/// Keeps the triangle that every piece comes from, and lets the user stop the cut.
class NearTracker : public PMP::Corefinement::Default_visitor<Surface> {
 public:
  explicit NearTracker(const Progress& progress) : progress_(&progress) {}
  void before_subface_creations(Face split, Surface& s) {
    stop_if_cancelled(*progress_);
    triangle_ = triangles_of(s)[split];
  }
  void after_subface_created(Face made, Surface& s) { triangles_of(s)[made] = triangle_; }
  void edge_face_intersections_step() const { stop_if_cancelled(*progress_); }
  void intersection_of_coplanar_faces_step() const { stop_if_cancelled(*progress_); }
  void triangulating_faces_step() const { stop_if_cancelled(*progress_); }

 private:
  const Progress* progress_;
  std::uint32_t triangle_ = 0;
};

std::size_t side_from(const Triangle& t, std::uint32_t corner) {
  return t[0] == corner ? 0 : t[1] == corner ? 1 : 2;
}

}  // namespace

void NearSurface::build() {
  const auto& triangles = solid_->mesh().triangles;
  const auto& neighbours = *neighbours_;
  // Vertices by fans: triangles taken that hang together round a corner.
  std::vector<Triangle> vertex(near_.size(), {kNone, kNone, kNone});
  for (std::uint32_t i = 0; i < near_.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      if (vertex[i][k] != kNone) continue;
      const std::uint32_t corner = triangles[near_[i]][k];
      const auto made = static_cast<std::uint32_t>(corner_of_.size());
      corner_of_.push_back(corner);
      surface_.add_vertex(solid_->impl().exact(corner));
      for (const std::size_t way : {std::size_t{2}, std::size_t{0}}) {
        std::uint32_t t = near_[i];
        std::size_t at = k;
        while (true) {
          vertex[number_[t]][at] = made;
          t = neighbours[t][(at + way) % 3];
          if (number_[t] == kNone) break;
          at = side_from(triangles[t], corner);
          if (vertex[number_[t]][at] == made) break;
        }
      }
    }
  auto from = surface_.add_property_map<Face, std::uint32_t>(kTriangleProperty, 0).first;
  surface_.add_property_map<Edge, bool>(kWallProperty, false);
  for (std::uint32_t i = 0; i < near_.size(); ++i) {
    const Triangle& v = vertex[i];
    const Face f = surface_.add_face(Vertex(v[0]), Vertex(v[1]), Vertex(v[2]));
    if (f == Surface::null_face())
      throw std::runtime_error("a surface that is not a manifold, at triangle " +
                               std::to_string(near_[i]));
    from[f] = near_[i];
  }
}

void NearSurface::cut(NearSurface& a, NearSurface& b, const Progress& progress) {
  PMP::corefine(a.surface_, b.surface_,
                CGAL::parameters::edge_is_constrained_map(walls_of(a.surface_))
                    .visitor(NearTracker(progress)),
                CGAL::parameters::edge_is_constrained_map(walls_of(b.surface_)));
}

/// New corners in an order of their own: CGAL's may differ from run to run.
void NearSurface::name_corners() {
  const auto given = static_cast<std::uint32_t>(corner_of_.size());
  struct New {
    Vec3 rounded;
    std::uint32_t vertex;
  };
  std::vector<New> fresh;
  for (const Vertex v : surface_.vertices())
    if (static_cast<std::uint32_t>(v) >= given)
      fresh.push_back({rounded(surface_.point(v), made_slack_), static_cast<std::uint32_t>(v)});
  std::sort(fresh.begin(), fresh.end(), [&](const New& x, const New& y) {
    if (x.rounded != y.rounded) return x.rounded < y.rounded;
    return surface_.point(Vertex(x.vertex)) < surface_.point(Vertex(y.vertex));
  });
  corner_of_.resize(surface_.num_vertices(), kNone);
  for (const New& n : fresh) {
    corner_of_[n.vertex] = corner_count();
    made_.push_back(surface_.point(Vertex(n.vertex)));
    made_rounded_.push_back(n.rounded);
  }
}

bool NearSurface::join(std::uint32_t piece, std::size_t side, Halfedge h,
                       const std::vector<std::uint32_t>& piece_of) {
  Piece& p = pieces_[piece];
  const auto far_count = static_cast<std::uint32_t>(number_.size());
  const Face other = surface_.face(surface_.opposite(h));
  if (walls_of(surface_)[surface_.edge(h)]) {
    p.beyond[side] = kWall;
    return other != Surface::null_face();
  }
  if (other != Surface::null_face()) {
    p.beyond[side] = far_count + piece_of[other];
    return true;
  }
  // A side of the triangle that was not cut.
  const auto& triangles = solid_->mesh().triangles;
  const Triangle& whole = triangles[p.triangle];
  const std::uint32_t from = p.corners[side], to = p.corners[(side + 1) % 3];
  const std::size_t k = side_from(whole, from);
  if (whole[k] != from || whole[(k + 1) % 3] != to) return false;
  const std::uint32_t far = (*neighbours_)[p.triangle][k];
  if (number_[far] != kNone) return false;
  p.beyond[side] = far;
  shore_.emplace_back(std::uint64_t{3} * far + side_from(triangles[far], to), far_count + piece);
  return true;
}

bool NearSurface::finish() {
  name_corners();
  const auto from = triangles_of(surface_);
  struct Named {
    Piece piece;
    Face face;
  };
  std::vector<Named> named;
  named.reserve(surface_.number_of_faces());
  for (const Face f : surface_.faces()) {
    Piece p{from[f], {}};
    std::size_t k = 0;
    for (const Vertex v : surface_.vertices_around_face(surface_.halfedge(f)))
      p.corners[k++] = corner_of_[v];
    std::rotate(p.corners.begin(), std::min_element(p.corners.begin(), p.corners.end()),
                p.corners.end());
    named.push_back({p, f});
  }
  std::sort(named.begin(), named.end(), [](const Named& x, const Named& y) {
    return std::tie(x.piece.triangle, x.piece.corners) <
           std::tie(y.piece.triangle, y.piece.corners);
  });
  std::vector<std::uint32_t> piece_of(surface_.num_faces(), kNone);
  for (const Named& n : named) {
    piece_of[n.face] = static_cast<std::uint32_t>(pieces_.size());
    pieces_.push_back(n.piece);
  }
  for (std::uint32_t i = 0; i < pieces_.size(); ++i) {
    Halfedge h = surface_.halfedge(named[i].face);
    for (int n = 0; n < 3; ++n, h = surface_.next(h)) {
      const std::uint32_t corner = corner_of_[surface_.source(h)];
      if (!join(i, side_from(pieces_[i].corners, corner), h, piece_of)) return false;
    }
  }
  std::sort(shore_.begin(), shore_.end());
  const auto first_piece = static_cast<std::uint32_t>(number_.size());
  const auto is_wall = walls_of(surface_);
  for (const Edge e : surface_.edges()) {
    if (!is_wall[e]) continue;
    const Halfedge h = surface_.halfedge(e), back = surface_.opposite(h);
    const Vertex u = surface_.source(h), v = surface_.target(h);
    const std::uint32_t left = piece_of[surface_.face(h)], right = piece_of[surface_.face(back)];
    walls_.push_back({corner_of_[u],
                      corner_of_[v],
                      first_piece + left,
                      first_piece + right,
                      {surface_.point(u), surface_.point(v)},
                      surface_.point(surface_.target(surface_.next(h))),
                      surface_.point(surface_.target(surface_.next(back))),
                      pieces_[left].triangle == pieces_[right].triangle});
  }
  return true;
}

std::uint32_t NearSurface::beyond(std::uint32_t cell, std::size_t k) const {
  if (cell >= number_.size()) return pieces_[cell - number_.size()].beyond[k];
  const std::uint32_t next = (*neighbours_)[cell][k];
  if (number_[next] == kNone) return next;
  const std::uint64_t key = std::uint64_t{3} * cell + k;
  const auto at = std::lower_bound(shore_.begin(), shore_.end(), std::pair{key, 0U});
  return at->second;  // every side of a far triangle at a near one is a side of a piece
}

}  // namespace robomosp::csg_cgal
