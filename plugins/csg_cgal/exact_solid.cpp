// SPDX-License-Identifier: GPL-3.0-or-later
#include "exact_solid.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <CGAL/Aff_transformation_3.h>

#include "exact_corners.h"

namespace robomosp::csg_cgal {
namespace {

/// Nearer to the origin [m] sums of numbers on the grid are exact.
constexpr double kExactReach = 0x1p53 * kGrid;
/// Part of the greatest number that rounding adds to an affine map of a corner, at most.
constexpr double kMapError = 1e-15;
double greatest_number(const Box3& box) {
  double most = 0;
  for (std::size_t i = 0; i < 3; ++i)
    most = std::max({most, std::abs(box.low[i]), std::abs(box.high[i])});
  return most;
}

/// Whether corners on the grid come to lie on the grid: quarter turns, mirrors along axes, shifts.
bool stays_exact(const Box3& box, const Affine& m) {
  for (std::size_t row = 0; row < 3; ++row) {
    std::size_t ones = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = std::abs(m.A[3 * row + k]);
      if (x != 0 && x != 1) return false;
      if (x == 1) ++ones;
    }
    if (ones != 1 || !(std::abs(m.t[row]) + greatest_number(box) < kExactReach)) return false;
  }
  return snapped(m.t) == m.t;
}

Point mapped(const Point& p, const Affine& m) {
  if (m.is_translation()) return p + Kernel::Vector_3(m.t[0], m.t[1], m.t[2]);
  const auto& A = m.A;
  return CGAL::Aff_transformation_3<Kernel>(A[0], A[1], A[2], m.t[0], A[3], A[4], A[5], m.t[1],
                                            A[6], A[7], A[8], m.t[2])
      .transform(p);
}

}  // namespace

// Exactly, for what is known of a point before depends on what was asked of it, and that on the
// order in which CGAL asks.
Vec3 rounded(const Point& p, double& slack) {
  Vec3 middle{};
  const auto look = [&] {
    double worst = 0;
    std::size_t i = 0;
    for (const auto& x : {p.x(), p.y(), p.z()}) {
      const auto [low, high] = CGAL::to_interval(x);
      middle[i++] = low == high ? low : low + (high - low) / 2;
      worst = std::max(worst, high - low);
    }
    return worst;
  };
  if (look() > 0) {
    (void)CGAL::exact(p);
    slack = std::max(slack, look());
  }
  return middle;
}

void ExactSolid::Impl::measure() {
  box = box_of(mesh);
  volume = volume_of(mesh);
}

Point ExactSolid::Impl::exact(std::uint32_t corner) const {
  if (is_plain(corner)) return exact_point(mesh.points[corner]);
  const CornerName name = names[corner];
  const CornerSource& from = sources[name.source];
  Point p = from.made ? (*from.made)[name.index] : exact_point((*from.plain)[name.index]);
  for (const Affine& m : from.motions) p = mapped(p, m);
  return p;
}

ExactSolid::ExactSolid(std::shared_ptr<const Impl> impl) : impl_(std::move(impl)) {}
const PatchMesh& ExactSolid::mesh() const { return impl_->mesh; }
const Box3& ExactSolid::box() const { return impl_->box; }
double ExactSolid::volume() const { return impl_->volume; }
bool ExactSolid::empty() const { return impl_->mesh.triangles.empty(); }

const std::vector<Triangle>& ExactSolid::neighbours() const {
  std::call_once(impl_->neighbours_once, [&] {
    if (!impl_->neighbours.empty()) return;  // whoever made the solid knew them
    auto all = neighbours_of(impl_->mesh.triangles, impl_->mesh.points.size());
    if (!all) throw std::runtime_error("a surface that is not closed");
    impl_->neighbours = std::move(*all);
  });
  return impl_->neighbours;
}

const BoxTree& ExactSolid::tree() const {
  std::call_once(impl_->tree_once, [&] {
    impl_->tree = BoxTree(impl_->mesh.points, impl_->mesh.triangles, impl_->slack);
  });
  return impl_->tree;
}

ExactSolid ExactSolid::from(PatchMesh mesh) {
  auto impl = std::make_shared<Impl>();
  impl->mesh = std::move(mesh);
  impl->measure();
  return ExactSolid(std::move(impl));
}

ExactSolid ExactSolid::from(PatchMesh mesh, std::vector<Triangle> neighbours, BoxTree tree) {
  auto impl = std::make_shared<Impl>();
  impl->mesh = std::move(mesh);
  impl->measure();
  impl->neighbours = std::move(neighbours);
  std::call_once(impl->tree_once, [&] { impl->tree = std::move(tree); });
  return ExactSolid(std::move(impl));
}

ExactSolid ExactSolid::moved(const Affine& motion, std::uint64_t instance) const {
  if (motion.is_identity() && instance == 0) return *this;
  {
    const std::lock_guard lock(impl_->copy_mutex);
    const auto& c = impl_->copy;
    if (c && c->instance == instance && c->motion.A == motion.A && c->motion.t == motion.t)
      return ExactSolid(c->impl);
  }
  const Impl& in = *impl_;
  auto out = std::make_shared<Impl>();
  out->mesh = in.mesh;
  for (Patch& p : out->mesh.patches) {
    p = csg_cgal::moved(p, motion);
    if (instance != 0) p.id = mixed(p.id, instance);
  }
  out->neighbours = neighbours();
  out->names = in.names;
  out->sources = in.sources;
  out->slack = in.slack;
  if (motion.is_identity()) {
    out->box = in.box;
    out->volume = in.volume;
  } else {
    const bool plain_stay = stays_exact(in.box, motion);
    double most = 0;
    for (const double x : motion.A) most = std::max(most, std::abs(x));
    for (Vec3& p : out->mesh.points) p = motion(p);
    for (CornerSource& s : out->sources) s.motions.push_back(motion);
    if (!plain_stay) {
      CornerSource here;
      here.plain = std::make_shared<const std::vector<Vec3>>(in.mesh.points);
      here.motions = {motion};
      const auto number = static_cast<std::uint32_t>(out->sources.size());
      if (out->names.empty()) out->names.resize(in.mesh.points.size());
      for (std::uint32_t v = 0; v < out->names.size(); ++v)
        if (out->names[v].source == CornerName::kPlain) out->names[v] = {number, v};
      out->sources.push_back(std::move(here));
    }
    if (!plain_stay || in.slack > 0)
      out->slack =
          3 * most * in.slack + kMapError * (3 * most * greatest_number(in.box) +
                                             std::max({std::abs(motion.t[0]), std::abs(motion.t[1]),
                                                       std::abs(motion.t[2])}));
    if (motion.is_mirrored())
      for (std::size_t t = 0; t < out->mesh.triangles.size(); ++t) {
        std::swap(out->mesh.triangles[t][1], out->mesh.triangles[t][2]);
        std::swap(out->neighbours[t][0], out->neighbours[t][2]);
      }
    out->measure();
  }
  const std::lock_guard lock(in.copy_mutex);
  in.copy = Impl::Copy{motion, instance, out};
  return ExactSolid(std::move(out));
}

}  // namespace robomosp::csg_cgal
