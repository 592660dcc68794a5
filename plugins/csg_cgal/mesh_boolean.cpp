// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_boolean.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <numeric>
#include <unordered_map>

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

namespace robomosp::csg_cgal {
namespace {

namespace PMP = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Point = Kernel::Point_3;
using Surface = CGAL::Surface_mesh<Point>;
using Face = Surface::Face_index;
using Vertex = Surface::Vertex_index;
using PatchMap = Surface::Property_map<Face, std::uint32_t>;

constexpr const char* kPatchProperty = "f:patch";
/// Relative; volumes are summed in double.
constexpr double kVolumeSlack = 1e-9;
/// How far, by its size, a solid is moved whose touching another in an edge or corner leaves no
/// closed surface.
constexpr double kNudge = 1e-9;

PatchMap patches_of(const Surface& s) {
  return s.property_map<Face, std::uint32_t>(kPatchProperty).first;
}

Point exact_point(const Vec3& p) { return {p[0], p[1], p[2]}; }

/// Keeps every triangle's patch through an operation, and lets the user stop it.
class Tracker : public PMP::Corefinement::Default_visitor<Surface> {
 public:
  explicit Tracker(const Progress& progress) : progress_(&progress) {}
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

}  // namespace

namespace {

/// Corners and triangles in an order of their own: CGAL's comes from addresses and differs from run
/// to run.
void sort(PatchMesh& mesh) {
  std::vector<std::uint32_t> order(mesh.points.size()), number(mesh.points.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return mesh.points[a] < mesh.points[b];
  });
  std::vector<Vec3> points;
  points.reserve(order.size());
  for (const std::uint32_t v : order) {
    number[v] = static_cast<std::uint32_t>(points.size());
    points.push_back(mesh.points[v]);
  }
  mesh.points = std::move(points);
  std::vector<std::array<std::uint32_t, 4>> rows;  // patch and corners, the least first
  rows.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<std::uint32_t, 3> c{};
    for (std::size_t k = 0; k < 3; ++k) c[k] = number[mesh.triangles[t][k]];
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    rows.push_back({mesh.patch_of[t], c[0], c[1], c[2]});
  }
  std::sort(rows.begin(), rows.end());
  for (std::size_t t = 0; t < rows.size(); ++t) {
    mesh.patch_of[t] = rows[t][0];
    mesh.triangles[t] = {rows[t][1], rows[t][2], rows[t][3]};
  }
}

}  // namespace

/// A solid that was made of plain corners knows its mesh, one that came of an operation its
/// surface; each makes the other when first needed, by whichever thread.
struct ExactSolid::Impl {
  /// From corners on the grid.
  explicit Impl(PatchMesh given) : mesh_(std::move(given)), is_plain_(true) {
    sort(mesh_);
    measure();
  }
  Impl(Surface given, std::vector<Patch> patches) : surface_(std::move(given)) {
    mesh_.patches = std::move(patches);
  }

  [[nodiscard]] bool is_plain() const { return is_plain_; }
  [[nodiscard]] bool empty() const {
    return is_plain_ ? mesh_.triangles.empty() : surface_.number_of_faces() == 0;
  }
  [[nodiscard]] const std::vector<Patch>& patches() const { return mesh_.patches; }
  [[nodiscard]] const Surface& surface() const {
    if (is_plain_) std::call_once(other_form_, [&] { build(); });
    return surface_;
  }
  [[nodiscard]] const PatchMesh& mesh() const {
    round();
    return mesh_;
  }
  [[nodiscard]] const Box3& box() const {
    round();
    return box_;
  }
  [[nodiscard]] double volume() const {
    round();
    return volume_;
  }

 private:
  void round() const {
    if (is_plain_) return;
    std::call_once(other_form_, [&] {
      mesh_.points.reserve(surface_.number_of_vertices());
      std::vector<std::uint32_t> number(surface_.num_vertices());
      for (const Vertex v : surface_.vertices()) {
        const Point& p = surface_.point(v);
        number[v] = static_cast<std::uint32_t>(mesh_.points.size());
        mesh_.points.push_back(
            {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())});
      }
      const PatchMap patch = patches_of(surface_);
      for (const Face f : surface_.faces()) {
        std::array<std::uint32_t, 3> t{};
        std::size_t k = 0;
        for (const Vertex v : surface_.vertices_around_face(surface_.halfedge(f)))
          t[k++] = number[v];
        mesh_.triangles.push_back(t);
        mesh_.patch_of.push_back(patch[f]);
      }
      sort(mesh_);
      measure();
    });
  }

  void measure() const {
    box_ = box_of(mesh_);
    volume_ = volume_of(mesh_);
  }

  void build() const {
    surface_.reserve(static_cast<Surface::size_type>(mesh_.points.size()),
                     static_cast<Surface::size_type>(3 * mesh_.triangles.size() / 2),
                     static_cast<Surface::size_type>(mesh_.triangles.size()));
    PatchMap patch = surface_.add_property_map<Face, std::uint32_t>(kPatchProperty, 0).first;
    for (const Vec3& p : mesh_.points) surface_.add_vertex(exact_point(p));
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto& v = mesh_.triangles[t];
      const Face f = surface_.add_face(Vertex(v[0]), Vertex(v[1]), Vertex(v[2]));
      if (f == Surface::null_face())
        throw std::runtime_error("a surface that is no manifold, at triangle " + std::to_string(t));
      patch[f] = mesh_.patch_of[t];
    }
  }

  mutable Surface surface_;
  mutable PatchMesh mesh_;
  mutable Box3 box_;
  mutable double volume_ = 0;
  bool is_plain_ = false;
  mutable std::once_flag other_form_;
};

ExactSolid::ExactSolid(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
const PatchMesh& ExactSolid::mesh() const { return impl_->mesh(); }
const Box3& ExactSolid::box() const { return impl_->box(); }
double ExactSolid::volume() const { return impl_->volume(); }
bool ExactSolid::empty() const { return impl_->empty(); }

ExactSolid ExactSolid::from(PatchMesh mesh) {
  return ExactSolid(std::make_shared<Impl>(std::move(mesh)));
}

namespace {

/// Nearer to the origin [m] sums of numbers on the grid are exact.
constexpr double kExactReach = 0x1p53 * kGrid;

bool stays_exact(const Box3& box, const Vec3& shift) {
  for (std::size_t i = 0; i < 3; ++i)
    for (const double x : {box.low[i] + shift[i], box.high[i] + shift[i]})
      if (!(std::abs(x) < kExactReach)) return false;
  return snapped(shift) == shift;
}

}  // namespace

ExactSolid ExactSolid::moved(const Affine& motion, std::uint64_t instance) const {
  if (motion.is_identity() && instance == 0) return *this;
  std::vector<Patch> patches = impl_->patches();
  for (Patch& p : patches) {
    p = csg_cgal::moved(p, motion);
    if (instance != 0) p.id = mixed(p.id, instance);
  }
  if (impl_->is_plain() && motion.is_translation() && stays_exact(box(), motion.t)) {
    PatchMesh mesh = impl_->mesh();
    mesh.patches = std::move(patches);
    for (Vec3& p : mesh.points) p = p + motion.t;
    return from(std::move(mesh));
  }
  const auto& A = motion.A;
  const CGAL::Aff_transformation_3<Kernel> map(A[0], A[1], A[2], motion.t[0], A[3], A[4], A[5],
                                               motion.t[1], A[6], A[7], A[8], motion.t[2]);
  const Kernel::Vector_3 shift(motion.t[0], motion.t[1], motion.t[2]);
  Surface s = impl_->surface();
  if (!motion.is_identity())
    for (const Vertex v : s.vertices())
      s.point(v) = motion.is_translation() ? s.point(v) + shift : map.transform(s.point(v));
  if (motion.is_mirrored()) PMP::reverse_face_orientations(s);
  return ExactSolid(std::make_shared<Impl>(std::move(s), std::move(patches)));
}

namespace {

/// What the operation must keep between: a surface that cuts itself shows here.
bool is_plausible(CsgKind kind, double a, double b, double got) {
  const double slack = kVolumeSlack * (a + b);
  switch (kind) {
    case CsgKind::union_: return got >= std::max(a, b) - slack && got <= a + b + slack;
    case CsgKind::difference: return got >= a - b - slack && got <= a + slack;
    default: return got >= -slack && got <= std::min(a, b) + slack;
  }
}

/// One operation on two solids as they lie; nothing when its result is no closed surface.
std::optional<ExactSolid> try_boolean(CsgKind kind, const ExactSolid& a, const ExactSolid& b,
                                      const Progress& progress) {
  Surface first = a.impl().surface(), second = b.impl().surface(), made;
  std::vector<Patch> patches = a.impl().patches();
  const auto offset = static_cast<std::uint32_t>(patches.size());
  patches.insert(patches.end(), b.impl().patches().begin(), b.impl().patches().end());
  PatchMap patch = patches_of(second);
  for (const Face f : second.faces()) patch[f] += offset;
  made.add_property_map<Face, std::uint32_t>(kPatchProperty, 0);
  const auto with = CGAL::parameters::visitor(Tracker(progress));
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
  const ExactSolid solid(std::make_shared<ExactSolid::Impl>(std::move(made), std::move(patches)));
  if (!is_plausible(kind, a.volume(), b.volume(), solid.volume())) return std::nullopt;
  return solid;
}

Result<BooleanOutcome> boolean(CsgKind kind, const ExactSolid& a, const ExactSolid& b,
                               const Progress& progress) {
  stop_if_cancelled(progress);
  if (auto solid = try_boolean(kind, a, b, progress)) return BooleanOutcome{*solid, ""};
  // Solids that touch in a line or a point: a hair's breadth aside they do or do not.
  const double size = std::max(a.box().diagonal(), b.box().diagonal());
  for (const Vec3& way : {Vec3{0.5345, 0.8018, 0.2673}, Vec3{-0.6350, 0.2540, 0.7295},
                          Vec3{0.1826, -0.5477, -0.8165}}) {
    stop_if_cancelled(progress);
    Affine nudge;
    nudge.t = snapped(way * (kNudge * size));
    if (auto solid = try_boolean(kind, a, b.moved(nudge, 0), progress))
      return BooleanOutcome{*solid, "solids that only touch were moved by " +
                                        millimetres_text(kNudge * size) +
                                        " to get a closed result"};
  }
  return error(ErrorCode::plugin_failed, "the triangles could not be joined to a closed surface",
               "Faces or edges that only touch are the usual cause: move an operand slightly.");
}

/// Solids that have nothing in common side by side.
ExactSolid joined(const std::vector<ExactSolid>& solids) {
  if (solids.size() == 1) return solids.front();
  Surface s;
  std::vector<Patch> patches;
  PatchMap to = s.add_property_map<Face, std::uint32_t>(kPatchProperty, 0).first;
  for (const ExactSolid& solid : solids) {
    const Surface& from = solid.impl().surface();
    const PatchMap patch = patches_of(from);
    const auto offset = static_cast<std::uint32_t>(patches.size());
    patches.insert(patches.end(), solid.impl().patches().begin(), solid.impl().patches().end());
    std::vector<Vertex> vertex(from.num_vertices());
    for (const Vertex v : from.vertices()) vertex[v] = s.add_vertex(from.point(v));
    for (const Face f : from.faces()) {
      std::array<Vertex, 3> t;
      std::size_t k = 0;
      for (const Vertex v : from.vertices_around_face(from.halfedge(f))) t[k++] = vertex[v];
      to[s.add_face(t[0], t[1], t[2])] = patch[f] + offset;
    }
  }
  return ExactSolid(std::make_shared<ExactSolid::Impl>(std::move(s), std::move(patches)));
}

/// Groups of solids whose boxes hang together, each in the order given.
std::vector<std::vector<ExactSolid>> clusters(std::vector<ExactSolid> solids) {
  std::vector<std::size_t> order(solids.size()), parent(solids.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return solids[a].box().low[0] < solids[b].box().low[0];
  });
  const auto root = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const Box3 &a = solids[order[i]].box(), &b = solids[order[j]].box();
      if (b.low[0] > a.high[0]) break;
      if (a.meets(b)) {
        const std::size_t x = root(order[i]), y = root(order[j]);
        parent[std::max(x, y)] = std::min(x, y);
      }
    }
  std::vector<std::vector<ExactSolid>> groups;
  std::unordered_map<std::size_t, std::size_t> group_of;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const auto [at, is_new] = group_of.try_emplace(root(i), groups.size());
    if (is_new) groups.emplace_back();
    groups[at->second].push_back(std::move(solids[i]));
  }
  return groups;
}

}  // namespace

Result<BooleanOutcome> unite(std::vector<ExactSolid> solids, Progress& progress) {
  std::string remedy;
  std::vector<ExactSolid> apart;
  for (auto& group : clusters(std::move(solids))) {
    // Pairs, then pairs of pairs: no triangle takes part in more than log n operations.
    std::deque<ExactSolid> open(group.begin(), group.end());
    while (open.size() > 1) {
      RMP_TRY_ASSIGN(BooleanOutcome two, boolean(CsgKind::union_, open[0], open[1], progress));
      if (!two.remedy.empty()) remedy = two.remedy;
      open.erase(open.begin(), open.begin() + 2);
      open.push_back(std::move(two.solid));
    }
    apart.push_back(std::move(open.front()));
  }
  return BooleanOutcome{joined(apart), std::move(remedy)};
}

Result<BooleanOutcome> subtract(const ExactSolid& solid, std::vector<ExactSolid> tools,
                                Progress& progress) {
  if (tools.empty()) return BooleanOutcome{solid, ""};
  auto tool = unite(tools, progress);
  if (tool.ok()) {
    auto cut = boolean(CsgKind::difference, solid, tool->solid, progress);
    if (cut.ok() && cut->remedy.empty()) cut->remedy = tool->remedy;
    if (cut.ok() || tools.size() == 1) return cut;
  }
  // Tools that cannot be one: one after another.
  BooleanOutcome rest{solid, ""};
  for (const ExactSolid& t : tools) {
    if (rest.solid.empty()) break;
    RMP_TRY_ASSIGN(BooleanOutcome next, boolean(CsgKind::difference, rest.solid, t, progress));
    if (next.remedy.empty()) next.remedy = std::move(rest.remedy);
    rest = std::move(next);
  }
  return rest;
}

Result<BooleanOutcome> intersect(std::vector<ExactSolid> solids, Progress& progress) {
  BooleanOutcome rest{solids.front(), ""};
  for (std::size_t i = 1; i < solids.size() && !rest.solid.empty(); ++i) {
    RMP_TRY_ASSIGN(BooleanOutcome next,
                   boolean(CsgKind::intersection, rest.solid, solids[i], progress));
    if (next.remedy.empty()) next.remedy = std::move(rest.remedy);
    rest = std::move(next);
  }
  return rest;
}

bool orient_outwards(PatchMesh& mesh, std::array<std::uint32_t, 2>& witness) {
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
      throw std::runtime_error("a surface that is no manifold, at triangle " + std::to_string(t));
  }
  std::vector<std::pair<Plain::Face_index, Plain::Face_index>> cuts;
  PMP::self_intersections(s, std::back_inserter(cuts));
  if (!cuts.empty()) {
    witness = {static_cast<std::uint32_t>(cuts.front().first),
               static_cast<std::uint32_t>(cuts.front().second)};
    return false;
  }
  PMP::orient_to_bound_a_volume(s);
  std::size_t t = 0;
  for (const auto f : s.faces()) {
    std::size_t k = 0;
    for (const auto v : s.vertices_around_face(s.halfedge(f)))
      mesh.triangles[t][k++] = static_cast<std::uint32_t>(v);
    ++t;
  }
  return true;
}

}  // namespace robomosp::csg_cgal
