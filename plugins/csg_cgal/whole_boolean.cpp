// SPDX-License-Identifier: GPL-3.0-or-later
#include "whole_boolean.h"

#include <stdexcept>

#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Surface_mesh.h>

#include "exact_corners.h"

namespace robomosp::csg_cgal {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Surface = CGAL::Surface_mesh<Point>;
using Face = Surface::Face_index;
using Vertex = Surface::Vertex_index;
using PatchMap = Surface::Property_map<Face, std::uint32_t>;

constexpr const char* kPatchProperty = "f:patch";

PatchMap patches_of(const Surface& s) {
  return s.property_map<Face, std::uint32_t>(kPatchProperty).first;
}

/// Keeps every triangle's patch through an operation, and lets the user stop it.
class WholeTracker : public PMP::Corefinement::Default_visitor<Surface> {
 public:
  explicit WholeTracker(const Progress& progress) : progress_(&progress) {}
  void before_subface_creations(Face split, Surface& s) {
    stop_if_cancelled(*progress_);
    patch_ = patches_of(s)[split];
  }
  void after_subface_created(Face made, Surface& s) { patches_of(s)[made] = patch_; }
  void after_face_copy(Face from, const Surface& source, Face to, Surface& target) {
    patches_of(target)[to] = patches_of(source)[from];
  }
  void edge_face_intersections_step() const { stop_if_cancelled(*progress_); }
  void intersection_of_coplanar_faces_step() const { stop_if_cancelled(*progress_); }
  void triangulating_faces_step() const { stop_if_cancelled(*progress_); }

 private:
  const Progress* progress_;
  std::uint32_t patch_ = 0;
};

Surface surface_of(const ExactSolid& solid, std::uint32_t patch_offset) {
  const PatchMesh& mesh = solid.mesh();
  Surface s;
  s.reserve(static_cast<Surface::size_type>(mesh.points.size()),
            static_cast<Surface::size_type>(3 * mesh.triangles.size() / 2),
            static_cast<Surface::size_type>(mesh.triangles.size()));
  PatchMap patch = s.add_property_map<Face, std::uint32_t>(kPatchProperty, 0).first;
  for (std::uint32_t v = 0; v < mesh.points.size(); ++v) s.add_vertex(solid.impl().exact(v));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& v = mesh.triangles[t];
    const Face f = s.add_face(Vertex(v[0]), Vertex(v[1]), Vertex(v[2]));
    if (f == Surface::null_face())
      throw std::runtime_error("a surface that is not a manifold, at triangle " +
                               std::to_string(t));
    patch[f] = mesh.patch_of[t] + patch_offset;
  }
  return s;
}

ExactSolid solid_of(const Surface& s, std::vector<Patch> patches) {
  auto impl = std::make_shared<ExactSolid::Impl>();
  auto& mesh = impl->mesh;
  mesh.patches = std::move(patches);
  auto made = std::make_shared<std::vector<Point>>();
  for (const Vertex v : s.vertices()) {
    impl->names.push_back({0, static_cast<std::uint32_t>(made->size())});
    made->push_back(s.point(v));
    mesh.points.push_back(rounded(s.point(v), impl->slack));
  }
  const PatchMap patch = patches_of(s);
  for (const Face f : s.faces()) {
    Triangle t{};
    std::size_t k = 0;
    for (const Vertex v : s.vertices_around_face(s.halfedge(f)))
      t[k++] = static_cast<std::uint32_t>(v);
    mesh.triangles.push_back(t);
    mesh.patch_of.push_back(patch[f]);
  }
  impl->sources.push_back({nullptr, std::move(made), {}});
  impl->measure();
  return ExactSolid(std::move(impl));
}

}  // namespace

std::optional<ExactSolid> whole_boolean(CsgKind kind, const ExactSolid& a, const ExactSolid& b,
                                        const Progress& progress) {
  std::vector<Patch> patches = a.mesh().patches;
  const auto offset = static_cast<std::uint32_t>(patches.size());
  patches.insert(patches.end(), b.mesh().patches.begin(), b.mesh().patches.end());
  Surface first = surface_of(a, 0), second = surface_of(b, offset), made;
  made.add_property_map<Face, std::uint32_t>(kPatchProperty, 0);
  const auto with = CGAL::parameters::visitor(WholeTracker(progress));
  bool is_closed = false;
  switch (kind) {
    case CsgKind::union_:
      is_closed = PMP::corefine_and_compute_union(first, second, made, with);
      break;
    case CsgKind::difference:
      is_closed = PMP::corefine_and_compute_difference(first, second, made, with);
      break;
    default: is_closed = PMP::corefine_and_compute_intersection(first, second, made, with); break;
  }
  if (!is_closed || !CGAL::is_closed(made)) return std::nullopt;
  made.collect_garbage();
  return solid_of(made, std::move(patches));
}

}  // namespace robomosp::csg_cgal
